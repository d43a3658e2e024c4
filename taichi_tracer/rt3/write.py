"""Writing of RT3 documents. Numbers keep all their digits, so that a document gives the same picture again."""

import os
import re
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from taichi_tracer.brdfs.microfacet import LAYERED
from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import meshes_within
from taichi_tracer.lights.base import Light
from taichi_tracer.lights.delta_lights import AmbientLight, DirectionalLight, PointLight, SpotLight
from taichi_tracer.materials import Material
from taichi_tracer.meshes.parts import with_common_materials
from taichi_tracer.rt3.document import AGGREGATORS, INTEGRATORS, Document, FilmSettings, IntegratorSettings
from taichi_tracer.system.errors import InputError

NOT_IN_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def as_rt3(document: Document, path: Path) -> str:
    """The text of a document that will be written to ``path``. Names of other files are relative to its folder."""
    world = []
    if document.intersector is not None:
        kinds = {name: kind for kind, name in AGGREGATORS.items()}
        world.append(tag("aggregator", type=kinds[document.intersector]))
    world += ["", "<world_begin/>", *_background(document, path)]
    world += [*map(_light, document.lights), *_world(document.mesh), "<world_end/>"]
    lines = ["<RT3>"]
    for shot in document.shots:
        lines += [*_view(shot.view), _film(shot.film), _integrator(shot.integrator), *world, ""]
        world = ["<render_again/>"]
    return "\n".join([*lines, "</RT3>", ""])


def tag(name: str, /, **attributes) -> str:
    """An empty element. Numbers and lists of numbers have all their digits; attributes that are None are left out."""
    text = "".join(f" {key}={quoteattr(_text(value))}" for key, value in attributes.items() if value is not None)
    return f"<{name}{text}/>"


def _text(value) -> str:
    if isinstance(value, str):
        return NOT_IN_XML.sub("?", value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    return " ".join(repr(number) for number in np.asarray(value).reshape(-1).tolist())


def _view(view: dict) -> list[str]:
    window = view.get("screen_window")
    camera = {
        "type": view.get("projection", "perspective"),
        "fovy": view.get("fov"),
        "screen_window": None if isinstance(window, str) else window,
        "frame_aspect": view.get("frame_aspect"),
        "focal_distance": view.get("focal_distance"),
        "handedness": view.get("handedness"),
    }
    eye, at, up = (np.asarray(view[name], np.float64) for name in ("eye", "at", "up"))
    return [tag("lookat", look_from=eye, look_at=at, up=up), tag("camera", **camera)]


def _film(film: FilmSettings) -> str:
    kind = None if film.filename is None else Path(film.filename).suffix.lower()[1:]
    return tag(
        "film",
        type="image",
        x_res=film.width,
        y_res=film.height,
        crop_window=film.crop_window if film.crop_window != (0, 1, 0, 1) else None,
        filename=film.filename,
        img_type=kind,
        gamma_corrected=film.gamma_corrected,
    )


def _integrator(integrator: IntegratorSettings) -> str:
    if integrator.name not in INTEGRATORS:
        return tag("integrator", type="direct", estimator=integrator.name, spp=integrator.spp)
    values = {"depth" if name == "mirrors" else name: value for name, value in integrator.values.items()}
    return tag("integrator", type=integrator.name, **values)


def _background(document: Document, path: Path) -> Iterator[str]:
    background = document.background
    if isinstance(background, Path):
        yield tag("background", type="image", filename=_beside(background, path))
    elif background is not None and len(background) == 3:
        yield tag("background", type="colors", color=background)
    elif background is not None:
        yield tag("background", type="4_colors", **dict(zip(("bl", "tl", "tr", "br"), background, strict=True)))
    if document.environment is not None:
        where = _beside(document.environment, path)
        yield tag("background", type="spherical", filename=where, **document.environment_options)


def _light(light: Light) -> str:
    if isinstance(light, AmbientLight):
        return tag("light_source", type="ambient", L=light.intensity)
    if isinstance(light, DirectionalLight):
        return tag("light_source", type="directional", L=light.irradiance, **{"from": (0, 0, 0)}, to=light.direction)
    if not isinstance(light, (PointLight, SpotLight)):
        raise InputError(f"RT3 has no light {light.name!r}")
    place = {"I": light.intensity, "from": light.position, "attenuation": light.attenuation}
    if isinstance(light, SpotLight):
        place |= {"to": light.target, "cutoff": float(light.cutoff), "falloff": float(light.falloff)}
    return tag("light_source", type=light.name, **place)


def _beside(file: Path, document: Path) -> str:
    return Path(os.path.relpath(file.resolve(), document.resolve().parent)).as_posix()


def _world(mesh: Mesh) -> Iterator[str]:
    """Named materials, then the instances, and then the objects of the world and its places of instances."""
    within = meshes_within(mesh)
    meshes, materials = with_common_materials(within)
    names = _names(materials)
    for material, name in zip(materials, names, strict=True):
        yield _material(material, name)
    called = {id(one): f"instance {number}" for number, one in enumerate(within)}
    for own, one in zip(within, meshes, strict=True):
        if own is not mesh:
            yield tag("object_instance_begin", name=called[id(own)])
        yield from _objects(one, names)
        for instances in one.instances:
            for matrix in instances.transforms:
                yield from _call(called[id(instances.mesh)], matrix)
        if own is not mesh:
            yield tag("object_instance_end")


def _call(name: str, matrix: np.ndarray) -> Iterator[str]:
    call = tag("object_instance_call", name=name)
    if (matrix == np.eye(4)).all():
        yield call
    else:
        yield from (tag("push_CTM"), tag("matrix", value=matrix[:3]), call, tag("pop_CTM"))


def _objects(mesh: Mesh, names: list[str]) -> Iterator[str]:
    """Objects in the order of their ids; neighbours with equal properties form one mesh."""
    if mesh.num_primitives == 0:
        return
    count = len(mesh.faces)
    culls = np.zeros(count, bool) if mesh.face_culls is None else mesh.face_culls
    has_normals = (mesh.face_normals >= 0).any(axis=1) if len(mesh.face_normals) else np.zeros(count, bool)
    primitives = mesh.primitives()
    of_triangles = np.stack([np.zeros(count), mesh.face_materials, culls, has_normals], axis=1)
    of_spheres = -1 - np.arange(len(mesh.spheres))[:, None] * np.ones((1, 4))  # each sphere is an object of its own
    kind = np.concatenate([of_triangles, of_spheres])[np.where(primitives >= 0, primitives, count - 1 - primitives)]
    starts = np.flatnonzero(np.append(True, (kind[1:] != kind[:-1]).any(axis=1)))
    for begin, end in zip(starts, [*starts[1:], len(kind)], strict=True):
        first = primitives[begin]
        if first < 0:
            sphere, material = mesh.spheres[-1 - first], names[mesh.sphere_materials[-1 - first]]
            if np.isfinite(sphere).all():
                yield tag("object", type="sphere", material=material, center=sphere[:3], radius=sphere[3])
        else:
            part = slice(first, first + end - begin)
            material = names[mesh.face_materials[first]]
            yield _triangles(mesh, part, material, bool(culls[first]), bool(has_normals[first]))


def _triangles(mesh: Mesh, part: slice, material: str, culls: bool, has_normals: bool) -> str:
    vertices, indices = _used(mesh.vertices, mesh.faces[part])
    if not np.isfinite(vertices).all():
        raise InputError(f"{mesh.source}: a vertex is not finite, which an RT3 document cannot express")
    lists = {"vertices": vertices, "indices": indices}
    if has_normals:
        lists["normals"], lists["normal_indices"] = _used(mesh.normals, mesh.face_normals[part])
    return tag("object", type="trianglemesh", material=material, backface_cull=culls or None, **lists)


def _used(rows: np.ndarray, ids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rows that occur in ``ids``, in float64, and the ids in these rows; −1 stays −1."""
    used, inverse = np.unique(ids, return_inverse=True)
    absent = int(used[0] < 0)
    return rows[used[absent:]].astype(np.float64), inverse.reshape(ids.shape) - absent


def _names(materials: list[Material]) -> list[str]:
    """One name for each material; a number is added to a name that occurs twice."""
    names: list[str] = []
    for i, material in enumerate(materials):
        name = NOT_IN_XML.sub("?", material.name).strip() or f"material {i}"
        names.append(f"{name} {i}" if name in names else name)
    return names


def _material(material: Material, name: str) -> str:
    """A named material with its values under their MTL names; default values are left out."""
    unset = Material()
    values = {f.name: getattr(material, f.name) for f in fields(Material) if f.name not in ("name", "extra")}
    layered = 1 if material.value(LAYERED, 0.0) == 1 else None
    kept = {key: value for key, value in values.items() if key == "Kd" or value != getattr(unset, key)}
    return tag("make_named_material", type="matte", name=name, **kept, layered=layered)
