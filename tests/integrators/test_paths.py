"""Paths against closed forms and against each other: every way to find light, every length, every roulette."""

import numpy as np
import pytest
from oracles.lamps import room_radiance
from shapes import sphere
from support import start

import taichi_tracer as tt
from taichi_tracer.contracts.statistics import largest_z
from taichi_tracer.geometry import Mesh

WAYS = ("implicit", "explicit", "path")
EMISSION, ALBEDO = np.array([0.5, 1.0, 2.0]), np.array([0.25, 0.5, 0.75])
MANY = 64

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def room():
    """The inside of a closed ball: every surface emits and reflects the same, so that the radiance is a sum."""
    start("f32")
    vertices, faces = sphere(12, 7)
    material = tt.Material(Kd=tuple(ALBEDO), Ke=tuple(EMISSION))
    view = {"eye": (0.1, 0.2, 0.3), "at": (0, 0, -1), "fov": 60.0}
    scene = tt.SceneData(Mesh(vertices, faces[:, ::-1], materials=[material]), view=view)  # fronts inside
    return tt.A4Renderer(scene, 16, 16)


def rendered(renderer, way, spp, **settings):
    """(3,) mean of the picture, and its standard error from the spread of its pixels."""
    defaults = {"max_bounces": 5, "rr_start_bounce": 0, "rr_termination_probability": 0.0, "roulette": "course"}
    for name, value in {**defaults, "bounces": None, **settings}.items():
        setattr(renderer, name, value)
    image = renderer.use(way).render(spp).image().astype(float).reshape(-1, 3)
    assert renderer.non_finite == 0
    return image.mean(axis=0), image.std(axis=0) / np.sqrt(len(image))


@pytest.mark.long
@pytest.mark.parametrize("way", WAYS)
def test_a_closed_room_has_the_radiance_of_its_sum(room, way):
    """For 0, 1, 2, 5 and 64 bounces; without roulette, ``implicit`` has no variance at all. Significance 1 %."""
    limit = largest_z(len(WAYS) * 5 * 3, 0.01)
    for bounces in (0, 1, 2, 5, MANY):
        mean, error = rendered(room, way, 16, max_bounces=bounces)
        expected = room_radiance(EMISSION, ALBEDO, bounces)
        if way == "implicit":
            np.testing.assert_allclose(mean, expected, rtol=2e-5)
            assert error.max() < 1e-6
        assert (np.abs(mean - expected) <= limit * error + 2e-5 * expected).all(), (bounces, mean, expected, error)


@pytest.mark.long
@pytest.mark.parametrize(
    "settings",
    [
        {"rr_termination_probability": 0.3},
        {"rr_termination_probability": 0.4, "rr_start_bounce": 2},
        {"roulette": "throughput"},
        {"roulette": "throughput", "rr_start_bounce": 3},
    ],
    ids=str,
)
def test_roulette_does_not_change_the_mean(room, settings):
    """Significance 1 % for the four of them."""
    for way in WAYS:
        mean, error = rendered(room, way, 64, max_bounces=MANY, **settings)
        expected = room_radiance(EMISSION, ALBEDO, MANY)
        limit = largest_z(4 * len(WAYS) * 3, 0.01)
        assert (np.abs(mean - expected) <= limit * error + 2e-5 * expected).all(), (way, mean, expected, error)


@pytest.mark.long
def test_roulette_costs_variance(room):
    """Without it, every path of ``implicit`` finds the same light here; with it, some end before they have."""
    for settings in ({"rr_termination_probability": 0.3}, {"roulette": "throughput"}):
        assert rendered(room, "implicit", 4, max_bounces=MANY, **settings)[1].min() > 1e-4


@pytest.fixture(scope="module")
def box():
    """The Cornell box, lit by its lamp."""
    start("f32")
    return tt.load_scene_data("cornell_box")


def blocks(image, size=8):
    """(h/size, w/size, 3) means."""
    h, w, _ = image.shape
    return image.astype(float).reshape(h // size, size, w // size, size, 3).mean(axis=(1, 3))


def runs_of(renderer, count, spp):
    """(count, …) block means of independent pictures."""
    found = []
    for seed in range(count):
        renderer.seed = seed
        renderer.begin_anew()
        found.append(blocks(renderer.render(spp).image()))
    return np.array(found)


def compare(one, other, alpha=0.01):
    """Welch's test of the means of two sets of runs in each block; blocks that nothing varies in must be equal."""
    z = (one.mean(0) - other.mean(0)) / np.sqrt(
        one.var(0, ddof=1) / len(one) + other.var(0, ddof=1) / len(other) + 1e-20
    )
    assert np.abs(z).max() < largest_z(z.size, alpha) * 1.25, np.abs(z).max()  # 1.25: t with 22 degrees of freedom


# Samples per pixel of ``WAYS``: the more samples, the closer the means of pictures are to a normal distribution. Where
# lamps are small or lobes are narrow, a few bright samples of many thousands make the picture of one of the ways.
USUAL = (96, 16, 16)
SAMPLES = {"many_lights": (600, 600, 200), "veach_plates": (3000, 3000, 300)}
MESHES = [name for name in tt.scene_names() if not name.startswith("rt3/")]
IN_LONG = ("caustic_sphere", "cornell_box")
MARK = {name: pytest.mark.long if name in IN_LONG else pytest.mark.exhaustive for name in MESHES}
CASES = [pytest.param(name, None, marks=MARK[name]) for name in MESHES]
CASES.append(pytest.param("cornell_box", "studio", marks=pytest.mark.long))


@pytest.mark.exhaustive
@pytest.mark.parametrize(("name", "environment"), CASES)
def test_the_three_ways_have_the_same_mean(name, environment):
    """Every shipped mesh, lit by its own lamps, or else by the studio: five bounces, blocks of 8 × 8 pixels, 1 %.

    Also where light goes over mirrors and through glass: what a ray hits after one of them counts in each way, because
    no sample of the lights finds it. A caustic is as noisy with ``explicit`` as with ``implicit``, but it is there.
    """
    scene = tt.load_scene_data(name, environment=environment)
    if not scene.effects.is_lit:
        scene = tt.load_scene_data(name, environment="studio")
    renderer = tt.A4Renderer(scene, 32, 32, sampler="independent")
    spp = dict(zip(WAYS, SAMPLES.get(name, USUAL), strict=True))
    found = {way: runs_of(renderer.use(way), 12, spp[way]) for way in WAYS}
    compare(found["implicit"], found["explicit"])
    compare(found["path"], found["explicit"])
    compare(found["implicit"], found["path"])


@pytest.mark.long
def test_one_bounce_is_direct_light(box):
    """``path`` with one bounce has the mean of the estimator ``mis``, which samples lamps, too."""
    paths, direct = tt.A4Renderer(box, 32, 32, sampler="independent"), tt.A3Renderer(box, 32, 32, sampler="independent")
    paths.max_bounces = 1
    compare(runs_of(paths.use("path"), 12, 16), runs_of(direct.use("mis"), 12, 16))


@pytest.mark.long
def test_bounces_add_up_to_the_picture(box):
    """The same samples: what 0, 1, 2 … bounces contribute sums up to the picture, but for rounding (A4-5)."""
    renderer = tt.A4Renderer(box, 16, 16)
    renderer.path_settings.set(max_bounces=4, rr_termination_probability=0.25, rr_start_bounce=1)
    whole = renderer.render(8).image()
    renderer.render(3)  # other samples, which no picture may contain
    parts = renderer.pictures_by_bounce(8)
    assert list(parts) == [0, 1, 2, 3, 4]
    assert all(part.any() for part in parts.values())
    tolerance = 2e-6 * whole.max()
    np.testing.assert_allclose(sum(parts.values()), whole, rtol=0, atol=tolerance)
    assert all(part.srgb for part in parts.values())
    ranges = renderer.pictures_by_bounce(8, [0, (1, 3), (4, None)])
    assert list(ranges) == [0, (1, 3), (4, None)]
    np.testing.assert_array_equal(ranges[0], parts[0])
    np.testing.assert_array_equal(ranges[4, None], parts[4])
    np.testing.assert_allclose(ranges[1, 3], parts[1] + parts[2] + parts[3], rtol=0, atol=tolerance)
    np.testing.assert_array_equal(renderer.pictures_by_bounce(8, [(0, None)])[0, None], whole)
    assert renderer.bounces is None
    np.testing.assert_array_equal(renderer.render(8).image(), whole)


def test_pictures_by_bounce_refuse_what_cannot_be_added_up(box):
    renderer = tt.A4Renderer(box, 8, 8)
    for bounces, told in (
        ([0, (0, 1)], "both count the light after 0"),
        ([6], "at most 5 bounces"),
        (["1"], "must be"),
    ):
        with pytest.raises(tt.InputError, match=told):
            renderer.pictures_by_bounce(1, bounces)
    with pytest.raises(tt.InputError, match="give adaptive=False"):
        tt.A4Renderer(box, 8, 8, adaptive=True).pictures_by_bounce(1)
    assert renderer.samples == 0


def test_settings_start_the_picture_over_without_compiling(box):
    renderer = tt.A4Renderer(box, 8, 8).render(2)
    assert renderer.is_current()
    for name, value in (
        ("max_bounces", 2),
        ("rr_start_bounce", 1),
        ("rr_termination_probability", 0.5),
        ("roulette", "throughput"),
        ("bounces", (1, 2)),
    ):
        setattr(renderer, name, value)
        assert getattr(renderer, name) == value
        assert not renderer.is_current(), name
        renderer.render(1)
        assert renderer.samples == 1
        setattr(renderer, name, value)  # the same again is no change
        assert renderer.is_current()


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("max_bounces", 65, "max_bounces must be a whole number from 0 to 64, not 65"),
        ("max_bounces", 2.5, "max_bounces must be a whole number"),
        ("rr_start_bounce", -1, "rr_start_bounce must be a whole number from 0 to 64"),
        ("rr_termination_probability", 1.0, "must be at least 0 and less than 1, not 1.0"),
        ("rr_termination_probability", float("nan"), "must be at least 0 and less than 1"),
        ("roulette", "russian", "unknown roulette 'russian': use one of course, throughput"),
        ("bounces", (3, 1), "bounces must be"),
        ("bounces", 3, "bounces must be"),
    ],
)
def test_wrong_settings_are_refused_and_change_nothing(box, name, value, message):
    renderer = tt.A4Renderer(box, 8, 8)
    before = renderer.path_settings.facts()
    with pytest.raises(tt.InputError, match=message):
        setattr(renderer, name, value)
    assert renderer.path_settings.facts() == before


@pytest.mark.parametrize(
    ("in_precision", "ns"),
    [pytest.param("f64", 1e21, marks=pytest.mark.exhaustive), pytest.param("f32", 1e30, marks=pytest.mark.exhaustive)],
)
def test_a_mirror_shows_the_lamp_in_every_way(in_precision, ns):
    """Only the mirror's own direction finds light, also for ``explicit``. The course's mirror has Ns = 1e21."""
    start(in_precision)
    corners = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], float)
    vertices = np.concatenate([corners, corners + [0, 2, 0]])
    faces = np.array([[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]])
    materials = [tt.Material("mirror", Kd=(0.5, 0.5, 0.5), Ns=ns), tt.Material("lamp", Kd=(0, 0, 0), Ke=(2, 4, 8))]
    view = {"eye": (0, 1, 0.01), "at": (0, 0, 0), "up": (0, 0, 1), "fov": 1.0}
    mesh = Mesh(vertices, faces, face_materials=np.array([0, 0, 1, 1], np.int32), materials=materials)
    renderer = tt.A4Renderer(tt.SceneData(mesh, view=view), 4, 4)
    for way in WAYS:
        np.testing.assert_allclose(renderer.use(way).render(2).image(), np.tile([1, 2, 4], (4, 4, 1)), rtol=1e-3)
