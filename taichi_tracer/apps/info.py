"""``taichi-tracer info``: what a scene is made of."""

import time
from argparse import Namespace

import taichi as ti

from taichi_tracer.apps.choices import load_scene
from taichi_tracer.renderer import A1Renderer, A2Renderer
from taichi_tracer.scene_data import SceneData


def run(args: Namespace) -> int:
    """Print the facts of a scene."""
    for line in describe(load_scene(args)):
        print(line)
    return 0


def describe(scene: SceneData) -> list[str]:
    """The lines that ``info`` prints."""
    geometry = scene.geometry
    facts = {
        "source": scene.source,
        "triangles": f"{scene.num_triangles:,}",
        "dropped": f"{scene.dropped:,}",
        "spheres": f"{scene.num_spheres:,}",
        "vertices": f"{len(scene.mesh.vertices):,}",
        "vertex normals": "yes" if scene.mesh.has_vertex_normals else "no",
        "bounds": f"{show(geometry.low)} to {show(geometry.high)}",
    }
    facts |= {f"view {name}": show(value) for name, value in scene.view.items()}
    facts |= {"intersector": scene.ray_intersector.name, "triangle test": scene.ray_intersector.triangle_test}
    facts |= scene.ray_intersector.facts()
    lines = [f"{name:<16}{value}" for name, value in facts.items()]
    lines += ["", f"materials ({len(scene.materials)})", *material_table(scene)]
    lines += ["", "effects", *(f"  {line}" for line in A1Renderer(scene, 8, 8).receipt())]
    if scene.effects.is_lit:
        lines += [f"  {line}" for line in cost_of_light(scene)]
    return lines


def cost_of_light(scene: SceneData, estimator: str = "brdf", size: int = 64) -> list[str]:
    """What compiling the scene's effects takes, and how many rays a sample needs: measured on a small picture."""
    renderer = A2Renderer(scene, size, size).use(estimator)
    renderer.eye_rays.use_packets = False
    seconds = []
    for _ in range(2):
        start = time.perf_counter()
        renderer.render()
        ti.sync()
        seconds.append(time.perf_counter() - start)
    hits = float(A1Renderer(scene, size, size).use("hit").image().any(axis=2).mean())
    return [
        f"compile time    {seconds[0] - seconds[1]:.2f} s ({estimator})",
        f"rays per sample 1 eye ray, and up to {hits:.2f} shadow rays ({2 * hits:.2f} with MIS), one for each hit",
    ]


def material_table(scene: SceneData) -> list[str]:
    """One line per material id: reflectance Kd, Phong exponent Ns, emitted radiance Ke."""
    rows = [("id", "name", "Kd", "Ns", "Ke")]
    for i, m in enumerate(scene.materials):
        emits = any(component > 0 for component in m.Ke)
        rows.append((str(i), m.name, show(m.Kd), f"{m.Ns:g}", show(m.Ke) if emits else "-"))
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["".join(f"  {cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def show(value) -> str:
    """A number, a word, or a vector as "(x, y, z)"."""
    if isinstance(value, str):
        return value
    try:
        return "(" + ", ".join(f"{component:.4g}" for component in value) + ")"
    except TypeError:
        return f"{value:.4g}"
