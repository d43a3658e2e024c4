"""Direct illumination beside Mitsuba 3: time per sample, time to an error.

python -m benchmarks.direct [sample | error ...]
"""

import numpy as np
import taichi as ti

import taichi_tracer as tt
from benchmarks import peers  # noqa: F401 (says where libLLVM is)
from benchmarks.measure import describe_machine, interleaved, ratio_table
from taichi_tracer.files.shipped import shipped_environments
from taichi_tracer.scene_data_loader import COURSE_VIEW

SIZE = 512
SPP_PER_CALL = 16


class MitsubaDirect:
    """The three spheres under an environment in Mitsuba 3, by its ``direct`` integrator."""

    def __init__(self, environment: str, variant: str, size: int, sampler: str = "independent", mis: bool = False):
        import drjit
        import mitsuba

        mitsuba.set_variant(variant)
        self.mi, self.dr, self.size = mitsuba, drjit, size
        scene = {"type": "scene", "integrator": self.integrator(mis), "sensor": self.sensor(sampler)}
        scene["light"] = self.light(environment)
        from taichi_tracer.files import read
        from taichi_tracer.scene_data_loader import find_scene

        mesh = read(find_scene("specular_spheres"))
        for i, material in enumerate(mesh.materials):
            scene[f"part{i}"] = self.part(mesh, i, material)
        self.scene = mitsuba.load_dict(scene)

    @staticmethod
    def integrator(mis: bool) -> dict:
        """BRDF sampling alone, or both."""
        return {"type": "direct", "emitter_samples": 1 if mis else 0, "bsdf_samples": 1}

    def sensor(self, sampler: str) -> dict:
        """The course's view."""
        to_world = self.mi.ScalarTransform4f().look_at(*(COURSE_VIEW[k] for k in ("eye", "at", "up")))
        film = {"type": "hdrfilm", "width": self.size, "height": self.size, "rfilter": {"type": "box"}}
        film |= {"pixel_format": "rgb", "component_format": "float32"}
        return {
            "type": "perspective",
            "fov": COURSE_VIEW["fov"],
            "fov_axis": "y",
            "to_world": to_world,
            "film": film,
            "sampler": {"type": sampler, "sample_count": 1},
        }

    def light(self, environment: str) -> dict:
        """The same radiance; Mitsuba's map begins elsewhere, which matters to nobody's time."""
        pixels = np.load(shipped_environments()[environment]).astype(np.float32)
        return {"type": "envmap", "bitmap": self.mi.Bitmap(pixels)}

    def part(self, mesh, i: int, material) -> dict:
        """The triangles of one material."""
        ids = mesh.faces[mesh.face_materials == i]
        normal_ids = mesh.face_normals[mesh.face_materials == i]
        vertices, normals = mesh.vertices[ids.ravel()], mesh.normals[normal_ids.ravel()]
        bsdf = {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(material.Kd)}}
        if material.Ns > 1:  # Mitsuba 3 has no Phong: a microfacet lobe of the same width
            bsdf = {"type": "roughconductor", "material": "none", "alpha": (2 / (material.Ns + 2)) ** 0.5}
        if material.Ns > 1e6:
            bsdf = {"type": "conductor", "material": "none"}
        shape = self.mi.Mesh(f"part{i}", len(vertices), len(ids), has_vertex_normals=True, props=self.properties(bsdf))
        parameters = self.mi.traverse(shape)
        parameters["vertex_positions"] = vertices.astype(np.float32).ravel()
        parameters["vertex_normals"] = normals.astype(np.float32).ravel()
        parameters["faces"] = np.arange(len(vertices), dtype=np.uint32)
        parameters.update()
        return shape

    def properties(self, bsdf: dict):
        """A mesh takes its BSDF when it is made."""
        properties = self.mi.Properties()
        properties["mesh_bsdf"] = self.mi.load_dict(bsdf)
        return properties

    def render(self, spp: int = 1, seed: int = 0) -> np.ndarray:
        """(h, w, 3)."""
        image = self.mi.render(self.scene, spp=spp, seed=seed)
        return np.array(image)


def per_sample() -> str:
    """ms per sample and pixel, 512², three spheres under studio, BRDF sampling."""
    scene = tt.load_scene_data("specular_spheres", environment="studio")
    renderer = tt.A2Renderer(scene, SIZE, SIZE, sampler="independent").use("brdf")
    sobol = tt.A2Renderer(scene, SIZE, SIZE).use("brdf")
    scalar = {"Mitsuba scalar_rgb": (MitsubaDirect("studio", "scalar_rgb", SIZE), 4)}
    calls = {name: lambda p=p, n=n: p.render(n) for name, (p, n) in scalar.items()}
    report = []

    def ours(which):
        which.render(SPP_PER_CALL)
        ti.sync()

    candidates = calls | {
        "taichi_tracer, independent": lambda: ours(renderer),
        "taichi_tracer, sobol": lambda: ours(sobol),
    }
    medians = interleaved(candidates, 5)
    medians = {name: s / (4 if "scalar" in name else SPP_PER_CALL) for name, s in medians.items()}
    report.append(
        ratio_table(f"direct illumination, {SIZE}², BRDF sampling", medians, "Mitsuba scalar_rgb", "ms per sample")
    )
    llvm = MitsubaDirect("studio", "llvm_ad_rgb", SIZE)
    medians = interleaved(
        {
            "Mitsuba llvm_ad_rgb": lambda: llvm.render(SPP_PER_CALL),
            "taichi_tracer, independent": lambda: ours(renderer),
            "taichi_tracer, sobol": lambda: ours(sobol),
        },
        5,
    )
    medians = {name: s / SPP_PER_CALL for name, s in medians.items()}
    report.append(
        ratio_table(f"the same, {SPP_PER_CALL} samples per call", medians, "Mitsuba llvm_ad_rgb", "ms per sample")
    )
    return "".join(report)


if __name__ == "__main__":
    tt.init(arch="auto")
    print(describe_machine() + per_sample())
