"""The package's own scenes in Mitsuba 3: triangles and spheres with their materials, seen from the same camera.

Mitsuba has no Phong BRDF. A glossy material becomes a microfacet lobe of the same width, which takes as much time but
is not the same BRDF, and a mirror does not weigh with cos θ, as Phong's limit does.
"""

import numpy as np

from benchmarks import peers  # noqa: F401 (its import sets the path of libLLVM)
from taichi_tracer.brdfs.smooth_dielectric import Dielectric
from taichi_tracer.files import read
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.scene_data_loader import COURSE_VIEW, find_scene, own_view

MIRROR_FROM = 1e6  # Ns
NO_ROULETTE = 1000  # the depth at which Mitsuba begins its roulette
MIS = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1}  # its integrator for direct light


def path(max_bounces: int) -> dict:
    """Mitsuba's ``path`` integrator for paths of as many bounces, without roulette. Its depth counts the light, too."""
    return {"type": "path", "max_depth": max_bounces + 1, "rr_depth": NO_ROULETTE}


class MitsubaPicture:
    """A scene, a camera and an integrator in Mitsuba.

    Args:
        scene: the name of a scene of the package, or a mesh.
        integrator: Mitsuba's description of an integrator.
        environment: (h, w, 3) radiance; None for no environment. Mitsuba's map begins a quarter of a turn from ours.
        compensates: whether samples of the environment leave to the BRDF what it finds; by default they do not.
        view: the camera; None for the scene's own, or the course's.
    """

    def __init__(
        self,
        scene: str | Mesh,
        integrator: dict,
        width: int,
        height: int,
        variant: str = "llvm_ad_rgb",
        sampler: str = "independent",
        environment: np.ndarray | None = None,
        view: dict | None = None,
        compensates: bool = False,
    ) -> None:
        import mitsuba

        mitsuba.set_variant(variant)
        self.mi = mitsuba
        mesh = scene
        if not isinstance(mesh, Mesh):
            file = find_scene(mesh)
            mesh, view = read(file), view or own_view(file)
        description = {"type": "scene", "integrator": integrator}
        description["sensor"] = self.sensor(view or COURSE_VIEW, width, height, sampler)
        if environment is not None:
            turned = mitsuba.ScalarTransform4f().rotate([0, 1, 0], 90)
            bitmap = mitsuba.Bitmap(environment.astype(np.float32))
            sky = {"type": "envmap", "bitmap": bitmap, "to_world": turned, "mis_compensation": compensates}
            description["light"] = sky
        for i in mesh.used_materials():
            if (mesh.face_materials == i).any():
                description[f"part{i}"] = self.part(mesh, int(i))
        for k, (sphere, i) in enumerate(zip(mesh.spheres, mesh.sphere_materials, strict=True)):
            shape = {"type": "sphere", "center": sphere[:3].tolist(), "radius": float(sphere[3])}
            emitter = {"emitter": light_of(mesh.materials[i])} if max(mesh.materials[i].Ke) > 0 else {}
            description[f"sphere{k}"] = shape | {"bsdf": bsdf(mesh.materials[i])} | emitter
        self.scene = mitsuba.load_dict(description)

    def sensor(self, view: dict, width: int, height: int, sampler: str) -> dict:
        """A camera that sees right-handed data unmirrored."""
        film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
        to_world = self.mi.ScalarTransform4f().look_at(*(list(map(float, view[k])) for k in ("eye", "at", "up")))
        return {
            "type": "perspective",
            "fov": view["fov"],
            "fov_axis": "y",
            "to_world": to_world,
            "film": film | {"pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": sampler, "sample_count": 1},
        }

    def part(self, mesh: Mesh, i: int):
        """The triangles of one material; with Ke > 0 their front sides emit."""
        material, is_here = mesh.materials[i], mesh.face_materials == i
        ids = mesh.faces[is_here]
        has_normals = len(mesh.face_normals) > 0 and bool((mesh.face_normals[is_here] >= 0).all())
        has_uv = mesh.corner_uv is not None and material.map_Kd is not None
        properties = self.mi.Properties()
        properties["mesh_bsdf"] = self.mi.load_dict(bsdf(material))
        if max(material.Ke) > 0:
            properties["mesh_emitter"] = self.mi.load_dict(light_of(material))
        shape = self.mi.Mesh(
            f"part{i}",
            3 * len(ids),
            len(ids),
            has_vertex_normals=has_normals,
            has_vertex_texcoords=has_uv,
            props=properties,
        )
        parameters = self.mi.traverse(shape)
        parameters["vertex_positions"] = mesh.vertices[ids.ravel()].astype(np.float32).ravel()
        if has_normals:
            parameters["vertex_normals"] = mesh.normals[mesh.face_normals[is_here].ravel()].astype(np.float32).ravel()
        if has_uv:
            parameters["vertex_texcoords"] = mesh.corner_uv[is_here].astype(np.float32).ravel()
        parameters["faces"] = np.arange(3 * len(ids), dtype=np.uint32)
        parameters.update()
        return shape

    def render(self, spp: int = 1, seed: int = 0) -> np.ndarray:
        """The picture, (h, w, 3)."""
        return np.array(self.mi.render(self.scene, spp=spp, seed=seed))[..., :3]


def light_of(material: Material) -> dict:
    """Mitsuba's description of what a material with Ke > 0 emits."""
    return {"type": "area", "radiance": {"type": "rgb", "value": list(material.Ke)}}


def bsdf(material: Material) -> dict:
    """Mitsuba's description of a material."""
    if Dielectric().describes(material, np.float32):
        return {"type": "dielectric", "int_ior": material.Ni, "ext_ior": 1.0}
    colour = {"type": "rgb", "value": list(material.Kd)}
    if material.map_Kd is not None:
        import mitsuba

        picture = mitsuba.Bitmap((material.Kd * material.map_Kd.pixels[::-1]).astype(np.float32))
        colour = {"type": "bitmap", "bitmap": picture, "raw": True}
    if material.Ns <= 1:
        inner = {"type": "diffuse", "reflectance": colour}
    elif material.Ns >= MIRROR_FROM:
        inner = {"type": "conductor", "material": "none", "specular_reflectance": colour}
    else:
        inner = {"type": "roughconductor", "material": "none", "alpha": (2 / (material.Ns + 2)) ** 0.5}
    return {"type": "twosided", "nested": inner}
