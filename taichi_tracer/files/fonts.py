"""Letters for text within pictures."""

from pathlib import Path


def font_of(size: int):
    """DejaVu Sans, which comes with Matplotlib, with letters of this size in pixels."""
    import matplotlib
    from PIL import ImageFont

    return ImageFont.truetype(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf", size)
