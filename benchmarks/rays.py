"""Rays per second, compared with Mitsuba 3 and Embree.

The tables show primary rays, whole frames, incoherent rays (t, id, u, v, and everything about the hit), occlusion rays,
and rays that come from and go to numpy.

python -m benchmarks.rays [TRIANGLES ...]
"""

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from benchmarks.helper import describe_machine, interleaved, meshes_of, ratio_table
from benchmarks.peers import MitsubaScene, embree_scene
from taichi_tracer.camera import Camera
from taichi_tracer.ray import Ray

SIZES = 82_000, 512_000
NUM_RAYS = 1 << 20
VIEW = {"eye": (0.0, 0.5, 2.8), "at": (0.0, 0.0, 0.0), "fov": 60.0}


@ti.data_oriented
class RayKernels:
    """Kernels for rays that are stored in Taichi fields."""

    def __init__(self, scene: tt.SceneData, origins: np.ndarray, directions: np.ndarray) -> None:
        self.scene, self.intersector = scene, scene.ray_intersector
        n = len(origins)
        self.origin, self.direction = ti.Vector.field(3, float, n), ti.Vector.field(3, float, n)
        self.t, self.triangle_id = ti.field(float, n), ti.field(ti.i32, n)
        self.uv = ti.Vector.field(2, float, n)
        self.normal, self.geometric_normal, self.position = (ti.Vector.field(3, float, n) for _ in range(3))
        self.origin.from_numpy(origins)
        self.direction.from_numpy(directions)

    @ti.kernel
    def nearest(self):
        """Find t, id, u and v for every ray."""
        for i in self.t:
            ray = Ray(origin=self.origin[i], direction=self.direction[i])
            hit = self.intersector.search(ray, 0.0, tm.inf, False)
            self.t[i], self.triangle_id[i], self.uv[i] = hit.distance, hit.triangle_id, hit.barycentric_coords

    @ti.kernel
    def occluded(self):
        """Find for every ray whether it hits anything."""
        for i in self.t:
            ray = Ray(origin=self.origin[i], direction=self.direction[i])
            self.triangle_id[i] = self.intersector.is_blocked(ray, 0.0, tm.inf)

    @ti.kernel
    def described(self):
        """Find t, id, u and v for every ray, both normals and the position."""
        for i in self.t:
            hit = self.intersector.query_ray(Ray(origin=self.origin[i], direction=self.direction[i]))
            self.t[i], self.triangle_id[i], self.uv[i] = hit.distance, hit.triangle_id, hit.barycentric_coords
            self.normal[i], self.geometric_normal[i] = hit.normal, hit.geometric_normal
            self.position[i] = hit.position

    def run(self, kernel) -> None:
        """Run one of the kernels until it has ended."""
        kernel()
        ti.sync()


def incoherent_rays(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Origins uniform in a box, directions uniform on the sphere; float32."""
    rng = np.random.default_rng(1)
    origins = rng.uniform(low, high, (NUM_RAYS, 3)).astype(np.float32)
    directions = rng.normal(size=(NUM_RAYS, 3))
    return origins, (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)


def primary_rays(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """The camera's rays in the order of the packets, tile by tile. This order is also the fastest for Mitsuba."""
    size, tile = camera.width, 4
    index = np.arange(size * size)
    block, lane = index // tile**2, index % tile**2
    x = block // (size // tile) * tile + lane // tile
    y = block % (size // tile) * tile + lane % tile
    half_x, half_y = camera.compute_half_size()
    plane = [(2 * (x + 0.5) / size - 1) * half_x, (2 * (y + 0.5) / size - 1) * half_y, np.ones(len(index))]
    directions = np.stack(plane, axis=-1) @ camera.compute_matrix()[:3, :3].T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.broadcast_to(camera.eye, directions.shape), directions


def frame(scene: tt.SceneData, size: int):
    """A function that renders the normal view as after a move of the camera."""
    renderer = tt.A1Renderer(scene, size, size).use("normal")
    renderer.camera.set_camera_parameters(**VIEW)

    def call() -> None:
        renderer.camera.version += 1  # like a move, but without the cost of a new matrix
        renderer.render()
        ti.sync()

    return call


def measure(name: str, vertices: np.ndarray, faces: np.ndarray) -> str:
    """The markdown tables for one mesh."""
    scenes = {
        test: tt.scene_from_mesh(vertices, faces, triangle_test=test) for test in ("watertight", "moller_trumbore")
    }
    peer = MitsubaScene(vertices, faces)
    base, report = "Mitsuba llvm", ""
    for size in (512, 1024):
        rays = peer.rays(*primary_rays(Camera(size, size, **VIEW)))
        medians = interleaved({base: peer.normals(rays), "taichi_tracer": frame(scenes["watertight"], size)})
        report += ratio_table(f"{name}: normal view, whole frame, {size}²", medians, base, "ms")

    origins, directions = incoherent_rays(vertices.min(axis=0), vertices.max(axis=0))
    rays = peer.rays(origins, directions)
    tables = {
        "incoherent rays, t, id, u, v": {base: peer.nearest(rays)},
        "incoherent rays, full hit data": {base: peer.described(rays)},
        "occlusion rays": {base: peer.occluded(rays)},
    }
    for test, scene in scenes.items():
        kernels = RayKernels(scene, origins, directions)
        calls = kernels.nearest, kernels.described, kernels.occluded
        for candidates, call in zip(tables.values(), calls, strict=True):
            candidates[f"taichi_tracer, {test}"] = lambda call=call, kernels=kernels: kernels.run(call)
    for title, candidates in tables.items():
        report += ratio_table(f"{name}: {title}", interleaved(candidates), base, "million rays/s", NUM_RAYS)

    embree = embree_scene(vertices, faces)
    for count in (NUM_RAYS // 4, NUM_RAYS):
        some = origins[:count], directions[:count]
        outside = {
            "embreex, two threads": lambda some=some: in_two_threads(embree, *some),
            "embreex, one thread": lambda some=some: embree.run(*some, output=True),
            "taichi_tracer": lambda some=some: scenes["watertight"].intersect(*some),
        }
        title = f"{name}: numpy in and out, all outputs, {count:,} rays"
        report += ratio_table(title, interleaved(outside), "embreex, two threads", "million rays/s", count)
    return report


def in_two_threads(embree, origins: np.ndarray, directions: np.ndarray) -> None:
    """Each of two threads traces half of the rays; embreex lets other threads run in the meantime."""
    half = len(origins) // 2
    with ThreadPoolExecutor(2) as threads:
        parts = [threads.submit(embree.run, origins[p], directions[p], output=True) for p in np.s_[:half, half:]]
    for part in parts:
        part.result()


if __name__ == "__main__":
    print(describe_machine())
    tt.init(arch="auto")
    for mesh_name, mesh in meshes_of(sys.argv[1:], SIZES).items():
        print(measure(mesh_name, *mesh))
