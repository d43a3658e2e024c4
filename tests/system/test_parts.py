"""Parts: the registry; which methods were replaced, however it was done; and how a method is called."""

import textwrap

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from probe import ask, put

import taichi_tracer as tt
from taichi_tracer.integrators.base import Integrator, View
from taichi_tracer.samplers.sobol import SobolSampler
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.parts import (
    PARTS,
    adapt_signature,
    assigned,
    call_with_known_args,
    load_parts,
    overridable,
    replaced,
    why_replaced,
)


@overridable("first", "second")
class Plain:
    """Comes with the package, as it were."""

    def first(self):
        return 1

    def second(self):
        return 2

    def third(self):
        return 3


@overridable("third")
class Shipped(Plain):
    """Also comes with the package: its own ``first`` is no replacement."""

    def first(self):
        return 10


class Mine(Shipped):
    """A user's."""

    def second(self):
        return 20


# ── what was replaced ──


def test_a_subclass_replaces_what_it_defines():
    assert replaced(Plain) == replaced(Plain()) == ()
    assert replaced(Shipped) == replaced(Shipped()) == ()
    assert replaced(Mine) == replaced(Mine()) == ("second",)
    assert why_replaced(Mine) == why_replaced(Mine()) == "Mine replaces second"
    assert why_replaced(Plain) == ""


@pytest.mark.parametrize(
    ("owner", "name"), [(Plain, "first"), (Plain, "second"), (Shipped, "first"), (Shipped, "third")]
)
def test_assigning_to_a_class_replaces_for_it_and_for_those_that_inherit_it(monkeypatch, owner, name):
    monkeypatch.setattr(owner, name, lambda self: -1)
    assert replaced(owner) == (name,)
    inherits = not (owner is Plain and name == "first")  # Shipped has its own
    assert (name in replaced(Shipped)) == inherits
    assert f"{owner.__name__}.{name}" in assigned()
    monkeypatch.undo()
    assert replaced(owner) == ()
    assert f"{owner.__name__}.{name}" not in assigned()


def test_assigning_to_an_object_replaces_for_it_alone():
    one, other = Shipped(), Shipped()
    one.second = lambda: -1
    assert replaced(one) == ("second",)
    assert replaced(other) == ()
    assert why_replaced(one) == "Shipped replaces second"


# ── how a method is called ──


def test_a_function_without_self_is_called_without_it(monkeypatch):
    monkeypatch.setattr(Plain, "first", lambda a, xi=0: (a, xi), raising=True)
    assert call_with_known_args(Plain().first, 7, xi=3) == (7, 3)
    monkeypatch.setattr(Plain, "first", lambda: "nothing")
    assert call_with_known_args(Plain().first, xi=3) == "nothing"


def test_a_method_with_fewer_parameters_gets_the_first_arguments():
    @overridable("sample")
    class Shipped:
        def sample(self, scene, surface, xi):
            return scene, surface, xi

    class Fewer(Shipped):
        def sample(self, scene, surface):
            return scene, surface

    class Renamed(Shipped):
        def sample(self, scene, surface, pair):
            return pair

    class Untouched(Shipped):
        pass

    own = vars(Fewer)["sample"]
    for cls in (Fewer, Renamed, Untouched, Fewer):
        adapt_signature(cls)
    assert Fewer().sample(1, 2, 3) == (1, 2)
    assert Renamed().sample(1, 2, 3) == 3
    assert Untouched().sample(1, 2, 3) == (1, 2, 3)
    assert (Fewer.sample, replaced(Fewer())) == (own, ("sample",))
    assert "sample" not in vars(Untouched)
    Fewer.sample = lambda self, scene, surface: scene  # in a notebook, later
    adapt_signature(Fewer)
    assert Fewer().sample(1, 2, 3) == 1


# ── Python that kernels call while they are compiled ──


@ti.func
def _twice(x):
    return 2 * x


@compile_time
def _chosen(x, how):
    """Chooses in Python, and calls a Taichi function."""
    return _twice(x) if how == "twice" else x


@ti.func
def _probe(rows: ti.template(), out: ti.template(), i):
    put(
        out,
        i,
        0,
        tm.vec3(
            _chosen(rows[i, 0], "twice"), _chosen(rows[i, 0], "once"), call_with_known_args(_twice, rows[i, 0], xi=3)
        ),
    )


def test_a_kernel_calls_a_python_function_while_it_is_compiled(precision):
    np.testing.assert_array_equal(ask(_probe, [[3], [5]], 3), [[6, 3, 6], [10, 5, 10]])
    assert _chosen(4, "once") == 4  # from Python as well


# ── the registry ──


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
