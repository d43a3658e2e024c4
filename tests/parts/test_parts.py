"""The seven parts of this folder: loaded by --parts, each shows a picture that is known in closed form.

They are examples for students: at most 60 lines, and nothing but public names.
"""

import ast
from pathlib import Path

import numpy as np
import pytest
from shapes import SQUARE, sphere
from support import long_except

import taichi_tracer as tt
from taichi_tracer.apps.cli import main
from taichi_tracer.contracts import brdfs, cameras, integrators, intersectors, lights, samplers, views
from taichi_tracer.system import runtime
from taichi_tracer.system.registry import PARTS, load_parts

HERE = Path(__file__).parent
FILES = {
    "ggx": "ggx_brdf.py",
    "point": "point_light.py",
    "two_bounce": "two_bounce.py",
    "stratified": "stratified_sampler.py",
    "fisheye": "fisheye_camera.py",
    "heat_map": "heat_map_view.py",
    "grid": "grid_intersector.py",
}
MOST_LINES = 60


@pytest.fixture(autouse=True)
def _taichi_and_registry(tmp_path, monkeypatch):
    """Taichi as the command line starts it on the CPU; what a test registers is forgotten at its end."""
    if runtime.current() != runtime.Settings("cpu", "f32", False):
        runtime.init("cpu", force=True)
    monkeypatch.chdir(tmp_path)
    yield
    for file in FILES.values():
        for part in PARTS.registered_by(HERE / file):
            PARTS.remove(part)


def part(name):
    """The part of this name, loaded from its file."""
    load_parts(str(HERE / FILES[name]))
    (loaded,) = PARTS.registered_by(HERE / FILES[name])
    return loaded


def rendered(name, scene, *words):
    """(h, w, 3) float64, top row first: what the command line renders with the file of a part, 24 × 24 pixels."""
    words = [scene, "--parts", str(HERE / FILES[name]), "--size", "24", *map(str, words), "-o", "picture.npy"]
    assert main(["render", *words]) == 0
    return np.load("picture.npy").astype(np.float64)


def write_obj(name, vertices, faces, material="Kd 1 1 1", normals=None):
    """An OBJ file in the folder of the test, of one material; returns its name."""
    lines = [f"mtllib {name}.mtl", "usemtl only", *(f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices)]
    lines += [] if normals is None else [f"vn {x:.9g} {y:.9g} {z:.9g}" for x, y, z in normals]
    corner = "{0}" if normals is None else "{0}//{0}"
    lines += ["f " + " ".join(corner.format(i + 1) for i in face) for face in faces]
    Path(f"{name}.obj").write_text("\n".join(lines) + "\n")
    Path(f"{name}.mtl").write_text(f"newmtl only\n{material}\n")
    return f"{name}.obj"


def test_parts_are_short_and_use_public_names():
    for name in FILES.values():
        text = (HERE / name).read_text(encoding="utf-8")
        assert len(text.splitlines()) <= MOST_LINES, name
        tree = ast.parse(text)
        imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
        assert imported <= {"taichi", "taichi.math", "taichi_tracer", "numpy"}, name
        assert not any(isinstance(node, ast.ImportFrom) for node in ast.walk(tree)), name
        used = {
            node.attr
            for node in ast.walk(tree)
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "tt"
        }
        assert used <= set(tt.__all__), name
        for node in ast.walk(tree):
            if (
                isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
                and getattr(node, "name", "") != "__init__"
            ):
                assert ast.get_docstring(node), (name, node)


# ── a BRDF ──


@pytest.mark.long
def test_ggx_keeps_the_contract():
    brdfs.check_brdf(part("ggx"))


@pytest.mark.long
def test_ggx_reflects_what_its_formula_says():
    """A wall seen at a right angle under light of 1 from everywhere: ∫ f cos θ dω, by quadrature in float64."""
    material = "Kd 1 1 1\nKs 0.9 0.6 0.3\nroughness 0.6"
    camera = ("--eye", 0, 0, 1000, "--at", 0, 0, 0, "--fov", 0.05)
    image = rendered(
        "ggx", write_obj("wall", *SQUARE, material), *camera, "--view", "brdf", "--environment", "white", "--spp", 256
    )
    theta = (np.arange(20_000) + 0.5) / 20_000 * np.pi / 2
    cos_i, cos_h = np.cos(theta), np.cos(theta / 2)  # w_o = n, so that h lies half way between them
    alpha = 0.6**2
    density = alpha**2 / (np.pi * ((alpha**2 - 1) * cos_h**2 + 1) ** 2)
    masking = 2 * cos_i / (cos_i + np.sqrt(alpha**2 + (1 - alpha**2) * cos_i**2))  # of w_i; that of w_o is 1
    for k, f0 in enumerate((0.9, 0.6, 0.3)):
        fresnel = f0 + (1 - f0) * (1 - cos_h) ** 5
        f_cos = fresnel * density * masking / 4
        albedo = (f_cos * 2 * np.pi * np.sin(theta)).mean() * np.pi / 2
        np.testing.assert_allclose(image[..., k].mean(), albedo, rtol=2e-3)


# ── a light ──


def test_point_light_keeps_the_contract():
    lights.check_light(part("point"))


@pytest.mark.long
def test_point_light_has_its_closed_form():
    """ρ/π I cos θ / r² on a wall; another wall, behind the light, casts no shadow on it."""
    walls = np.concatenate([SQUARE[0] * 3, SQUARE[0] * 9 + [0, 0, 9]])
    faces = np.concatenate([SQUARE[1], SQUARE[1] + 4])
    scene = write_obj("walls", walls, faces, "Kd 0.8 0.5 0.2")
    camera = ("--eye", 0, 0, 5, "--at", 0, 0, 0, "--up", 0, 1, 0, "--fov", 40)
    shows = ("--lights", "bulb", "--environment", "none", "--view", "uniform", "--spp", 64)
    image = rendered("point", scene, *camera, *shows)
    light = np.array([0.3, 1.5, 0.4])
    # The course's frame is left-handed: a camera that looks along −z has +x to its left. 8 × 8 points of each pixel.
    step = 5 * np.tan(np.radians(20)) * (2 * (np.arange(24 * 8) + 0.5) / (24 * 8) - 1)
    x, y = np.meshgrid(-step, -step)
    r2 = (light[0] - x) ** 2 + (light[1] - y) ** 2 + light[2] ** 2
    irradiance = (light[2] / r2**1.5).reshape(24, 8, 24, 8).mean(axis=(1, 3))  # cos θ / r², I is that of each colour
    expected = np.array([0.8, 0.5, 0.2]) / np.pi * np.array([2.0, 1.5, 1.0]) * irradiance[..., None]
    np.testing.assert_allclose(image, expected, rtol=0.02)
    np.testing.assert_allclose(image.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), rtol=1e-3)


# ── an integrator ──


@pytest.mark.exhaustive
def test_two_bounces_keep_the_contract():
    integrators.check_estimator(part("two_bounce"))
    integrators.check_samples_are_finite(part("two_bounce"))


@pytest.mark.exhaustive
@pytest.mark.parametrize("rho", [0.9, pytest.param(0.4, marks=pytest.mark.long)])
def test_two_bounces_fill_a_bowl(rho):
    """The lower half of a sphere under light of 1: each point of it sees as much of the bowl as of the sky.

    From any point of a sphere the share of a part is that of its area, whatever the shape. So the direct light is ρ/2,
    and what comes by way of another point is ρ/2 of that: L = ρ/2 (1 + ρ/2).
    """
    vertices, faces = sphere(96, 49)
    faces = faces[vertices[faces].mean(axis=1)[:, 1] < 0]
    camera = ("--eye", 0, 3, 0, "--at", 0, 0, 0, "--up", 0, 0, 1, "--fov", 20)
    shows = ("--view", "two_bounce", "--environment", "white", "--spp", 256)
    image = rendered("two_bounce", write_obj("bowl", vertices, faces, f"Kd {rho} {rho} {rho}"), *camera, *shows)
    expected = rho / 2 * (1 + rho / 2)
    np.testing.assert_allclose(image.mean(), expected, rtol=3e-3)
    np.testing.assert_allclose(image, expected, rtol=0.15)


# ── a sampler ──


@pytest.mark.long
def test_strata_keep_the_contract():
    samplers.check_sampler(part("stratified"))


def test_every_stratum_has_a_sample():
    """Of samples 0 … 15 and 16 … 31 of some pixels, one in each of 4 × 4 squares, in every dimension."""
    sampler = samplers.bound(part("stratified"))
    for x, y in ((0, 0), (5, 9), (100, 3)):
        found = samplers.numbers(sampler, samplers.keys_of_samples(x, y, 32)).astype(np.float64)
        for block in (found[:16], found[16:]):
            squares = np.floor(block * 4) @ [4, 1]
            assert (np.sort(squares, axis=0) == np.arange(16)[:, None]).all()


@pytest.mark.long
def test_strata_lower_the_error():
    """16 samples of a smooth integrand, the cosine under even light: a quarter of the spread of independent ones."""
    scene = write_obj("wall", *SQUARE, "Kd 0.5 0.5 0.5")
    camera = ("--eye", 0, 0, 1000, "--at", 0, 0, 0, "--fov", 0.05)
    shows = ("--view", "hemisphere", "--environment", "white", "--spp", 16)
    spread = {}
    for sampler in ("stratified", "independent"):
        image = rendered("stratified", scene, *camera, *shows, "--sampler", sampler)
        np.testing.assert_allclose(image.mean(), 0.5, rtol=0.02)
        spread[sampler] = image[..., 0].std()
    # 2 cos θ is uniform on [0, 2): its variance within a quarter is 1/16 of all.
    np.testing.assert_allclose(spread["stratified"] / spread["independent"], 1 / 4, rtol=0.15)


# ── a camera ──


def test_fisheye_keeps_the_contract():
    cameras.check_camera(part("fisheye"))


@pytest.mark.long
@pytest.mark.parametrize("fov", [60, 180])
def test_fisheye_shows_angles(fov):
    """Inside a sphere, normals tell where rays go: the angle with the gaze grows with the distance from the middle."""
    vertices, faces = sphere(96, 49)
    scene = write_obj("ball", vertices, faces, normals=vertices)
    camera = ("--camera", "fisheye", "--fov", fov, "--eye", 0, 0, 0, "--at", 0, 0, -1, "--up", 0, 1, 0)
    directions = 1 - 2 * rendered("fisheye", scene, *camera, "--view", "normal")  # normals face the eye
    step = (np.arange(24) + 0.5) / 12 - 1
    across, up = np.meshgrid(step, -step)
    angle = np.hypot(across, up) * np.radians(fov) / 2
    np.testing.assert_allclose(np.arccos(np.clip(-directions[..., 2], -1, 1)), angle, atol=6e-3)
    sideways = np.hypot(directions[..., 0], directions[..., 1])
    np.testing.assert_allclose(directions[..., 1] / sideways, up / np.hypot(across, up), atol=1e-2)


# ── a view ──


@pytest.mark.exhaustive
def test_heat_map_keeps_the_contract():
    views.check_view(part("heat_map"))


@pytest.mark.long
def test_heat_map_shows_distances():
    """Red, then green, then blue, each over a third of 5 units; against the view ``distance``, which is white at 10."""
    distance = 10 * rendered("heat_map", "cornell_box", "--view", "distance")
    expected = np.clip(3 * distance / 5 - [0, 1, 2], 0, 1)
    np.testing.assert_allclose(rendered("heat_map", "cornell_box", "--view", "heat_map"), expected, atol=1e-5)
    assert len(np.unique(expected[..., 1])) > 10


# ── an intersector ──


SEEN = [("cornell_box", "normal"), ("specular_spheres", "triangle_id")]


@pytest.mark.long
@pytest.mark.parametrize(("scene", "view"), long_except(SEEN, ("specular_spheres", "triangle_id")))
def test_grid_has_the_bits_of_the_hierarchy(scene, view):
    by_grid, by_bvh = (rendered("grid", scene, "--view", view, "--intersector", name) for name in ("grid", "bvh"))
    np.testing.assert_array_equal(by_grid, by_bvh)
    assert by_grid.any()


@pytest.mark.long
def test_grid_answers_as_brute_force():
    """Rays of every kind, with shadow rays and intervals."""
    intersectors.truth.cache_clear()
    intersectors.check_equals_brute_force(part("grid"), True, intersectors.several_shapes)


@pytest.mark.exhaustive
def test_grid_keeps_the_whole_contract():
    intersectors.truth.cache_clear()
    intersectors.check_intersector(part("grid"))
