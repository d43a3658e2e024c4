"""What was asked comes back from bytes; and each answer that is another one is noticed."""

import contextlib
import sys
import types

import numpy as np
import pytest
import taichi as ti
from support import any_scene, long_except, needs_arrays, needs_trees, start
from taichi.lang.field import Field
from taichi.lang.matrix import Matrix
from taichi.lang.struct import StructType

import taichi_tracer as tt
from taichi_tracer.formulas import hashes
from taichi_tracer.system.taichi_17 import kept, records
from taichi_tracer.system.taichi_17.questions import NUMBERS, Missing, OtherError, compare
from taichi_tracer.system.varying import KINDS


@pytest.fixture
def noted(monkeypatch):
    """Function of a kernel → (what it was called with, the record of its reading), of what a test renders."""
    start("f32", fast_math=False)  # anew: nothing is known
    needs_arrays()
    found, called = {}, []

    def find(kernel, objects, features):
        called[:] = [objects]

    @contextlib.contextmanager
    def reading(kernel, features):
        def keep(notes, made, launch):
            record = records.written(notes, launch=launch and launch.bare(), parameters=[*kept.parameters])
            found[kernel.func.__qualname__] = called[0], record

        kept.parameters.clear()
        yield keep

    monkeypatch.setattr(kept, "find", find)
    monkeypatch.setattr(kept, "reading", reading)
    return found


def tiles(seed):
    """Direct light in tiles."""
    renderer = tt.A2Renderer(any_scene(seed), 16, 12).use("mis")
    renderer.use_tiles = True
    return renderer


MADE = {
    "ProgressiveRenderer._take_samples": lambda seed: tt.A4Renderer(any_scene(seed), 16, 12).use("path"),
    "PrimaryHits._trace_rays": lambda seed: tt.A1Renderer(any_scene(seed), 16, 12).use("normal"),
    "Tiles._take": tiles,
}


@pytest.mark.parametrize("name", long_except(MADE, "PrimaryHits._trace_rays"))
def test_objects_of_another_scene_give_the_same_answers(noted, name):
    if "Tiles" in name:
        needs_trees()
    MADE[name](1).render(2)
    first, record = noted.pop(name)
    notes, facts = records.read(record)
    assert facts["launch"].of(notes.objects_of(first)) is not None
    assert len(facts["parameters"]) >= len(facts["launch"].slots)
    tt.init("cpu", force=True)
    MADE[name](2).render(2)
    second, other = noted.pop(name)
    assert notes.objects_of(second) is not None
    assert other == record


def altered(value):
    """Values that are not the same as a value, for the reading of a kernel."""
    if type(value) in KINDS:
        yield 1
    elif isinstance(value, bool):
        yield not value
    elif isinstance(value, NUMBERS) and value is not None:
        yield value + value if value else type(value)(1) if not isinstance(value, (str, bytes)) else "other"
    elif isinstance(value, types.MethodType):
        yield types.MethodType(altered, value.__self__)
        yield value.__func__
    elif isinstance(value, (tuple, list)):
        yield type(value)([*value, 0])
        for k, one in enumerate(value):
            yield from (type(value)([*value[:k], other, *value[k + 1 :]]) for other in altered(one))
    elif isinstance(value, type):
        yield type("Other", (object,), {})
    elif isinstance(value, types.FunctionType):
        yield hashes.plus if value is not hashes.plus else hashes.times
    elif isinstance(value, Field):
        yield ti.field(ti.u16, shape=7)
    elif isinstance(value, Matrix):
        yield value + 1
    elif isinstance(value, StructType):
        yield ti.types.struct(other=ti.i32)
    elif value is Missing:
        yield 3
    else:
        yield object()
    if value is not None:
        yield None


def passes(value, wanted, found):
    """Whether a value counts as the answer for which a kernel was read."""
    try:
        compare(value, wanted, dict(found))
    except OtherError:
        return False
    return True


@pytest.mark.parametrize("name", long_except(MADE, "PrimaryHits._trace_rays"))
def test_every_answer_that_is_another_one_is_noticed(noted, name):
    if "Tiles" in name:
        needs_trees()
    MADE[name](1).render(2)
    called, record = noted.pop(name)
    notes, _ = records.read(record)
    objects = dict(enumerate(notes.objects_of(called)))
    answers = [(question, question.answer(), wanted) for question, wanted in notes.outside.values()]
    answers += [(key, getattr(objects[key[0]], key[1], Missing), wanted) for key, wanted in notes.asked.items()]
    assert len(answers) > 40
    for asked, value, wanted in answers:
        assert passes(value, wanted, objects), asked
        others = [*altered(value)]
        assert others
        assert [other for other in others if passes(other, wanted, objects)] == [], asked


def test_a_kernel_that_asks_for_something_of_ones_own_has_no_record(noted):
    class Own(tt.A1Renderer):
        """A renderer of a student's."""

        @ti.func
        def shade_ray(self, ray):
            return ti.Vector([0.5, 0.5, 0.5])

    Own(any_scene(1), 16, 12).render(1)
    assert [record for name, (_, record) in noted.items() if "take" in name] == [None]


def test_a_method_that_was_assigned_has_no_record(noted, monkeypatch):
    @ti.func
    def half():
        return 0.5 / (4 * np.pi)

    monkeypatch.setattr(tt.UniformSampler, "evaluate_probability", staticmethod(half))
    tt.A2Renderer(any_scene(1), 16, 12).use("uniform").render(2)
    assert noted["ProgressiveRenderer._take_samples"][1] is None


def test_constants_of_functions_that_python_runs_are_asked_for(noted, monkeypatch):
    tt.A2Renderer(any_scene(1), 16, 12).use("uniform").render(1)
    called, record = noted.pop("ProgressiveRenderer._take_samples")
    notes, _ = records.read(record)
    assert notes.objects_of(called) is not None
    monkeypatch.setattr(hashes, "HALVES", hashes.HALVES[1:])
    assert notes.objects_of(called) is None


def test_what_is_not_imported_is_told(noted, monkeypatch):
    MADE["PrimaryHits._trace_rays"](1).render(1)
    _, record = noted.pop("PrimaryHits._trace_rays")
    notes, _ = records.read(record)
    modules = {question.of["__name__"] for question, _ in notes.outside.values() if question.kind == "name"}
    monkeypatch.delitem(sys.modules, sorted(modules)[0])
    with pytest.raises(records.NoWordError):
        records.read(record)
