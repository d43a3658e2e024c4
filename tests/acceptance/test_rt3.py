"""Documents of RT3: for each camera, background, object, transform, light and film option, the pixel is right."""

import numpy as np
import pytest
from acceptance.command import command

import taichi_tracer as tt

LOOK = '<lookat look_from="0 0 -5" look_at="0 0 0" up="0 1 0"/>'
EYE = '<camera type="orthographic" screen_window="-2 2 -2 2"/>'
FILM = '<film type="image" x_res="16" y_res="16"/>'
RED = '<material type="flat" color="1 0 0"/>'
SQUARE = 'type="trianglemesh" vertices="-1 -1 0 -1 1 0 1 1 0 1 -1 0" indices="0 1 2 0 2 3"'
BALL = '<object type="sphere" radius="1" center="0 0 0"/>'
GRAY = '<material type="blinn" diffuse="0.5 0.5 0.5" ambient="0.5 0.5 0.5"/>'
PHONG = '<integrator type="blinn_phong" depth="2"/>'


def document(world="", camera=EYE, film=FILM, integrator="", look=LOOK, after=""):
    """A whole document."""
    return f"<RT3>{look}{camera}{film}{integrator}<world_begin/>{world}<world_end/>{after}</RT3>"


def image(folder, *words, **parts):
    """The picture that the command line makes of a document, in linear numbers."""
    (folder / "scene.xml").write_text(document(**parts))
    assert command("render", folder / "scene.xml", *words, "-o", folder / "x.npy") == 0
    return np.load(folder / "x.npy")


def covered(picture):
    """How much of a picture is red."""
    return float((picture[..., 0] > 0.5).mean())


CIRCLE = np.pi / 16  # of a ball of radius 1 in a window of 4 × 4
PERSPECTIVE = '<camera type="perspective" fovy="40"/>'
SHAPES = {
    "ball": (BALL, EYE, CIRCLE),
    "ball, wide window": (BALL, '<camera type="orthographic" screen_window="-4 4 -4 4"/>', CIRCLE / 4),
    "square": (f"<object {SQUARE}/>", EYE, 1 / 4),
    "square, perspective": (f"<object {SQUARE}/>", PERSPECTIVE, 1 / (5 * np.tan(np.radians(20))) ** 2),
    "square, window": (
        f"<object {SQUARE}/>",
        '<camera type="perspective" screen_window="-0.4 0.4 -0.4 0.4"/>',
        0.25,
    ),
    "culled": (f'<object {SQUARE} reverse_vertex_order="true" backface_cull="true"/>', EYE, 0.0),
    "scaled": (f'<scale value="0.5 1.5 1"/><object {SQUARE}/>', EYE, 0.75 / 4),
    "moved out": (f'<translate value="2 0 0"/><object {SQUARE}/>', EYE, 1 / 8),
    "turned": (f'<rotate angle="90" axis="0 1 0"/><object {SQUARE}/>', EYE, 0.0),
    "matrix": (f'<matrix value="0.5 0 0 0  0 0.5 0 0  0 0 1 0"/><object {SQUARE}/>', EYE, 1 / 16),
    "popped": (f'<push_CTM/><scale value="9"/><pop_CTM/><object {SQUARE}/>', EYE, 1 / 4),
    "reset": (f'<scale value="9"/><identity/><object {SQUARE}/>', EYE, 1 / 4),
    "instances": (
        f'<object_instance_begin name="one"/><scale value="0.5"/><object {SQUARE}/><object_instance_end/>'
        '<object_instance_call name="one"/><translate value="1.2 0 0"/><object_instance_call name="one"/>',
        EYE,
        1 / 8,
    ),
}


@pytest.mark.parametrize("name", SHAPES)
def test_an_object_covers_what_it_should(name, tmp_path):
    world, camera, share = SHAPES[name]
    picture = image(tmp_path, "--size", "64x64", world=RED + world, camera=camera)
    assert covered(picture) == pytest.approx(share, abs=0.015)
    assert picture[..., 1:].max() == 0


def test_named_materials_and_the_state_of_graphics(tmp_path):
    world = '<make_named_material name="g" type="flat" color="0 255 0"/>' + RED
    world += f'<push_GS/><named_material name="g"/><pop_GS/><object {SQUARE}/>'
    world += f'<translate value="0 0 -1"/><scale value="0.5"/><object {SQUARE} material="g"/>'
    picture = image(tmp_path, world=world)
    assert picture[8, 8].tolist() == [0, 1, 0]
    assert picture[8, 5].tolist() == [1, 0, 0]


def test_backgrounds(tmp_path):
    four = '<background type="4_colors" bl="0 0 0" br="1 0 0" tl="0 1 0" tr="1 1 0"/>'
    picture = image(tmp_path, world=four)
    at = (np.arange(16) + 0.5) / 16
    assert np.allclose(picture[..., 0], np.broadcast_to(at, (16, 16)), atol=1e-5)
    assert np.allclose(picture[..., 1], at[::-1, None], atol=1e-5)
    assert np.allclose(image(tmp_path, world='<background type="colors" color="0.25 0.5 1"/>'), [0.25, 0.5, 1])
    assert np.allclose(image(tmp_path, world='<background type="single_color" color="51 0 255"/>'), [0.2, 0, 1])


LIGHTS = {
    "ambient": ('<light_source type="ambient" L="0.4"/>', 0.5 * 0.4),
    "directional": ('<light_source type="directional" L="0.5" scale="2" from="0 3 -4" to="0 0 0"/>', 0.5 * 0.8),
    "point": ('<light_source type="point" I="4" from="0 0 -2" attenuation="0 0 1"/>', 0.5),
    "point that does not fall off": ('<light_source type="point" I="0.6" from="0 0 -2"/>', 0.5 * 0.6),
    "spot": ('<light_source type="spot" I="0.6" from="0 0 -2" to="0 0 0" cutoff="30" falloff="10"/>', 0.5 * 0.6),
    "spot that misses": ('<light_source type="spot" I="1" from="0 0 -2" to="5 0 0" cutoff="30"/>', 0.0),
    "in shadow": (
        '<light_source type="directional" L="1" from="0 0 -4" to="0 0 0"/>'
        f'<translate value="0 0 -8"/><object {SQUARE}/>',
        0.0,
    ),
}


@pytest.mark.parametrize("name", LIGHTS)
def test_the_middle_of_a_gray_square_under_each_light(name, tmp_path):
    world, right = LIGHTS[name]
    film = '<film type="image" x_res="15" y_res="15"/>'
    picture = image(tmp_path, world=GRAY + f"<object {SQUARE}/>" + world, integrator=PHONG, film=film)
    assert picture[7, 7] == pytest.approx(np.full(3, right), abs=2e-3)


def test_a_mirror_shows_what_is_behind_the_eye(tmp_path):
    mirror = '<material type="blinn" diffuse="0 0 0" mirror="0.5 0.5 0.5"/>'
    world = f'{mirror}<object {SQUARE}/><light_source type="ambient" L="1"/><translate value="0 0 -9"/>'
    world += (
        f'<material type="blinn" diffuse="0 0 0" ambient="0.2 0.4 0.8"/><object {SQUARE} reverse_vertex_order="true"/>'
    )
    picture = image(tmp_path, world=world, integrator=PHONG)
    assert picture[8, 8] == pytest.approx([0.1, 0.2, 0.4], abs=1e-5)


@pytest.mark.parametrize(
    ("integrator", "middle"),
    [
        ('type="normal_map"', [0.5, 0.5, 0.0]),
        ('type="depth_map" near_color="1 0 0" far_color="0 0 1" zmin="4" zmax="6"', [0.5, 0.0, 0.5]),
        ('type="flat"', [1, 0, 0]),
    ],
)
def test_integrators(integrator, middle, tmp_path):
    picture = image(tmp_path, world=f"{RED}<object {SQUARE}/>", integrator=f"<integrator {integrator}/>")
    assert picture[8, 8] == pytest.approx(middle, abs=1e-5)


def test_options_of_the_film(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    film = '<film type="image" x_res="20" y_res="10" filename="{}" img_type="png" gamma_corrected="{}"'
    gray = '<background type="colors" color="0.5 0.5 0.5"/>'
    shape = '<camera type="orthographic"/>'
    for name, gamma, crop in (("a.png", "yes", ""), ("b.png", "no", 'crop_window="0 0.5 0 1"')):
        text = document(gray, shape, f"{film.format(name, gamma)} {crop}/>")
        (tmp_path / "scene.xml").write_text(text)
        assert command("render", "scene.xml") == 0
    first, second = (np.asarray(tt.read_image(name)) for name in ("a.png", "b.png"))
    assert (first.shape, second.shape) == ((10, 20, 3), (10, 10, 3))
    assert command("compare", "a.png", "a.png") == 0
    from PIL import Image

    assert np.asarray(Image.open("a.png"))[0, 0, 0] == 188  # sRGB of 0.5
    assert np.asarray(Image.open("b.png"))[0, 0, 0] in (127, 128)


def test_render_again_takes_another_picture(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    again = f'{EYE.replace("-2 2 -2 2", "-4 4 -4 4")}<film type="image" x_res="16" y_res="16" filename="b.pfm"/>'
    film = '<film type="image" x_res="16" y_res="16" filename="a.png"/>'
    again = again.replace("b.pfm", "b.png")
    (tmp_path / "scene.xml").write_text(document(RED + BALL, film=film, after=f"{again}<render_again/>"))
    assert command("render", "scene.xml") == 0
    first, second = (np.asarray(tt.read_image(name)) for name in ("a.png", "b.png"))
    assert covered(first) == pytest.approx(4 * covered(second), rel=0.3)


def test_a_scene_that_is_exported_is_the_same_picture(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command("export", "cornell_box", "box.xml", "--size", "24x24") == 0
    for scene, name in (("cornell_box", "a.npy"), ("box.xml", "b.npy")):
        assert command("render", scene, "--view", "normal", "--size", "24x24", "-o", name) == 0
    assert (abs(np.load("a.npy") - np.load("b.npy")).max(-1) < 1e-3).mean() > 0.99
