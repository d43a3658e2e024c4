"""What the student writes is what runs: whoever replaces a handout's method changes every picture and every answer.

Each method is replaced by a wrong one in three ways: by a class in a slot, by an object in a slot, and by assigning to
the package's class before the scene is made. ``python -m pytest tests/test_live_seams.py -m long -s`` with
TAICHI_TRACER_LONG=all prints the whole table; a part of it is tested in every run.
"""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.system.seams import assigned

SCENE, LIGHT = "cornell_box", "studio"
VIEW = {"eye": (0, 1, 3), "at": (0, 1, 0), "up": (0, 1, 0), "fov": 60.0}


@ti.func
def other_ray(self, pixel_x, pixel_y, jitter=False):
    """The handout's signature, with a direction that the right camera never has."""
    x, y = ti.cast(pixel_x, float), ti.cast(pixel_y, float)
    if jitter:
        x += ti.random() - 0.5
        y += ti.random() - 0.5
    direction = tm.vec3(x / self.width - 0.3, y / self.height - 0.3, -1)
    return tt.Ray(origin=tm.vec3(0, 1, 3), direction=direction.normalized())


@ti.func
def pixel_corner(self, pixel_x: ti.i32, pixel_y: ti.i32):
    """The first assignment's signature, and its commonest mistake: no half pixel, and y downwards."""
    return tm.vec2(2 * pixel_x / self.width - 1, 1 - 2 * pixel_y / self.height)


@ti.func
def no_tangent(self, ndc_coords):
    """The angle itself instead of the tangent of half of it."""
    angle = self.fov * tm.pi / 180
    return tm.vec4(ndc_coords.x * angle, ndc_coords.y * angle, 1, 0)


def mirrored_matrix(self):
    """A frame whose x axis points the other way."""
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 2], matrix[:3, 3] = (1, 0, 0), (0, 0, -1), np.asarray(self.eye)
    return matrix


@ti.func
def matrix_in_kernel(self):
    """The handout's form, for kernels, with the rows where the columns belong."""
    z = tm.normalize(self.at - self.eye)
    x = tm.normalize(tm.cross(self.up, z))
    y = tm.cross(z, x)
    e = self.eye
    return tm.mat4([y.x, x.x, z.x, e.x], [y.y, x.y, z.y, e.y], [y.z, x.z, z.z, e.z], [0, 0, 0, 1])


@ti.func
def far_too_near(self, ray, triangle_id):
    """HitData filled field by field, with a plane in place of the triangle."""
    hit = tt.HitData()
    if ray.direction.z < -self.EPSILON:
        hit.is_hit = True
        hit.triangle_id = triangle_id
        hit.distance = 1.0 + 0.01 * triangle_id
        hit.barycentric_coords = tm.vec2(0.25, 0.25)
        hit.normal = tm.vec3(0, 0.6, 0.8)
        hit.material_id = self.geometry.triangle_material_ids[triangle_id]
    return hit


@ti.func
def always_misses(self, ray):
    """A miss, whatever is there."""
    return tt.HitData()


@ti.func
def green_sky(self, ray):
    """One colour for every direction."""
    return tm.vec3(0, 2, 0)


@ti.func
def straight_up():
    """Not random at all."""
    return tm.vec3(0, 1, 0)


@ti.func
def hemisphere_density():
    """1/(2π), although the directions cover the sphere."""
    return 1 / (2 * tm.pi)


@ti.func
def along_the_normal(material, w_o, normal):
    """One direction instead of a distribution."""
    return normal


@ti.func
def twice_the_density(material, w_o, w_i, normal):
    """2 max(0, n·ω_i)/π."""
    return 2 * ti.max(0.0, tm.dot(normal, w_i)) / tm.pi


@ti.func
def without_pi(material, w_o, w_i, normal):
    """Kd, not divided by π."""
    return material.Kd


@ti.func
def half_the_factor(material, w_o, w_i, normal):
    """Kd/2."""
    return material.Kd / 2


@ti.func
def area_of_one(v0, v1, v2):
    """Every triangle has the same area."""
    return 1.0


def empty_cdf(self):
    """Nothing is filled in."""
    self.cdf.fill(0)


@ti.func
def the_first_one():
    """Always the same triangle."""
    return 0


@ti.func
def density_of_one(self):
    """As if the lamps had the area 1."""
    return 1.0


@ti.func
def straight_to_the_first(self, hit_point):
    """No point is chosen."""
    triangle_id = self.emissive_triangle_ids[0]
    v0, v1, v2 = self.geometry.triangle(triangle_id)
    return ((v0 + v1 + v2) / 3 - hit_point).normalized(), triangle_id


@ti.func
def flat_shading(self, ray):
    """A colour of the ray alone."""
    return abs(ray.direction)


@ti.func
def flat_view(self, hit_data):
    """One colour."""
    return tm.vec3(0.125)


@dataclass(frozen=True)
class Seam:
    """A method of the handouts, a wrong one for it, and what it decides.

    Attributes:
        owner: the public class. method: its name.
        wrong: what replaces it.
        slot: the slot of the scene, the renderer, or "" where a subclass of the renderer is used itself.
        shows: the view, and the estimator, that ask it; None where none does.
        answers: whether ``scene.intersect`` and ``scene.occluded`` depend on it.
    """

    owner: str
    method: str
    wrong: Callable
    slot: str
    shows: tuple[str | None, str | None]
    answers: bool = False

    @property
    def id(self) -> str:
        """For the table."""
        return f"{self.owner}.{self.method}" + ("" if self.wrong is not matrix_in_kernel else " (kernel)")


def handout_seams() -> list[Seam]:
    """Every method that a student replaces."""
    both = ("normal", "mis")
    cameras = {"generate_ray": other_ray, "generate_ndc_coords": pixel_corner, "generate_camera_coords": no_tangent}
    seams = [Seam("Camera", name, wrong, "camera", both) for name, wrong in cameras.items()]
    seams += [Seam("Camera", "compute_matrix", wrong, "camera", both) for wrong in (mirrored_matrix, matrix_in_kernel)]
    seams += [Seam("RayIntersector", "intersect_triangle", far_too_near, "intersector", both, True)]
    seams += [Seam("RayIntersector", "query_ray", always_misses, "intersector", both, True)]
    seams += [Seam("Environment", "query_ray", green_sky, "environment", (None, "mis"))]
    uniform = {"sample_direction": straight_up, "evaluate_probability": hemisphere_density}
    seams += [Seam("UniformSampler", name, wrong, "sampler", (None, "uniform")) for name, wrong in uniform.items()]
    brdf = {"sample_direction": along_the_normal, "evaluate_probability": twice_the_density}
    brdf |= {"evaluate_brdf": without_pi, "evaluate_brdf_factor": half_the_factor}
    seams += [Seam("BRDF", name, wrong, "brdfs", (None, "brdf")) for name, wrong in brdf.items()]
    lamps = {"compute_triangle_area": area_of_one, "compute_cdf": empty_cdf, "sample_emissive_triangle": the_first_one}
    lamps |= {"evaluate_probability": density_of_one, "sample_mesh_lights": straight_to_the_first}
    seams += [Seam("MeshLightSampler", name, wrong, "lamps", (None, "environment")) for name, wrong in lamps.items()]
    seams += [Seam("A1Renderer", "shade_ray", flat_shading, "", ("normal", None))]
    seams += [Seam("A2Renderer", "shade_ray", flat_shading, "", (None, "mis"))]
    views = ("hit", "triangle_id", "distance", "barycentric", "normal", "material_id")
    return [*seams, *(Seam("A1Renderer", f"shade_{view}", flat_view, "", (view, None)) for view in views)]


SEAMS = handout_seams()
WAYS = ("class", "object", "assignment")


pytestmark = pytest.mark.usefixtures("f32")


@contextlib.contextmanager
def replaced(seam: Seam, way: str):
    """What to give to the scene and to the renderer so that the wrong method is there: (scene options, renderer)."""
    owner = getattr(tt, seam.owner)
    has_self = "self" in seam.wrong.__code__.co_varnames if not hasattr(seam.wrong, "func") else has_self_of(seam.wrong)
    method = seam.wrong if has_self else staticmethod(seam.wrong)
    if way == "assignment":
        former = vars(owner).get(seam.method)
        setattr(owner, seam.method, method)
        try:
            yield {}, {}, {}
        finally:
            if former is None:
                delattr(owner, seam.method)
            else:
                setattr(owner, seam.method, former)
        return
    mine = type("Mine", (owner,), {seam.method: method, "name": "mine"})
    if seam.slot == "":
        yield {}, {}, {seam.owner: mine}
    elif seam.slot == "camera":
        yield {}, {"camera": mine}, {}
    elif seam.slot == "environment":
        pixels = np.full((2, 4, 3), 0.5)
        yield {"environment": mine(pixels)}, {}, {}
    elif seam.slot == "sampler":
        yield {}, {"sampler": mine if way == "class" else mine()}, {}
    elif seam.slot == "lamps":
        yield {"lamp_choice": mine if way == "class" else mine()}, {}, {}
    elif seam.slot == "brdfs":
        yield {"brdfs": [mine if way == "class" else mine()]}, {}, {}
    else:
        yield {"intersector": mine if way == "class" else mine()}, {}, {}


def has_self_of(function) -> bool:
    """Whether a Taichi function has ``self``."""
    return function.__wrapped__.__code__.co_varnames[:1] == ("self",)


def outputs_of(
    seam: Seam, way: str, what: tuple[str, ...], scene_options, renderer_options, renderers
) -> dict[str, np.ndarray]:
    """The outputs that a seam decides."""
    scene = tt.load_scene_data(SCENE, **{"environment": LIGHT, **scene_options})
    view, estimator = seam.shows
    made = {}

    def picture(cls: str, name: str, size: int, frames: int) -> np.ndarray:
        options = dict(renderer_options)
        if "camera" in options:
            options["camera"] = options["camera"] if way == "class" else options["camera"](size, size, **VIEW)
        renderer = renderers.get(cls, getattr(tt, cls))(scene, size, size, **options).use(name)
        for _ in range(frames):
            renderer.camera.set_camera_parameters()  # as if moved
            renderer.render()
        return renderer.image()

    if view is not None and "A1 64²" in what:
        made["A1 64²"] = picture("A1Renderer", view, 64, 1)
    if view is not None and "A1 512², second frame" in what:
        made["A1 512², second frame"] = picture("A1Renderer", view, 512, 2)
    if estimator is not None and "A2" in what:
        made["A2"] = picture("A2Renderer", estimator, 32, 1)
    if seam.answers and "intersect" in what:
        directions = np.array([[x, y, -1] for x in (-0.2, 0, 0.2) for y in (-0.2, 0, 0.2)])
        origins = np.tile([[0.0, 1.0, 3.0]], (len(directions), 1))
        hits, blocked = scene.intersect(origins, directions), scene.occluded(origins, directions)
        made["intersect"] = np.concatenate([hits.distance, hits.triangle_id, blocked])
    scene.destroy()
    return made


RIGHT: dict[tuple, np.ndarray] = {}


def right(seam: Seam, output: str) -> np.ndarray:
    """What the package's own methods give."""
    key = (*seam.shows, output, seam.slot if seam.slot in ("environment", "lamps") else "")
    if key not in RIGHT:
        options = {"environment": np.full((2, 4, 3), 0.5)} if seam.slot == "environment" else {}
        if seam.slot == "lamps":
            options = {"lamp_choice": tt.MeshLightSampler}
        of_output = outputs_of(seam, "", (output,), options, {}, {})
        RIGHT[key] = of_output.get(output)
    return RIGHT[key]


def table_row(seam: Seam, way: str, what: tuple[str, ...]) -> dict[str, str]:
    """Output → "changed" or "unchanged"."""
    with replaced(seam, way) as (scene_options, renderer_options, renderers):
        wrong = outputs_of(seam, way, what, scene_options, renderer_options, renderers)
    assert assigned() == []
    if way == "assignment" and seam.slot == "environment":
        seam = Seam(seam.owner, seam.method, seam.wrong, "", seam.shows)
    same = {name: np.array_equal(image, right(seam, name)) for name, image in wrong.items()}
    return {name: "unchanged" if is_same else "changed" for name, is_same in same.items()}


ALIKE = ("evaluate_brdf", "evaluate_brdf_factor", "shade_hit", "shade_triangle_id", "shade_distance")
ALIKE += ("shade_barycentric", "shade_material_id", "evaluate_probability", "generate_ndc_coords")
ALIKE += (
    "generate_camera_coords",
    "compute_matrix",
    "compute_triangle_area",
    "compute_cdf",
    "sample_emissive_triangle",
)  # live by the same lines as others: tested with what takes long


QUICK = ("Camera.generate_ray", "RayIntersector.query_ray", "A2Renderer.shade_ray")
CLASSES = [pytest.param(s, id=s.id) for s in SEAMS if s.id in QUICK]


@pytest.mark.parametrize("seam", CLASSES)
def test_a_class_in_a_slot_changes_the_first_picture(seam):
    small = ("A1 64²", "intersect") if seam.shows[0] is not None else ("A2",)
    row = table_row(seam, "class", small)
    assert row
    assert set(row.values()) == {"changed"}, row


PARTS_FILE = """
import numpy as np
import taichi as ti
import taichi.math as tm
import taichi_tracer as tt
{source}
tt.{owner}.{method} = {wrong}
"""
