"""One registry for all parts: by name, class or object; whose part it is; and files that register parts."""

import textwrap

import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.integrators.base import Integrator, View
from taichi_tracer.samplers.sobol import SobolSampler
from taichi_tracer.system.parts.registry import PARTS, load_parts


@pytest.fixture
def parts():
    """A registry with the package's parts and nothing else; the one that everybody uses stays as it is."""
    known = PARTS.everything()
    yield PARTS
    for part in PARTS.everything():
        if not any(part is one for one in known):
            PARTS.remove(part)


@ti.func
def white(hit):
    """White."""
    return tm.vec3(1)


# ── what there is ──


# ── a slot takes a name, a class or an object ──


def test_a_slot_takes_a_name_a_class_or_an_object():
    assert PARTS.find("camera", "perspective") is tt.Camera
    assert PARTS.find("camera", tt.Camera) is tt.Camera
    assert PARTS.find("sampler", "sobol") is PARTS.find("sampler", "sobol")
    made = PARTS.find("sampler", SobolSampler)  # of these kinds objects are held: a class is called
    assert type(made) is SobolSampler
    assert PARTS.find("sampler", made) is made
    assert PARTS.find("integrator", "normals") is PARTS.find("integrator", "normal")  # another name for it


@pytest.mark.parametrize(
    ("kind", "chosen", "message"),
    [
        ("sampler", "sobl", "unknown sampler 'sobl': did you mean 'sobol'? known are independent"),
        ("BRDF", 7, "BRDF: 7 is neither a name nor a part of this kind"),
        ("BRDF", tt.Camera, "is neither a name nor a part of this kind"),
        ("camera", None, "camera: None is neither a name nor a part of this kind"),
    ],
)
def test_what_is_no_part_of_the_kind_is_refused(kind, chosen, message):
    with pytest.raises(tt.InputError) as error:
        PARTS.find(kind, chosen)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


# ── parts of one's own ──


def test_a_part_is_known_after_it_was_registered_and_comes_after_the_packages_own(parts):
    view = View("white", "White", white, aliases=("bright",))
    assert tt.register(view) is view
    assert parts.find("integrator", "white") is parts.find("integrator", "bright") is view
    assert parts.names("integrator")[-1] == "white"
    assert not parts.comes_with_package(view)
    assert parts.comes_with_package(parts.find("integrator", "normal"))
    assert view in parts.registered_by(__file__)
    parts.remove(view)
    assert "white" not in parts.names("integrator")


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (object(), "register: object derives from none of the parts that can be registered"),
        (type("Nameless", (Integrator,), {}), "register: Nameless needs a name: name = 'nameless' in the class"),
        (type("Sobol", (SobolSampler,), {"name": "sobol"}), "there is another sampler called 'sobol', in the package"),
    ],
)
def test_a_part_that_cannot_be_registered_is_refused_with_the_remedy(parts, part, message):
    before = parts.everything()
    with pytest.raises(tt.InputError) as error:
        tt.register(part)
    assert message in str(error.value)
    assert parts.everything() == before


def test_two_files_may_not_give_one_name(parts, tmp_path):
    files = [tmp_path / "a.py", tmp_path / "b.py"]
    parts.add(View("white", "White", white), str(files[0]))
    with pytest.raises(tt.InputError, match=r"called 'white', registered by .*a\.py: give yours another name"):
        parts.add(type("Other", (View,), {"name": "white"})(), str(files[1]))


# ── files of parts ──


@pytest.fixture
def file(tmp_path):
    """Writes a file of parts, and returns its path."""

    def write(text, name="my_parts.py"):
        path = tmp_path / name
        path.write_text(textwrap.dedent(text))
        return str(path)

    return write


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\n", ": the file registers nothing: put @tt.register before each class"),
        ("x = 1\ny = 1 / 0\n", ":2: ZeroDivisionError: division by zero"),
        ("x = 1\ndef f(:\n", ":2: SyntaxError: "),
        ("import taichi_tracer as tt\n\ntt.register(tt.View())\n", ":3: register: View needs a name"),
        ("import no_such_module_at_all\n", ":1: ModuleNotFoundError: No module named 'no_such_module_at_all'"),
        ("raise SystemExit(3)\n", ":1: SystemExit: 3"),
    ],
)
def test_what_is_wrong_with_a_file_is_told_with_its_line(parts, file, text, message):
    path = file(text)
    with pytest.raises(tt.InputError) as error:
        load_parts(path)
    assert f"{path}{message}" in str(error.value)
