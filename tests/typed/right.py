"""A program as a student writes it, with types: ``test_typed.py`` checks that a type checker accepts it.

It is read, and never run.
"""

from pathlib import Path

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt


@tt.register
class Facing(tt.View):
    """How much of a surface faces the camera."""

    name, label = "facing", "Facing"

    @ti.func
    def color(self, hit):
        return tm.vec3(abs(hit.normal.z))


class Pinhole(tt.Camera):
    """A camera whose rays are written by a student."""

    @ti.func
    def generate_ray(self, pixel_x, pixel_y, jitter=False):
        return tt.Ray(origin=tm.vec3(0), direction=tm.vec3(0, 0, 1))


@ti.data_oriented
class Grid(tt.RayIntersector):
    """An intersector of a student."""

    name = "grid"

    def bind(self, geometry: tt.Geometry, triangle_test: str | tt.TriangleTest = "watertight") -> None:
        super().bind(geometry, triangle_test)
        self.cells: int = geometry.n_triangles


def pictures(folder: Path) -> float:
    """Scenes, renderers and pictures."""
    tt.init(arch="cpu", precision="f64", threads=2)
    scene: tt.SceneData = tt.load_scene_data("cornell_box", environment="studio", intersector=Grid, brdfs=["phong"])
    renderer = tt.A1Renderer(scene_data=scene, width=64, height=64, camera=tt.OrthographicCamera, jitter=True)
    renderer.camera.set_camera_parameters(eye=(0, 1, 3), at=[0, 1, 0], up=np.array([0.0, 1.0, 0.0]), fov=60)
    renderer.set_shade_normal().render().save(folder / "normal.png")
    renderer.use(Facing()).render(spp=4, watch=lambda progress: print(progress.samples, progress.seconds_left))

    lit = tt.A2Renderer(scene, 64, 64, camera=Pinhole(64, 64), sampler="independent", seed=3, adaptive=True)
    lit.set_sample_mis().render(time=1.5, error=0.02)
    tt.save_image(folder / "lit.exr", lit.image(), srgb=False)
    read: np.ndarray = tt.read_image(folder / "lit.exr")
    paths = tt.A4Renderer(scene, 64, 64, seed=1).set_shading_explicit()
    paths.bounces = (1, None)
    terms = paths.pictures_by_bounce(4, bounces=[0, (1, 3), (4, None)])
    print(terms[0].mean(), tt.A3Renderer(scene).mis_pbrdf)
    error = lit.error()
    print(error.low, error.high, *lit.receipt(), read.mean(), lit.non_finite)
    return float(error)


def rays(vertices: np.ndarray, faces: list[tuple[int, int, int]]) -> np.ndarray:
    """Questions about single rays."""
    scene = tt.scene_from_mesh(vertices, faces, triangle_test="moller_trumbore")
    hits = scene.intersect([[0, 1, 3]], [[0, 0, -1]], t_max=10)
    names = [scene.materials[i].name for i in hits.material_id[hits.is_hit]]
    blocked = scene.occluded(np.zeros((2, 3)), (0, 1, 0))
    print(len(hits), names, hits.distance + 1, blocked.any())
    return hits.normal


def study() -> None:
    """What accuracy costs."""
    table, figure = tt.studies.accuracy("cube", size=(64, 64), budget=30, estimators=("brdf", "mis"))
    figure.savefig("chart.png")
    print(table["variant"], tt.scene_names(), tt.__version__)
