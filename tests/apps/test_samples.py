"""``taichi-tracer samples``: tables and pictures for environments and scenes, and one line for what cannot be."""

import pytest

from taichi_tracer.apps.cli import main
from taichi_tracer.files.images import read_image

pytestmark = pytest.mark.usefixtures("f32")


def test_an_environment_gets_a_table_and_two_maps(tmp_path, capsys):
    assert main(["samples", "white", "--count", "2000", "--size", "16x8", "-o", str(tmp_path / "new")]) == 0
    out = capsys.readouterr().out
    assert "white, 4x2: 2,000 samples, counted in 16x8 cells" in out
    assert "importance" in out
    names = sorted(path.name for path in (tmp_path / "new").iterdir())
    assert names == ["samples_white_importance.png", "samples_white_uniform.png"]
    assert all(f"wrote {tmp_path / 'new' / name}" in out for name in names)
    assert read_image(tmp_path / "new" / names[0]).shape[1] == 960
