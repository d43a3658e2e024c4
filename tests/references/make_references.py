"""Render the reference pictures anew:  python tests/references/make_references.py

They are compared with an independent float64 computation in tests/test_surface_views.py.
"""

from pathlib import Path

import taichi_tracer as tt


def main() -> None:
    """Write every view of the Cornell box."""
    renderer = tt.A1Renderer(scene_data=tt.load_scene_data("cornell_box"), width=96, height=96)
    for name in renderer.names():
        tt.save_image(Path(__file__).parent / f"cornell_box_{name}.png", renderer.use(name).image())


if __name__ == "__main__":
    main()
