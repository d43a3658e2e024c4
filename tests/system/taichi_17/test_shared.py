"""A kernel's identity is what it simulates: not the mesh, nor the number of anything, nor the size of the picture.

``python tests/system/taichi_17/test_shared.py`` writes the table of docs/speed.md.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import taichi as ti
from support import any_scene, long_except, needs_arrays, needs_patch, start

import taichi_tracer as tt
from taichi_tracer.system import compiling
from taichi_tracer.system.taichi_17 import questions
from taichi_tracer.system.varying import varying

DOCUMENT = Path(__file__).parents[3] / "docs" / "speed.md"
HEAD = "| what is changed, in one process | kernels that are read |"


@pytest.fixture(autouse=True)
def fresh():
    start("f32")
    needs_arrays()
    needs_patch("counters")


def picture(cls, name, tiles=None, samples=2, **options):
    """Makes a picture of a scene, which has a number, in a size."""

    def make(seed, size):
        renderer = cls(any_scene(seed, **options), *size).use(name)
        renderer.use_tiles = tiles
        return renderer.render(samples).image()

    return make


def rays(seed, size):
    """The first hits of some rays, and which of them are blocked."""
    of = any_scene(seed)
    towards = np.random.default_rng(seed).normal(size=(size[0], 3)).astype(np.float32)
    hits = of.intersect(np.zeros_like(towards), towards)
    return np.append(hits.distance, of.occluded(np.zeros_like(towards), towards))


def under_a_sun(name, tiles=None):
    """Makes a picture under a small sun, whose place and brightness depend on the number, and asks for its error."""

    def make(seed, size):
        sky = np.full((32, 64, 3), 0.3)
        sky[6, 9 + seed] = 2000 + 100 * seed
        renderer = tt.A2Renderer(any_scene(seed, environment=sky), *size).use(name)
        renderer.use_tiles = tiles
        assert renderer.render(4).watcher is not None
        renderer.error()
        return renderer.image()

    return make


def map_of_work(seed, size):
    """A map of the shadow rays that are blocked."""
    renderer = tt.MapRenderer(any_scene(seed, environment="studio"), *size, of="mis").use("blocked")
    return renderer.render(2).image()


VIEWS = ("hit", "triangle_id", "distance", "barycentric", "normal", "material_id")
ESTIMATORS = ("uniform", "hemisphere", "brdf", "environment", "mis", "mis_balance", "mis_one_sample")
QUICK = {
    "a view": picture(tt.A1Renderer, "normal"),
    "direct light": picture(tt.A2Renderer, "mis"),
    "direct light under a sun": under_a_sun("mis"),
    "rays": rays,
}
LONG = {
    "paths": picture(tt.A4Renderer, "path"),
    **{f"view {name}": picture(tt.A1Renderer, name) for name in VIEWS},
    **{f"estimator {name}": picture(tt.A2Renderer, name) for name in ESTIMATORS},
    "tiles of a view": picture(tt.A1Renderer, "normal", tiles=True),
    "tiles": picture(tt.A2Renderer, "mis", tiles=True),
    "tiles without light samples": picture(tt.A2Renderer, "brdf", tiles=True),
    "one technique under a sun": under_a_sun("environment"),
    "tiles under a sun": under_a_sun("mis", tiles=True),
    "a map of work": map_of_work,
    "the plain tree": picture(tt.A2Renderer, "mis", intersector="bvh", fast=False),
    "every triangle": picture(tt.A2Renderer, "mis", intersector="brute_force", fast=False),
}
EVERY = QUICK


@pytest.mark.parametrize("make", EVERY.values(), ids=EVERY)
def test_a_second_scene_in_another_size_reads_nothing_and_has_its_own_picture(make):
    make(1, (16, 12))
    began = time.perf_counter()
    second = make(2, (20, 24))
    assert [kernel.name for kernel in compiling.kernels(since=began)] == []
    tt.init("cpu", force=True)
    np.testing.assert_array_equal(make(2, (20, 24)), second)


PROCESS = """
import json, sys
sys.path[:0] = {paths!r}
from test_shared import LONG, QUICK
for name in json.loads(sys.argv[1]):
    {{**QUICK, **LONG}}[name](int(sys.argv[2]), json.loads(sys.argv[3]))
"""


def kept(folder: Path, names: tuple[str, ...], seed: int, size: tuple[int, int]) -> set[str]:
    """The kernels in a folder after another process has made pictures."""
    here = Path(__file__).parent
    program = PROCESS.format(paths=[str(here), str(here.parents[1])])
    words = [json.dumps(names), str(seed), json.dumps(size)]
    environment = {**os.environ, "TI_OFFLINE_CACHE": "1", "TI_OFFLINE_CACHE_FILE_PATH": str(folder)}
    subprocess.run([sys.executable, "-c", program, *words], env=environment, check=True)
    return {path.name for path in folder.rglob("*.tic")}


@ti.data_oriented
class Counter:
    """Counts to a number, from a constant on."""

    def __init__(self, end, first=0, of="counter"):
        self.end, self.first, self.of, self.parts = varying(end), first, of, [end]
        self.note = object()

    @ti.kernel
    def count(self) -> ti.i32:
        total = self.first
        for _ in range(self.end):
            total += 1
        return total

    @ti.kernel
    def describe(self) -> ti.i32:
        return ti.static(len(self.of))


def read(call) -> int:
    """How many kernels a call reads."""
    began = time.perf_counter()
    call()
    return len(compiling.kernels(since=began))


def test_what_a_kernel_does_not_ask_for_may_differ():
    first, second = Counter(3), Counter(5, of="other")
    assert first.count() == 3
    assert read(second.count) == 0
    assert (second.count(), first.count()) == (5, 3)


def test_a_constant_that_differs_makes_another_kernel():
    first, second = Counter(3), Counter(3, first=7)
    assert first.count() == 3
    assert read(second.count) == 1
    assert (second.count(), first.count()) == (10, 3)
    assert Counter(1).describe() == len("counter")
    assert Counter(1, of="four").describe() == 4


def test_a_varying_number_is_what_it_is_at_the_launch():
    counter = Counter(3)
    assert counter.count() == 3
    counter.end = varying(8)
    assert counter.count() == 8


def test_a_method_that_was_replaced_makes_another_kernel():
    class Base:
        @ti.func
        def number(self):
            return 1

    @ti.data_oriented
    class Asking:
        def __init__(self, of):
            self.of = of

        @ti.kernel
        def ask(self) -> ti.i32:
            return self.of.number()

    class Other(Base):
        @ti.func
        def number(self):
            return 2

    assert Asking(Base()).ask() == 1
    assert Asking(Base()).ask() == 1
    assert Asking(Other()).ask() == 2
    Base.number = Other.number
    assert Asking(Base()).ask() == 2


def test_classes_are_as_they_were_after_a_kernel_was_read():
    Counter(2).count()
    assert "__setattr__" not in vars(Counter)
    assert getattr(vars(Counter).get("__getattribute__"), "__name__", "") != "asked"
    assert questions.noting == []


# ── the table of the document ──


# ── what a student changes in a notebook

FACTOR = 0.25
SETTINGS = SimpleNamespace(weight=0.25)
WEIGHTS = np.array([0.25, 0.5])


@ti.func
def helper(n):
    return n * 0 + 0.25


@ti.data_oriented
class Formulas:
    """Functions of a class without an object, as in the handouts."""

    weight = 0.25

    @staticmethod
    @ti.func
    def value(n):
        return n * 0 + 0.25


def shown(expression):
    """A renderer that shows the value of an expression where a ray hits, and 0 elsewhere."""

    class Shown(tt.A1Renderer):
        @ti.func
        def shade_ray(self, ray):
            hit = self.scene_data.ray_intersector.query_ray(ray)
            color = ti.Vector([0.0, 0.0, 0.0])
            if hit.is_hit:
                color += expression(hit.normal)
            return color

    return Shown


@ti.func
def by_name(n):
    return FACTOR


@ti.func
def by_function(n):
    return helper(n).x


@ti.func
def by_namespace(n):
    return SETTINGS.weight


@ti.func
def by_array(n):
    return ti.static(float(WEIGHTS[0]))


@ti.func
def by_class(n):
    return Formulas.weight


@ti.func
def by_static_function(n):
    return Formulas.value(n).x


@ti.func
def doubled(n):
    return n * 0 + 0.5


CHANGES = {
    by_name: lambda patch: patch.setitem(globals(), "FACTOR", 0.5),
    by_function: lambda patch: patch.setitem(globals(), "helper", doubled),
    by_namespace: lambda patch: patch.setattr(SETTINGS, "weight", 0.5),
    by_array: lambda _: WEIGHTS.__setitem__(0, 0.5),
    by_class: lambda patch: patch.setattr(Formulas, "weight", 0.5),
    by_static_function: lambda patch: patch.setattr(Formulas, "value", staticmethod(doubled)),
}


@pytest.mark.parametrize("expression", long_except(CHANGES, by_name), ids=lambda function: function.__name__)
def test_what_a_students_function_finds_around_it_is_part_of_what_a_kernel_was_read_for(expression, monkeypatch):
    renderer, of = shown(expression), any_scene(1)
    assert renderer(of, 8, 8).render().image().max() == 0.25
    began = time.perf_counter()
    assert renderer(of, 8, 8).render().image().max() == 0.25
    assert compiling.kernels(since=began) == []
    CHANGES[expression](monkeypatch)
    assert renderer(of, 8, 8).render().image().max() == 0.5


def test_a_variable_of_the_function_around_is_too():
    def with_weight(weight):
        @ti.func
        def expression(n):
            return weight

        return expression

    expression, of = with_weight(0.25), any_scene(1)
    renderer = shown(expression)
    assert renderer(of, 8, 8).render().image().max() == 0.25
    expression.__wrapped__.__closure__[0].cell_contents = 0.5
    assert renderer(of, 8, 8).render().image().max() == 0.5


def changes() -> dict[str, list[str]]:
    """What is changed → the names of the kernels that are read then."""
    start("f32")
    renderer = tt.A2Renderer(any_scene(1), 16, 12).use("mis").render(2)
    paths = tt.A4Renderer(renderer.scene_data, 16, 12).use("path").render(2)

    def moved():
        renderer.camera.set_camera_parameters(eye=(0, 1, 6))
        renderer.render(1)

    def bounces():
        paths.max_bounces = 2
        paths.render(1)

    def replaced():
        class Own(tt.A2Renderer):
            @ti.func
            def shade_ray(self, ray):
                return ti.Vector([0.5, 0.5, 0.5])

        Own(any_scene(1), 16, 12).render(1)

    sky = np.random.default_rng(0).random((8, 16, 3))
    every = {
        "another mesh": lambda: picture(tt.A2Renderer, "mis")(2, (16, 12)),
        "another size of the picture": lambda: picture(tt.A2Renderer, "mis")(1, (24, 20)),
        "a crop": lambda: tt.A2Renderer(any_scene(1), 16, 12, crop=(2, 9, 1, 8)).use("mis").render(1),
        "another seed": lambda: tt.A2Renderer(any_scene(1), 16, 12, seed=5).use("mis").render(1),
        "the camera": moved,
        "the environment's image": lambda: picture(tt.A2Renderer, "mis", environment=sky)(1, (16, 12)),
        "`max_bounces`": bounces,
        "another estimator": lambda: picture(tt.A2Renderer, "brdf")(1, (16, 12)),
        "the same estimator again": lambda: picture(tt.A2Renderer, "mis")(3, (16, 12)),
        "another sampler": lambda: tt.A2Renderer(any_scene(1), 16, 12, sampler="sobol").use("mis").render(1),
        "no environment": lambda: picture(tt.A2Renderer, "mis", environment=None)(1, (16, 12)),
        "a method of your own": replaced,
    }
    found = {}
    for name, change in every.items():
        began = time.perf_counter()
        change()
        found[name] = [kernel.name for kernel in compiling.kernels(since=began)]
    return found


def table() -> str:
    """The table in Markdown."""
    rows = [f"| {name} | {', '.join(f'`{k}`' for k in kernels) or 'none'} |" for name, kernels in changes().items()]
    return "\n".join([HEAD, "|---|---|", *rows])


def documented() -> str:
    """The table that the document has."""
    text = DOCUMENT.read_text()
    return text[text.index(HEAD) :].split("\n\n")[0]


if __name__ == "__main__":
    DOCUMENT.write_text(DOCUMENT.read_text().replace(documented(), table()))
