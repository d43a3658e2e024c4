"""What the student writes is what runs: each method of the handouts, replaced by a wrong one, has the wrong picture.

A method is replaced by a class in a slot, by an object in a slot, or by an assignment to the package's class.
"""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt

SIZE = 16
VIEW = {"eye": (0.0, 2.0, 2.0), "at": (0.0, 0.0, 0.0), "up": (0.0, 1.0, 0.0), "fov": 40.0}
FLOOR = [[-5, 0, -5], [-5, 0, 5], [5, 0, 5], [5, 0, -5]]
LAMP = [[-1, 3, -1], [1, 3, -1], [1, 3, 1], [-1, 3, 1]]  # 2 × 2, facing down
SQUARE = [[0, 1, 2], [0, 2, 3]]
SKY = np.random.default_rng(3).uniform(0.2, 2, (8, 16, 3))


@ti.func
def one_ray(self, pixel_x, pixel_y, jitter=False):
    return tt.Ray(origin=tm.vec3(0.3, 2, 0.3), direction=tm.vec3(0, -1, 0))


@ti.func
def always_the_center(self, pixel_x: ti.i32, pixel_y: ti.i32):
    return tm.vec2(0.05, 0.1)


@ti.func
def straight_ahead(self, ndc_coords):
    return tm.vec4(0, 0, 1, 0)


def matrix_from_above(self):
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = (1, 0, 0), (0, 0, 1), (0, -1, 0)
    matrix[:3, 3] = 0, 4, 0
    return matrix


@ti.func
def matrix_from_above_in_kernels(self):
    return tm.mat4([1, 0, 0, 0], [0, 0, -1, 4], [0, 1, 0, 0], [0, 0, 0, 1])


@ti.func
def plane_of_id(self, ray, triangle_id):
    hit = tt.HitData()
    if ray.direction.y < -self.EPSILON:
        hit.is_hit = True
        hit.triangle_id = triangle_id
        hit.distance = 2.0 - 0.5 * triangle_id
        hit.barycentric_coords = tm.vec2(0.25, 0.25)
        hit.normal = tm.vec3(0, 0.6, 0.8)
        hit.material_id = self.geometry.triangle_material_ids[triangle_id]
    return hit


@ti.func
def always_misses(self, ray):
    return tt.HitData()


@ti.func
def green_sky(self, ray):
    return tm.vec3(0, 2, 0)


@ti.func
def straight_up():
    return tm.vec3(0, 1, 0)


@ti.func
def hemisphere_density():
    return 1 / (2 * tm.pi)


@ti.func
def along_the_normal(material, w_o, normal):
    return normal


@ti.func
def twice_the_density(material, w_o, w_i, normal):
    return 2 * ti.max(0.0, tm.dot(normal, w_i)) / tm.pi


@ti.func
def without_pi(material, w_o, w_i, normal):
    return material.Kd


@ti.func
def half_the_factor(material, w_o, w_i, normal):
    return material.Kd / 2


@ti.func
def area_of_one(v0, v1, v2):
    return 1.0


def empty_cdf(self):
    self.cdf.fill(0)


@ti.func
def the_first_one():
    return 0


@ti.func
def density_of_one(self):
    return 1.0


@ti.func
def middle_of_the_first(self, hit_point):
    triangle_id = self.emissive_triangle_ids[0]
    v0, v1, v2 = self.geometry.triangle(triangle_id)
    return ((v0 + v1 + v2) / 3 - hit_point).normalized(), triangle_id


@ti.func
def direction_as_color(self, ray):
    return abs(ray.direction)


@ti.func
def an_eighth(self, hit_data):
    return tm.vec3(0.125)


def is_even(wrong, right):
    """One colour in all pixels."""
    return np.ptp(wrong, (0, 1)).max() < 1e-6 and wrong.max() > 0


def is_black(wrong, right):
    return wrong.max() == 0


def is_green(wrong, right):
    return wrong[..., [0, 2]].max() == 0 < wrong[..., 1].min()


def is_eighth(wrong, right):
    return (wrong == 0.125).all()


def is_direction(wrong, right):
    """|ω| of the rays through the centres, but for the jitter within one pixel."""
    x, y = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    directions = camera().rays(x.ravel(), y.ravel())[1].reshape(SIZE, SIZE, 3)[::-1]
    return abs(wrong - abs(directions)).max() < 0.06


def is_from_above(wrong, right):
    """The floor is 4 units away in the middle."""
    return np.allclose(wrong[7:9, 7:9], 0.4, atol=0.01)


def is_near(wrong, right):
    """Both triangles are everywhere; the second one is nearer."""
    return np.allclose(wrong, 0.15, atol=1e-6)


def times(factor):
    """The same samples, times a factor."""
    return lambda wrong, right: np.allclose(wrong, factor * right(), rtol=2e-3) and right().max() > 0


def is_other(wrong, right):
    return np.isfinite(wrong).all() and abs(wrong - right()).max() > 0.02 * right().max()


@dataclass(frozen=True)
class Case:
    """A method, the wrong one in its place, and what is seen then.

    Attributes:
        slot: of the scene or of the renderer; "" where a subclass of the renderer is used.
        shows: the view or estimator that asks the method.
    """

    method: str
    wrong: Callable
    slot: str
    shows: str
    seen: Callable
    renderer: str = "A1Renderer"

    def __str__(self) -> str:
        return f"{self.method}-{getattr(self.wrong, '__name__', '')}-{self.shows}"


A2 = "A2Renderer"
CASES = [
    Case("Camera.generate_ray", one_ray, "camera", "distance", is_even),
    Case("Camera.generate_ndc_coords", always_the_center, "camera", "distance", is_even),
    Case("Camera.generate_camera_coords", straight_ahead, "camera", "distance", is_even),
    Case("Camera.compute_matrix", matrix_from_above, "camera", "distance", is_from_above),
    Case("Camera.compute_matrix", matrix_from_above_in_kernels, "camera", "distance", is_from_above),
    Case("RayIntersector.intersect_triangle", plane_of_id, "intersector", "distance", is_near),
    Case("RayIntersector.query_ray", always_misses, "intersector", "hit", is_black),
    Case("Environment.query_ray", green_sky, "environment", "brdf", is_green, A2),
    Case("UniformSampler.sample_direction", straight_up, "sampler", "uniform", is_even, A2),
    Case("UniformSampler.evaluate_probability", hemisphere_density, "sampler", "uniform", times(1 / 2), A2),
    Case("BRDF.sample_direction", along_the_normal, "brdfs", "brdf", is_even, A2),
    Case("BRDF.evaluate_probability", twice_the_density, "brdfs", "brdf", times(1 / 2), A2),
    Case("BRDF.evaluate_brdf", without_pi, "brdfs", "uniform", times(np.pi), A2),
    Case("BRDF.evaluate_brdf_factor", half_the_factor, "brdfs", "brdf", times(1 / 2), A2),
    Case("MeshLightSampler.compute_triangle_area", area_of_one, "lamps", "environment", times(1 / 2), A2),
    Case("MeshLightSampler.compute_cdf", empty_cdf, "lamps", "environment", is_other, A2),
    Case("MeshLightSampler.sample_emissive_triangle", the_first_one, "lamps", "environment", is_other, A2),
    Case("MeshLightSampler.evaluate_probability", density_of_one, "lamps", "environment", times(1 / 4), A2),
    Case("MeshLightSampler.sample_mesh_lights", middle_of_the_first, "lamps", "environment", is_other, A2),
    Case("A1Renderer.shade_ray", direction_as_color, "", "normal", is_direction),
    Case("A2Renderer.shade_ray", direction_as_color, "", "brdf", is_direction, A2),
    Case("A3Renderer.shade_ray", direction_as_color, "", "mis", is_direction, "A3Renderer"),
    Case("A4Renderer.shade_ray", direction_as_color, "", "path", is_direction, "A4Renderer"),
]
CASES += [Case(f"A1Renderer.shade_{view}", an_eighth, "", view, is_eighth) for view in tt.A1Renderer.names()]
WAYS = ("class", "object", "assignment")
BOTH_WAYS = [(case, way) for case in CASES for way in WAYS if case.slot != "" or way != "object"]
# In the quick part, one way for each method: the ways take turns.
QUICK = [[(c, w) for c, w in BOTH_WAYS if c is case][k % (3 if case.slot else 2)] for k, case in enumerate(CASES)]


def camera(kind=None):
    """The camera of the pictures, of a class."""
    return (kind or tt.Camera)(SIZE, SIZE, **VIEW)


@contextlib.contextmanager
def replaced(case: Case, way: str):
    """Options of the scene, options of the renderer, and the renderer's class, with the wrong method there."""
    owner, method = getattr(tt, case.method.split(".")[0]), case.method.split(".")[1]
    code = getattr(case.wrong, "__wrapped__", case.wrong).__code__
    function = case.wrong if code.co_varnames[:1] == ("self",) else staticmethod(case.wrong)
    renderer = getattr(tt, case.renderer)
    if way == "assignment":
        former = vars(owner).get(method)
        setattr(owner, method, function)
        try:
            yield {}, {}, renderer
        finally:
            delattr(owner, method) if former is None else setattr(owner, method, former)
        return
    mine = type("Mine", (owner,), {method: function, "name": "mine"})
    made = mine if way == "class" or case.slot in ("", "environment", "camera") else mine()
    if case.slot == "":
        yield {}, {}, mine
    elif case.slot == "camera":
        yield {}, {"camera": camera(mine) if way == "object" else mine}, renderer
    elif case.slot == "sampler":
        yield {}, {"sampler": made}, renderer
    elif case.slot == "environment":
        yield {"environment": mine(SKY)}, {}, renderer
    else:
        yield (
            {"intersector": {"intersector": made}, "brdfs": {"brdfs": [made]}, "lamps": {"lamp_choice": made}}[
                case.slot
            ],
            {},
            renderer,
        )


def picture(case: Case, scene_options: dict, renderer_options: dict, renderer: type) -> np.ndarray:
    """The floor, under the sky, or under a lamp of two triangles; a list of triangles has the smaller kernels."""
    if case.renderer != "A1Renderer":
        scene_options = {"intersector": "brute_force", "triangle_test": "moller_trumbore", **scene_options}
    if case.slot == "lamps":
        gray, lamp = tt.Material(Kd=(0.5,) * 3), tt.Material(Kd=(0, 0, 0), Ke=(5, 5, 5))
        faces = [*SQUARE, *(np.array(SQUARE) + 4)]
        mesh = tt.Mesh(np.array(FLOOR + LAMP, float), np.array(faces), materials=[gray, lamp])
        mesh.face_materials = np.array([0, 0, 1, 1])
        scene = tt.SceneData(mesh, **{"lamp_choice": tt.MeshLightSampler, "environment": "black", **scene_options})
    else:
        scene = tt.scene_from_mesh(FLOOR, SQUARE, color=(0.5,) * 3, **{"environment": SKY, **scene_options})
    made = renderer(scene_data=scene, width=SIZE, height=SIZE, **renderer_options)
    if "camera" not in renderer_options or isinstance(renderer_options["camera"], type):
        made.camera.set_camera_parameters(**VIEW)
    return np.asarray(made.use(case.shows).render(1).image())


RIGHT: dict[tuple, np.ndarray] = {}


def check(case: Case, way: str) -> None:
    """The picture with the wrong method is what the method says."""
    with replaced(case, way) as options:
        wrong = picture(case, *options)
    key = case.renderer, case.shows, case.slot == "lamps"

    def right():
        if key not in RIGHT:
            RIGHT[key] = picture(case, {}, {}, getattr(tt, case.renderer))
        return RIGHT[key]

    assert case.seen(wrong, right), wrong[8, ::5]


@pytest.mark.parametrize("case", [CASES[0], CASES[8], CASES[10]], ids=str)
def test_the_right_picture_is_not_even(case):
    """So a picture of one colour is another picture."""
    right = picture(case, {}, {}, getattr(tt, case.renderer))
    assert np.ptp(right, (0, 1)).max() > 1e-3


@pytest.mark.parametrize(("case", "way"), QUICK, ids=str)
def test_a_wrong_method_has_the_wrong_picture(case, way):
    check(case, way)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "way"), [row for row in BOTH_WAYS if row not in QUICK], ids=str)
def test_a_wrong_method_has_the_wrong_picture_in_the_other_ways(case, way):
    check(case, way)


@pytest.mark.parametrize("way", WAYS)
def test_a_wrong_intersection_answers_the_questions_of_python(way):
    case = CASES[5]
    rays = np.array([[2, 2, 3], [-3, 2, 2]]), np.array([[0, -1, 0], [0, -1, 0]])
    with replaced(case, way) as (options, _, _):
        scene = tt.scene_from_mesh(FLOOR, SQUARE, **options)
        hits, blocked = scene.intersect(*rays), scene.occluded(*rays)
    assert hits.distance.tolist() == [1.5, 1.5]
    assert hits.triangle_id.tolist() == [1, 1]
    assert blocked.all()
    right = tt.scene_from_mesh(FLOOR, SQUARE).intersect(*rays)
    assert right.distance.tolist() == [2.0, 2.0]
    assert right.triangle_id.tolist() == [0, 0]
