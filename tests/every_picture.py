"""All pictures and answers of the package on small scenes: run it with the start of Taichi, and with a file for them.

    python every_picture.py vulkan found.npz 0          (also: cpu, cuda, metal; 0, 1 or 2: which third of them)
    python every_picture.py cpu found.npz 0 debug       (Taichi's debug mode: bounds and overflows are told)

What fails is told, and the exit code is 1.
"""

import os
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import taichi as ti
from shapes import SQUARE

HERE = Path(__file__).parent
SIZE = 32, 24
SPP = 4
# Which thirds of the pictures tests make: all, or the one that the commit chooses, in hexadecimal digits.
THIRDS = range(3)
if os.environ.get("TAICHI_TRACER_LONG") != "all":
    THIRDS = [int(os.environ.get("TAICHI_TRACER_COMMIT", "0"), 16) % 3]


def pictures(tt):
    """(name, a function that returns an array) of each."""
    from taichi_tracer.maps import MapRenderer
    from taichi_tracer.rt3.renderer import RT3Renderer
    from taichi_tracer.system.registry import PARTS

    scenes = {}

    def scene(name, **options):
        key = name, str(options)
        if key not in scenes:
            scenes[key] = tt.load_scene_data(name, **options)
        return scenes[key]

    def picture(kind, view, spp, name, options=None, **scene_options):
        return lambda: kind(scene(name, **scene_options), *SIZE, **(options or {})).use(view).render(spp).image()

    for name in ("cornell_box", "torus_knot", "rt3/three_spheres", "rt3/transforms"):
        for view in tt.A1Renderer.names():
            yield f"{view} of {name}", picture(tt.A1Renderer, view, 1, name)
    for intersector in PARTS.names("intersector"):
        for test in PARTS.names("triangle test"):
            options = {"intersector": intersector, "triangle_test": test}
            yield f"{intersector}, {test}", picture(tt.A1Renderer, "barycentric", 1, "cube", **options)
    some = {"specular_spheres": ("uniform", "brdf", "mis"), "veach_plates": ("environment", "mis_one_sample")}
    for name, estimators in {"cornell_box": tt.A3Renderer.names(), **some}.items():
        for estimator in estimators:
            yield f"{estimator} of {name}", picture(tt.A3Renderer, estimator, SPP, name, environment="studio")
    for name in ("cornell_box", "caustic_sphere"):
        for estimator in tt.A4Renderer.names():
            yield f"{estimator} of {name}", picture(tt.A4Renderer, estimator, SPP, name, environment="white")
    for sampler in PARTS.names("sampler"):
        options = {"sampler": sampler}
        yield f"sampler {sampler}", picture(tt.A2Renderer, "mis", SPP, "specular_spheres", options, environment="sunny")
    for name, options in (("adaptive", {"adaptive": True}), ("crop", {"crop": (3, 20, 5, 20)})):
        yield name, picture(tt.A2Renderer, "mis", 16, "specular_spheres", options, environment="studio")
    for name in ("rt3/two_views", "rt3/four_corners", "rt3/all_lights"):
        for view in RT3Renderer.names():
            yield f"{view} of {name}", picture(RT3Renderer, view, 1, name)
    for view in MapRenderer.names():
        yield f"map {view}", picture(MapRenderer, view, 1, "torus_knot")
    yield "many lamps", picture(tt.A3Renderer, "mis", SPP, "many_lights", {}, environment=None)

    rng = np.random.default_rng(1)
    rays = rng.normal(size=(2, 5000, 3))
    for name in ("cornell_box", "torus_knot", "rt3/three_spheres"):
        yield f"hits of {name}", lambda name=name: scene(name).intersect(*rays).triangle_id
        yield f"distances of {name}", lambda name=name: np.nan_to_num(scene(name).intersect(*rays).distance, posinf=0)
        yield f"occlusion of {name}", lambda name=name: scene(name).occluded(*rays)

    def error():
        light = tt.A2Renderer(scene("specular_spheres", environment="studio"), *SIZE).use("mis").render(16)
        return float(light.error())

    def tone():
        light = tt.A2Renderer(scene("specular_spheres", environment="studio"), *SIZE).use("brdf").render(2)
        light.postprocess()
        return light.canvas_postprocessed.to_numpy()

    def explained():
        light = tt.A2Renderer(scene("specular_spheres", environment="studio"), *SIZE).use("brdf").render(1)
        return len(str(light.explain(10, 10))) > 0

    def of_textures():
        texture = tt.Texture(np.random.default_rng(2).random((7, 5, 3)), ("mirror", "clamp"))
        mesh = tt.Mesh(np.array(SQUARE[0]), np.array(SQUARE[1]), materials=[tt.Material(map_Kd=texture)])
        mesh.corner_uv, mesh.corner_color = 3 * mesh.vertices[mesh.faces][..., :2], abs(mesh.vertices[mesh.faces])
        return tt.A2Renderer(tt.SceneData(mesh, environment="white"), *SIZE).use("mis").render(SPP).image()

    yield "textures", of_textures
    yield "error", error
    yield "canvas", tone
    yield "explanation", explained


def made(folder: Path, arch: str, third: int, *mode: str) -> dict:
    """Every third picture, from a process of its own; it must be silent."""
    file = folder / f"{arch}{third}{''.join(mode)}.npz"
    command = [sys.executable, str(HERE / "every_picture.py"), arch, str(file), str(third), *mode]
    paths = [HERE.parent, HERE, *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, paths))}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900)
    told = [line for line in done.stdout.splitlines() if not line.startswith("[Taichi]")]
    assert (done.returncode, told[:20]) == (0, []), done.stderr[-2000:]
    return dict(np.load(file))


def main(arch: str, file: str, third: str, *mode: str) -> int:
    """Make a third of them, and save them by their names."""
    ti.init(arch=getattr(ti, arch), default_fp=ti.f32, debug="debug" in mode, log_level=ti.ERROR)
    import taichi_tracer as tt

    warnings.simplefilter("ignore")
    found, failed = {}, 0
    for name, make in list(pictures(tt))[int(third) :: 3]:
        start = time.perf_counter()
        try:
            found[name] = np.asarray(make(), np.float64)
        except Exception as problem:  # told, and the others are made
            failed += 1
            print(f"{name}: {type(problem).__name__}: {str(problem).strip()[:600]}", flush=True)
        found[f"seconds of {name}"] = np.array(time.perf_counter() - start)
    np.savez(file, **found)
    return 1 if failed > 0 else 0


if __name__ == "__main__":
    raise SystemExit(main(*sys.argv[1:]))
