"""RT3 documents: what they say, and the many ways not to say it, each told with file, line and value."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rt3_text import HEAD, document, read

from taichi_tracer.rt3.document import BACKGROUNDS, INTEGRATORS, FilmSettings
from taichi_tracer.system.errors import InputError


def shot_of(tmp_path, *settings_):
    return read(tmp_path, document(head=HEAD + "".join(settings_))).shots[0]


# --- What is read -----------------------------------------------------------------------------------------------------


def test_the_orthographic_example_of_the_document(tmp_path):
    """As printed, blanks and comments included; C-11 is told."""
    found = read(
        tmp_path,
        """<RT3>
<lookat look_from="0 7 0" look_at="0 0 0" up="0 0 1" />
<camera type="orthographic" screen_window="-5.3 5.3 -4 4"/>
<film type="image" x_res="2800" y_res="1800" crop_window="0 1 0 1"
filename="../images/gcodex_matte_ortho.png"
img_type="png" gamma_corrected="yes" />

<world_begin/>
<background type="colors" color="0.14 0.19 0.26" />
<!-- Here goes the rest of the file, including scene definition. -->

<world_end/>
</RT3>""",
    )
    (shot,) = found.shots
    assert shot.view == {
        "projection": "orthographic",
        "screen_window": (-5.3, 5.3, -4.0, 4.0),
        "eye": (0, 7, 0),
        "at": (0, 0, 0),
        "up": (0, 0, 1),
    }
    assert shot.film == FilmSettings(2800, 1800, (0, 1, 0, 1), "../images/gcodex_matte_ortho.png", True)
    assert found.background == (0.14, 0.19, 0.26)
    assert found.mesh.notes == [
        f"{tmp_path}/scene.xml:3: the window is not shaped as the 2800x1800 film: "
        "objects are stretched by 17 % in width (C-11)",
        f"{tmp_path}/scene.xml:12: the world is empty, so that pictures of it show only the background",
    ]


def test_synonyms_mean_the_same(tmp_path):
    """C-13, and those of the course's later documents."""
    film = shot_of(tmp_path, '<film w_res="70" h_res="50" img_type="ppm6" filename="a"/>').film
    assert (film.width, film.height, film.filename) == (70, 50, "a.ppm")
    view = shot_of(tmp_path, '<camera type="orthographic" frame_aspectratio="2"/>').view
    assert view["frame_aspect"] == 2
    for kind in (word for word, meaning in BACKGROUNDS.items() if meaning == "colors"):
        one = read(tmp_path, document(f'<background type="{kind}" color="51 0 255"/>'))
        assert one.background == (0.2, 0, 1)
        four = read(tmp_path, document(f'<background type="{kind}" bl="0 0 0" tl="1 1 1" tr="0 0 255" br="0 0 0"/>'))
        assert four.background[1] == (1 / 255,) * 3  # the colours of one element are judged together
    for word, meaning in INTEGRATORS.items():
        name = "mis" if meaning == "direct" else meaning  # the estimator
        assert shot_of(tmp_path, f'<integrator type="{word}"/>').integrator.name == name
    for on, off in zip(("yes", "true", "on", "1"), ("no", "false", "off", "0"), strict=True):
        assert shot_of(tmp_path, f'<film x_res="2" y_res="2" gamma_corrected="{on}"/>').film.gamma_corrected
        assert not shot_of(tmp_path, f'<film x_res="2" y_res="2" gamma_corrected="{off}"/>').film.gamma_corrected


def test_unknown_words_are_told_with_their_line_and_the_nearest(tmp_path):
    world = '<sphere radius="1"/>\n<objetc type="sphere"/>\n<object type="sphere" radius="1" centre_="0 0 0"/>'
    notes = read(tmp_path, document(world, HEAD.replace("y_res", 'yres="30" y_res'))).mesh.notes
    told = [note.removeprefix(f"{tmp_path}/scene.xml:") for note in notes]
    assert told[0].startswith("4: unknown attribute of <film> 'yres': did you mean 'y_res'? ")
    assert told[1].startswith("6: unknown tag 'sphere': ")
    assert told[2].startswith("7: unknown tag 'objetc': did you mean 'object'? ")
    assert told[3].startswith("8: unknown attribute of <object> 'centre_': did you mean 'centre'? ")


def test_render_again_takes_another_picture_with_what_was_said_since(tmp_path):
    tail = '<camera type="perspective" fovy="40"/>'
    tail += '<integrator type="depth_map" near_color="1 1 1" far_color="0 0 0" zmin="1"/>'
    first, second, third = read(tmp_path, document(tail=f"{tail}<render_again/><render_again/>")).shots
    assert (first.view["projection"], second.view["projection"]) == ("orthographic", "perspective")
    assert first.integrator.name == "flat"
    assert second.integrator.values == {"near_color": (1, 1, 1), "far_color": (0, 0, 0), "zmin": 1}
    assert third == second


def test_backgrounds_of_images_and_of_everything_around(tmp_path):
    np.save(tmp_path / "sky.npy", np.ones((2, 4, 3), np.float32))
    stretched = read(tmp_path, document('<background type="image" filename="sky.npy"/>'))
    assert (stretched.background, stretched.environment) == (tmp_path / "sky.npy", None)
    around = read(tmp_path, document('<background type="spherical" filename="sky.npy" intensity="2" rotation="30"/>'))
    assert (around.background, around.environment) == (None, tmp_path / "sky.npy")
    assert around.environment_options == {"intensity": 2, "rotation": 30}


# --- What is refused --------------------------------------------------------------------------------------------------

MESH = '<object type="trianglemesh" '
TRIANGLE = 'vertices="0 0 0 1 0 0 0 1 0" indices="0 1 2" '
BOMB = "".join(f'<!ENTITY l{k + 1} "{f"&l{k};" * 10}">' for k in range(9))

MALFORMED = {
    # no XML at all
    "empty": ("", "no element found"),
    "blank": (" \n ", "no element found"),
    "not xml": ("v 0 0 0\nf 1 1 1\n", ":1: this is not well-formed XML"),
    "binary": (b"\x00\x01\x02\xff" * 50, ":1: this is not well-formed XML"),
    "truncated in a tag": (document()[:70], "this is not well-formed XML"),
    "truncated after a tag": (HEAD, ":5: this is not well-formed XML: no element found"),
    "wrong nesting": (document("<a><b></a></b>"), ":6: this is not well-formed XML: mismatched tag"),
    "two roots": (document() + "<RT3/>", ":9: this is not well-formed XML: junk after document element"),
    "no quotes": (document("<object type=sphere/>"), ":6: this is not well-formed XML"),
    "attribute twice": (document('<scale value="1" value="2"/>'), ":6: this is not well-formed XML: duplicate"),
    "bare ampersand": (document('<material name="a & b"/>'), ":6: this is not well-formed XML"),
    "control character": (document('<material type="\x01"/>'), ":6: this is not well-formed XML"),
    "not utf-8": (b'<RT3 a="\xff\xfe"/>', ":1: this is not well-formed XML"),
    "unknown encoding": ('<?xml version="1.0" encoding="klingon"?><RT3/>', ":1: this is not well-formed XML"),
    # entities
    "entity": ('<!DOCTYPE RT3 [<!ENTITY a "b">]><RT3>&a;</RT3>', ":1: a document type (<!DOCTYPE>) and entities"),
    "entity bomb": (f'<!DOCTYPE RT3 [<!ENTITY l0 "lol">{BOMB}]>\n<RT3 a="&l9;"/>', ":1: a document type"),
    "external entity": (
        '<!DOCTYPE RT3 [<!ENTITY e SYSTEM "file:///etc/passwd">]><RT3>&e;</RT3>',
        ":1: a document type",
    ),
    "external type": ('<!DOCTYPE RT3 SYSTEM "http://127.0.0.1:9/a.dtd"><RT3/>', ":1: a document type"),
    "undeclared entity": (document("&nothing;"), ":6: this is not well-formed XML: undefined entity"),
    # too much
    "includes itself": (document('<include filename="scene.xml"/>'), ":6: scene.xml includes itself"),
    # the course of things
    "no world": (HEAD + "</RT3>", "the document has no <world_begin/>"),
    "no end": (HEAD + "<world_begin/></RT3>", "the world that began at"),
    "end first": (HEAD + "<world_end/></RT3>", ":5: <world_end> has no world_begin before it"),
    "two worlds": (document(tail="<world_begin/><world_end/>"), ":8: <world_begin> is the second one"),
    "again first": (HEAD + "<render_again/></RT3>", ":5: <render_again> stands before world_end"),
    "object outside": (HEAD + '<object type="sphere" radius="1"/></RT3>', ":5: <object> belongs into the world, but"),
    "object after": (document(tail="<identity/>"), ":8: <identity> belongs into the world, but stands after world_end"),
    "no camera": (document(head=HEAD.replace("<camera", "<kamera")), ":7: the document has no <camera> before"),
    "no film": (document(head=HEAD.replace("<film", "<movie")), ":7: the document has no <film> before"),
    "no lookat": (document(head=HEAD.replace("<lookat", "<peek")), ":7: the document has no <lookat> before"),
    "pop": (document("<pop_CTM/>"), ":6: <pop_CTM> has no push_CTM before it: nothing is pushed"),
    "pop other": (
        document("<push_GS/><pop_CTM/>"),
        ":6: <pop_CTM> has no push_CTM before it: the last push was push_GS",
    ),
    # settings
    "look nowhere": (HEAD.replace('"0 7 0"', '"0 0 0"'), ":2: <lookat> look_from and look_at are the same point"),
    "up along": (HEAD.replace('"0 0 1"', '"0 3 0"'), ":2: <lookat> up (0, 3, 0) is parallel to the gaze"),
    "two numbers": (HEAD.replace('"0 7 0"', '"0 7"'), ":2: <lookat> look_from must be 3 finite numbers, not '0 7'"),
    "no number": (HEAD.replace('"0 7 0"', '"0 x 0"'), ":2: <lookat> look_from must be 3 finite numbers, not '0 x 0'"),
    "nan": (HEAD.replace('"0 7 0"', '"0 nan 0"'), ":2: <lookat> look_from must be 3 finite numbers, not '0 nan 0'"),
    "overflow": (HEAD.replace('"0 7 0"', '"0 1e999 0"'), ":2: <lookat> look_from must be 3 finite numbers"),
    "no look_from": (HEAD.replace("look_from", "lookfrom"), ":2: <lookat> needs the attribute look_from ('lookfrom'"),
    "camera kind": (HEAD.replace('"ortho', '"otho'), "did you mean 'orthographic'?"),
    "window empty": (HEAD.replace("-4 4", "4 -4"), ":3: <camera> screen_window is l r b t with l < r"),
    "fovy": (HEAD + '<camera type="perspective" fovy="180"/>', ":5: <camera> fov must be between 0 and 180"),
    "focal distance": (
        HEAD + '<camera type="perspective" focal_distance="0"/>',
        "focal_distance must be a number above 0",
    ),
    "film size": (HEAD.replace('"40"', '"0"'), ":4: <film> x_res must be a whole number from 1"),
    "film half": (HEAD.replace('"40"', '"40.5"'), ":4: <film> x_res must be a whole number from 1 to 1073741824, not"),
    "film huge": (HEAD.replace('"40"', '"99999999"'), ":4: <film> 99999999 x 30 are more than"),
    "film digits": (HEAD.replace('"40"', f'"{"9" * 5000}"'), ":4: <film> x_res must be a whole number"),
    "size twice": (HEAD.replace("x_res", 'w_res="3" x_res'), ":4: <film> x_res and w_res mean the same"),
    "crop": (
        HEAD + '<film x_res="4" y_res="4" crop_window="0 1 0.5 0.5"/>',
        ":5: <film> crop_window: a crop window is",
    ),
    "crop of none": (HEAD + '<film x_res="4" y_res="4" crop_window="0.3 0.4 0 1"/>', "holds no pixel of 4x4"),
    "image type": (HEAD + '<film x_res="4" y_res="4" img_type="gif"/>', ":5: unknown <film> img_type 'gif'"),
    "gamma": (HEAD + '<film x_res="4" y_res="4" gamma_corrected="2.2"/>', "gamma_corrected '2.2': known are yes, true"),
    "integrator": (HEAD + '<integrator type="blin"/>', ":5: unknown <integrator> type 'blin'"),
    "depth": (
        HEAD + '<integrator type="depth_map" zmin="2" zmax="1"/>',
        ":5: <integrator> zmin 2 must be less than zmax 1",
    ),
    "three corners": (HEAD + '<background type="colors" bl="0 0 0" tl="0 0 0" tr="1 1 1"/>', "needs either color, or"),
    "color": (HEAD + '<background color="0 256 0"/>', ":5: <background> color must be a colour"),
    "negative color": (HEAD + '<background color="0 -1 0"/>', ":5: <background> color must be a colour"),
    "no image": (
        HEAD + '<background type="image" filename="a.png"/>',
        ":5: <background> filename: no such file 'a.png'",
    ),
    # the world
    "object kind": (document('<object type="teapot"/>'), ":6: unknown <object> type 'teapot'"),
    "no type": (document("<object/>"), ":6: <object> needs the attribute type"),
    "no radius": (document('<object type="sphere"/>'), ":6: <object> needs the attribute radius"),
    "radius": (
        document('<object type="sphere" radius="-1"/>'),
        ":6: <object> radius must be a number above 0, not '-1'",
    ),
    "flat scale": (document('<scale value="1 0 1"/>'), ":6: <scale> value must be numbers other than 0"),
    "axis": (document('<rotate angle="1" axis="0 0 0"/>'), ":6: <rotate> axis must be a direction, not '0 0 0'"),
    "material": (document('<material type="glas"/>'), ":6: unknown <material> type 'glas'"),
    "no material": (document('<named_material name="x"/>'), ":6: unknown <named_material> name 'x'"),
    "no system": (document('<restore_coord_system name="x"/>'), "unknown <restore_coord_system> name 'x'"),
    "empty name": (
        document('<make_named_material name=" "/>'),
        ":6: <make_named_material> name must be a name, not ' '",
    ),
    "index": (
        document(f'{MESH}vertices="0 0 0 1 0 0" indices="0 1 2"/>'),
        "triangle 0 has index 2, which is out of range",
    ),
    "negative index": (document(f'{MESH}vertices="0 0 0" indices="0 0 -1"/>'), "has index -1, which is out of range"),
    "two of three": (
        document(f'{MESH}vertices="0 0 0" indices="0 0"/>'),
        "indices must be whole numbers in groups of 3",
    ),
    "half index": (document(f'{MESH}vertices="0 0 0" indices="0 0 0.5"/>'), "must be whole numbers: "),
    "vertex": (document(f'{MESH}vertices="0 0 zero" indices="0 0 0"/>'), "could not convert string to float: 'zero'"),
    "two dots": (
        document(f'{MESH}vertices="0 1.5.3 0" indices="0 0 0"/>'),
        "could not convert string to float: '1.5.3'",
    ),
    "infinite vertex": (document(f'{MESH}vertices="0 0 inf" indices="0 0 0"/>'), "must be finite numbers"),
    "no vertices": (document(f'{MESH}indices="0 0 0"/>'), ":6: <object> needs the attribute vertices"),
    "normals": (
        document(f'{MESH}{TRIANGLE}normals="0 0 1"/>'),
        "normal_indices: triangle 0 has index 1, which is out of range",
    ),
    "no file": (document(f'{MESH}filename="a.obj"/>'), ":6: <object> filename: no such file 'a.obj' beside scene.xml"),
    "no mesh": (document(f'{MESH}filename="scene.xml"/>'), "unknown file type '.xml'"),
    "no include": (document('<include filename="b.xml"/>'), ":6: <include> filename: no such file 'b.xml'"),
    "include nothing": (document("<include/>"), ":6: <include> needs the attribute filename"),
    "include folder": (document('<include filename="."/>'), "no such file '.' beside scene.xml"),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_malformed_documents_are_one_clear_line(name, tmp_path):
    text, message = MALFORMED[name]
    if isinstance(text, str) and text.startswith("<RT3>") and "</RT3>" not in text and "truncated" not in name:
        text += "<world_begin/><world_end/></RT3>"
    with pytest.raises(InputError) as error:
        read(tmp_path, text)
    told = str(error.value)
    assert message in told, told
    assert "scene.xml" in told
    assert "\n" not in told
    assert len(told) < 1_000


# --- Fuzz -------------------------------------------------------------------------------------------------------------

FUZZ = settings(
    max_examples=120,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def read_or_refuse(tmp_path, text):
    """What was read, or None where a line with the file's name says why not."""
    try:
        return read(tmp_path, text)
    except InputError as error:
        if "scene.xml" not in str(error) or "\n" in str(error):
            raise AssertionError(str(error)) from error
        return None


@FUZZ
@given(st.data())
def test_any_damage_is_read_or_refused(tmp_path, data):
    """Bytes cut out, doubled and changed in a document that is whole."""
    text = bytearray(document(f'<object type="sphere" radius="1"/>{MESH}{TRIANGLE}/>').encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at, length = data.draw(st.integers(0, len(text) - 1)), data.draw(st.integers(0, 9))
        text[at : at + length] = data.draw(st.one_of(st.binary(max_size=4), st.just(bytes(text[at : at + 2 * length]))))
    read_or_refuse(tmp_path, bytes(text))
