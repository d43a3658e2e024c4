"""What a scene is made of, and which code a picture of it runs."""

from argparse import Namespace
from dataclasses import replace

import numpy as np

from taichi_tracer.apps.console import Parser
from taichi_tracer.apps.pictures import WHOLE, request_of
from taichi_tracer.materials import BUILT_IN
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.scene_data import SceneData
from taichi_tracer.settings import OF_PICTURE, OF_SCENE, RenderSettings, add_scene
from taichi_tracer.system.errors import digits, digits_of
from taichi_tracer.system.parts import PARTS

RECEIPT_SIZE = 8, 8  # pixels: the receipt is the same for every size


def add_arguments(parser: Parser) -> None:
    """Add what ``info`` takes."""
    add_scene(parser, *OF_SCENE, *OF_PICTURE)


def run(args: Namespace) -> int:
    """Print the facts of a scene, and the receipt of the first picture that is asked for."""
    settings = replace(RenderSettings.of(args), size=RECEIPT_SIZE, quick=False, crop=WHOLE)
    request = request_of(settings)
    renderer = request.pictures[0].make_renderer(request.load())
    print("\n".join([*describe(renderer), *own_parts(settings.parts)]))
    return 0


def describe(renderer: ProgressiveRenderer) -> list[str]:
    """What ``info`` prints of a scene: that of a renderer."""
    scene = renderer.scene_data
    facts = {
        "source": scene.source,
        "triangles": f"{scene.num_triangles:,}",
        "dropped": f"{scene.dropped:,}",
        "spheres": f"{scene.num_spheres:,}",
        "vertices": f"{len(scene.mesh.vertices):,}",
        "vertex normals": "yes" if scene.mesh.has_vertex_normals else "no",
        "bounds": f"{show(scene.geometry.low)} to {show(scene.geometry.high)}",
        "up axis": scene.up_axis,
        **{f"view {name}": show(value) for name, value in scene.view.items()},
        "intersector": scene.ray_intersector.name,
        "triangle test": scene.ray_intersector.triangle_test,
        **scene.ray_intersector.facts(),
    }
    lines = [f"{name:<16}{value}" for name, value in facts.items()]
    lines += ["", f"materials ({len(scene.materials)})", *material_table(scene)]
    lines += ["", "effects", *(f"  {line}" for line in renderer.receipt())]
    return lines


def own_parts(files: tuple[str, ...]) -> list[str]:
    """A line for each part that was registered by a file of ``--parts``."""
    lines = []
    for file in files:
        lines += ["", f"parts of {file}"]
        lines += [f"  {getattr(part, 'what', part.kind):<14}{part.name}" for part in PARTS.registered_by(file)]
    return lines


def material_table(scene: SceneData) -> list[str]:
    """One line per material id: Kd, Ns, Ke; the roughness and F0 of microfacets; parameters of your own BRDFs."""
    library = scene.material_library
    given = {name for m in scene.materials for name in m.extra}
    own = [name for name in library.members if name not in BUILT_IN and name.lower() in given]
    rough = ["alpha_x", "alpha_y", "F0"] if any(m.is_rough for m in scene.materials) else []
    rows = [("id", "name", "Kd", "Ns", "Ke", *rough, *own)]
    for i, m in enumerate(scene.materials):
        emits = any(component > 0 for component in m.Ke)
        more = [show(getattr(m, name)) if m.is_rough else "-" for name in rough]
        more += [show(m.value(name, library.members[name])) for name in own]
        rows.append((str(i), m.name, show(m.Kd), f"{m.Ns:g}", show(m.Ke) if emits else "-", *more))
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["".join(f"  {cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def show(value) -> str:
    """A number, a word, or a vector as "(x, y, z)"."""
    if isinstance(value, str):
        return value
    return digits_of(value, ".4g") if np.ndim(value) > 0 else digits(value, ".4g")
