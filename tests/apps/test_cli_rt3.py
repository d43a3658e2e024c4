"""The command line and RT3's scene files: what the file says, what wins over it, and what is written."""

import pytest

from taichi_tracer.apps.cli import main, make_parser
from taichi_tracer.apps.commands.render import paths_of, render_of

SCENE = """<RT3>
<lookat look_from="0 0 -5" look_at="0 0 0" up="0 1 0"/>
<camera type="perspective" fovy="60"/>
<film x_res="32" y_res="24" crop_window="{crop}"
      filename="pictures/{name}" img_type="{kind}" gamma_corrected="{gamma}"/>
<world_begin/>
<background bl="0 0 0" tl="0 1 0" tr="1 1 0" br="1 0 0"/>
<material type="flat" color="0.5 0.25 1"/>
<object type="sphere" radius="1"/>
<object type="trianglemesh" vertices="-9 -2 -3 -9 -2 9 9 -2 9 9 -2 -3" indices="0 1 2 0 2 3"/>
<world_end/>
{tail}
</RT3>"""


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """Writes ``scene.xml`` into an empty folder, and works there."""
    monkeypatch.chdir(tmp_path)

    def write(crop="0 1 0 1", name="ball", kind="png", gamma="yes", tail=""):
        (tmp_path / "scene.xml").write_text(SCENE.format(crop=crop, name=name, kind=kind, gamma=gamma, tail=tail))
        return tmp_path

    return write


def asked(*words):
    """The pictures that a command asks for, and where they go; nothing is rendered."""
    args = make_parser().parse_args(["render", "scene.xml", *words])
    request = render_of(args)
    return request.pictures, [str(path) for files in paths_of(request, args) for path in files]


def test_options_win(scene):
    scene(crop="0.5 1 0.5 1")
    (picture,), paths = asked()
    assert (picture.settings.size, picture.crop) == ((32, 24), (16, 32, 12, 24))
    assert picture.integrator.name == "flat"
    assert (picture.target.spp, paths) == (1, ["pictures/ball.png"])
    (picture,), paths = asked("--size", "20x10", "--crop", "0", "1", "0", "0.5", "--view", "mis", "--spp", "3")
    assert (picture.settings.size, picture.crop, picture.target.spp) == ((20, 10), (0, 20, 0, 5), 3)
    assert picture.integrator.name == "mis"
    assert paths == ["renders/scene_mis.png"]
    (picture,), paths = asked("--quick", "-o", "b.ppm")
    assert (picture.settings.size, paths) == ((8, 6), ["b.ppm"])


def test_every_picture_of_a_document_has_its_file(scene, capsys):
    scene(tail='<integrator type="direct" estimator="brdf" spp="9"/><render_again/>')
    found, paths = asked()
    assert [picture.target.spp for picture in found] == [1, 9]
    assert [picture.integrator.name for picture in found] == ["flat", "brdf"]
    assert paths == ["pictures/ball.png", "pictures/ball_2.png"]
    assert asked("-o", "there/")[1] == ["there/ball.png", "there/ball_2.png"]
    assert asked("--view", "normal")[1] == ["renders/scene_normal.png", "renders/scene_normal_2.png"]
    assert main(["render", "scene.xml", "-o", "one.png"]) == 2
    assert "is one file for 2 views" in capsys.readouterr().err
