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


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nowhere"], "unknown environment or scene 'nowhere'"),
        (["no_such.hdr"], "no_such.hdr: no such file"),
        (["no_such.obj"], "no_such.obj: no such file"),
        (["cube", "--point", "0", "0", "0"], "no surface emits light"),
        (["studio", "--point", "0", "0", "0"], "--point belongs to a scene"),
        (["cornell_box", "--point", "0", "nan", "0"], "--point must be three finite numbers, not 0 nan 0"),
        (["cornell_box", "--normal", "0", "0", "0"], "--normal must not be 0 0 0"),
        (["studio", "--count", "0"], "'0' is not a whole number of at least 1"),
        (["studio", "--count", "100000001"], "count must be from 1 to 100,000,000, not 100,000,001"),
        (["studio", "--size", "0x8"], "is not WIDTHxHEIGHT"),
    ],
)
def test_what_cannot_be_sampled_is_told_in_one_line(words, message, tmp_path, capsys):
    assert main(["samples", *words, "-o", str(tmp_path / "new")]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "new").exists()
