"""``taichi-tracer info``: what a scene is made of."""

from argparse import Namespace

from taichi_tracer.apps.choices import load_scene
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
        "vertices": f"{len(geometry.arrays[0]):,}",
        "vertex normals": "yes" if geometry.has_normals else "no",
        "bounds": f"{show(geometry.low)} to {show(geometry.high)}",
    }
    facts |= {f"view {name}": show(value) for name, value in scene.view.items()}
    facts |= {"intersector": scene.ray_intersector.name, "triangle test": scene.ray_intersector.triangle_test}
    if hasattr(scene.ray_intersector, "facts"):
        facts |= scene.ray_intersector.facts()
    lines = [f"{name:<16}{value}" for name, value in facts.items()]
    lines += ["", f"materials ({len(scene.materials)})", *material_table(scene)]
    if hasattr(scene, "effects"):
        lines += ["", "effects", *(f"  {line}" for line in scene.effects.receipt())]
    return lines


def material_table(scene: SceneData) -> list[str]:
    """One line per material id: reflectance Kd, Phong exponent Ns, emitted radiance Ke."""
    rows = [("id", "name", "Kd", "Ns", "Ke")]
    for i, m in enumerate(scene.materials):
        emits = any(component > 0 for component in m.Ke)
        rows.append((str(i), m.name, show(m.Kd), f"{m.Ns:g}", show(m.Ke) if emits else "-"))
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["".join(f"  {cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def show(value) -> str:
    """A number, or a vector as "(x, y, z)"."""
    try:
        return "(" + ", ".join(f"{component:.4g}" for component in value) + ")"
    except TypeError:
        return f"{value:.4g}"
