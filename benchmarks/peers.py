"""Mitsuba 3 and Embree on the same mesh and the same rays."""

import glob
import os
from collections.abc import Callable

import numpy as np

# Mitsuba uses the first libLLVM that it finds, and an old one cannot compile all variants: choose the newest here.
for llvm in (f"/usr/lib/*/libLLVM*{version}*" for version in range(29, 15, -1)):
    if found := glob.glob(llvm):
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", found[0])


class MitsubaScene:
    """A mesh in Mitsuba 3. Its rays stay in Mitsuba's memory between calls."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, variant: str = "llvm_ad_rgb") -> None:
        import drjit
        import mitsuba

        mitsuba.set_variant(variant)
        self.mi, self.dr = mitsuba, drjit
        mesh = mitsuba.Mesh("mesh", len(vertices), len(faces))
        parameters = mitsuba.traverse(mesh)
        parameters["vertex_positions"] = vertices.astype(np.float32).ravel()
        parameters["faces"] = faces.astype(np.uint32).ravel()
        parameters.update()
        self.scene = mitsuba.load_dict({"type": "scene", "mesh": mesh})

    def rays(self, origins: np.ndarray, directions: np.ndarray):
        """(N, 3) arrays as Mitsuba rays."""
        o = self.mi.Point3f(np.ascontiguousarray(origins.T, np.float32))
        d = self.mi.Vector3f(np.ascontiguousarray(directions.T, np.float32))
        self.dr.eval(o, d)
        return o, d

    def nearest(self, rays) -> Callable[[], None]:
        """A function that finds t, triangle and barycentric coordinates for every ray."""

        def call() -> None:
            hit = self.scene.ray_intersect_preliminary(self.mi.Ray3f(*rays))
            self.dr.eval(hit.t, hit.prim_index, hit.prim_uv)
            self.dr.sync_thread()

        return call

    def described(self, rays) -> Callable[[], None]:
        """A function that finds ``nearest``, both normals and the position for every ray."""

        def call() -> None:
            hit = self.scene.ray_intersect(self.mi.Ray3f(*rays), self.mi.RayFlags.All, False)
            self.dr.eval(hit.t, hit.prim_index, hit.uv, hit.n, hit.sh_frame.n, hit.p)
            self.dr.sync_thread()

        return call

    def normals(self, rays) -> Callable[[], None]:
        """A function that finds the shading normal for every ray; the rays are coherent."""

        def call() -> None:
            flags = self.mi.RayFlags.Minimal | self.mi.RayFlags.ShadingFrame
            hit = self.scene.ray_intersect(self.mi.Ray3f(*rays), flags, True)
            color = self.dr.select(hit.is_valid(), 0.5 * hit.sh_frame.n + 0.5, 0)
            self.dr.eval(color)
            self.dr.sync_thread()

        return call

    def occluded(self, rays) -> Callable[[], None]:
        """A function that finds for every ray whether it hits anything."""

        def call() -> None:
            self.dr.eval(self.scene.ray_test(self.mi.Ray3f(*rays)))
            self.dr.sync_thread()

        return call


def embree_scene(vertices: np.ndarray, faces: np.ndarray):
    """A mesh in Embree, through the package embreex."""
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, vertices.astype(np.float32), faces.astype(np.int32))
    return scene
