"""What surfaces cost: microfacets beside Mitsuba 3, and pictures on surfaces beside the same surfaces without them.

python -m benchmarks.surfaces [microfacets | textures ...]
"""

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import taichi as ti

import taichi_tracer as tt
from benchmarks.direct import SIZE, SPP_PER_CALL, THEIR_ESTIMATORS
from benchmarks.measure import describe_machine, interleaved, ratio_table
from benchmarks.meshes import displaced_sphere
from benchmarks.mitsuba_scenes import MitsubaPicture
from benchmarks.samplers import their_sky
from taichi_tracer.files import read
from taichi_tracer.geometry import Mesh
from taichi_tracer.scene_data_loader import find_scene

ALPHA, F0 = 0.3, 0.9
TRIANGLES = 82_000
TEXTURE = 1024  # texels, side of a picture
VIEW = {"eye": (0.0, 0.5, 2.8), "at": (0.0, 0.0, 0.0), "up": (0.0, 1.0, 0.0), "fov": 60.0}


def per_sample(scene: tt.SceneData, estimator: str) -> Callable[[], object]:
    """A call that renders 16 samples of every pixel."""
    renderer = tt.A2Renderer(scene, SIZE, SIZE).use(estimator)
    return lambda: (renderer.render(SPP_PER_CALL), ti.sync())


def table(title: str, calls: dict[str, Callable[[], object]], base: str) -> str:
    """The milliseconds of one sample of every pixel."""
    medians = {name: seconds / SPP_PER_CALL for name, seconds in interleaved(calls).items()}
    return ratio_table(title, medians, base, "ms per sample")


def microfacets() -> str:
    """Three spheres of one rough metal under the studio, and Mitsuba's ``roughconductor``."""
    report, mesh = "", read(find_scene("specular_spheres"))
    mesh = replace(mesh, materials=[tt.Material(alpha=ALPHA, F0=F0) for _ in mesh.materials])
    theirs = {"type": "roughconductor", "material": "none", "alpha": ALPHA, "distribution": "ggx"}
    theirs["specular_reflectance"] = {"type": "rgb", "value": [F0] * 3}
    for estimator, how in THEIR_ESTIMATORS.items():
        peer = MitsubaPicture(mesh, how, SIZE, SIZE, environment=their_sky(), described=theirs)
        ours = per_sample(tt.SceneData(mesh, environment="studio"), estimator)
        calls = {"Mitsuba llvm": lambda peer=peer: peer.render(SPP_PER_CALL), "taichi_tracer": ours}
        report += table(f"three spheres with GGX, α = {ALPHA}, {SIZE}², {estimator}", calls, "Mitsuba llvm")
    return report


def textures() -> str:
    """A displaced sphere with one colour, with colours of vertices, with a picture, and with both."""
    vertices, faces = displaced_sphere(TRIANGLES)
    d = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    uv = np.stack([np.arctan2(d[:, 2], d[:, 0]) / (2 * np.pi) + 0.5, np.arccos(d[:, 1]) / np.pi], axis=-1)
    picture = tt.Texture(np.random.default_rng(1).random((TEXTURE, TEXTURE, 3), np.float32))
    plain = Mesh(vertices, faces, materials=[tt.Material()])
    colored = {"corner_color": (d[faces] + 1) / 2}
    textured = {"corner_uv": uv[faces], "materials": [tt.Material(map_Kd=picture)]}
    meshes = {
        "one colour": plain,
        "colours of vertices": replace(plain, **colored),
        f"a picture of {TEXTURE}²": replace(plain, **textured),
        "both": replace(plain, **colored, **textured),
    }
    calls = {
        name: per_sample(tt.SceneData(mesh, environment="studio", view=VIEW), "mis") for name, mesh in meshes.items()
    }
    return table(f"displaced sphere of {TRIANGLES:,} triangles, {SIZE}², mis", calls, "one colour")


PARTS = {"microfacets": microfacets, "textures": textures}


def main(names: list[str]) -> None:
    """Print the tables of these names, or all."""
    tt.init("cpu")
    print(describe_machine())
    for name in names or PARTS:
        print(PARTS[name]())


if __name__ == "__main__":
    main(sys.argv[1:])
