"""The scenes and environments that come with the package."""

from pathlib import Path


def scene_data_dir() -> Path:
    """The folder of shipped scenes: inside the installed package, or beside it in a checkout."""
    package = Path(__file__).parent.parent
    inside = package / "scene_data_dir"
    return inside if inside.is_dir() else package.parent / "scene_data_dir"


def shipped_environments() -> dict[str, Path]:
    """Name → file of every shipped environment."""
    return {p.stem: p for p in sorted((scene_data_dir() / "environments").glob("*.npy"))}
