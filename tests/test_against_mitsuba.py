"""The same picture as Mitsuba 3, which shares no line with this package; skipped where it is not installed."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from support import start

import taichi_tracer as tt
from taichi_tracer.files import read
from taichi_tracer.materials import Material
from taichi_tracer.scene_data import SceneData
from taichi_tracer.scene_data_loader import COURSE_VIEW, find_scene

mitsuba = pytest.importorskip("mitsuba")

SIZE, BLOCK, SPP, RENDERS, ROWS = 48, 8, 64, 8, 128
SAME = 2e-4  # of the radiance: what may differ by the texels
SIGNIFICANCE = 1e-3  # of the largest z among all blocks and channels (Šidák)


def smooth_sky(u, v):
    """(h, w, 3) radiance at fractions of the width and of the height from the top; its contrast is 50."""
    v, u = np.meshgrid(v, u, indexing="ij")
    phi, theta = 2 * np.pi * u, np.pi * v
    waves = np.sin(theta) * np.cos(phi - 1.0), np.cos(theta), np.sin(theta) * np.sin(phi)
    return np.exp(np.stack([2 * waves[0] + waves[1], 1.5 * waves[0] - waves[2], waves[1] + waves[2]], axis=-1))


def diffuse_spheres():
    mesh, colours = read(find_scene("specular_spheres")), ((0.8, 0.3, 0.2), (0.2, 0.7, 0.3), (0.6, 0.6, 0.9))
    return replace(mesh, materials=[Material(Ns=1.0, Kd=colour) for colour in colours])


def theirs(mesh, sky):
    """(RENDERS, SIZE, SIZE, 3)."""
    mitsuba.set_variant("scalar_rgb")
    transform = mitsuba.ScalarTransform4f
    scene = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1},
        "sensor": {
            "type": "perspective",
            "fov": COURSE_VIEW["fov"],
            "fov_axis": "y",
            "to_world": transform().look_at(*(COURSE_VIEW[k] for k in ("eye", "at", "up"))),
            "film": {
                "type": "hdrfilm",
                "width": SIZE,
                "height": SIZE,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
            },
            "sampler": {"type": "independent"},
        },
        # their map begins a quarter of a turn from ours
        "light": {
            "type": "envmap",
            "bitmap": mitsuba.Bitmap(sky.astype(np.float32)),
            "to_world": transform().rotate([0, 1, 0], 90),
        },
    }
    for i, material in enumerate(mesh.materials):
        ids = mesh.faces[mesh.face_materials == i]
        normals = mesh.normals[mesh.face_normals[mesh.face_materials == i].ravel()]
        properties = mitsuba.Properties()
        properties["mesh_bsdf"] = mitsuba.load_dict(
            {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(material.Kd)}}
        )
        part = mitsuba.Mesh(f"part{i}", 3 * len(ids), len(ids), has_vertex_normals=True, props=properties)
        parameters = mitsuba.traverse(part)
        parameters["vertex_positions"] = mesh.vertices[ids.ravel()].astype(np.float32).ravel()
        parameters["vertex_normals"] = normals.astype(np.float32).ravel()
        parameters["faces"] = np.arange(3 * len(ids), dtype=np.uint32)
        parameters.update()
        scene[f"part{i}"] = part
    loaded = mitsuba.load_dict(scene)
    return np.stack([np.array(mitsuba.render(loaded, spp=SPP, seed=seed))[..., :3] for seed in range(RENDERS)])


def blocks(pictures):
    n = SIZE // BLOCK
    return pictures.reshape(len(pictures), n, BLOCK, n, BLOCK, 3).mean(axis=(2, 4))


@pytest.mark.long
def test_diffuse_spheres_under_a_sky():
    start("f32")
    mesh = diffuse_spheres()
    u = (np.arange(2 * ROWS) + 0.5) / (2 * ROWS)
    sky = smooth_sky(u, (np.arange(ROWS) + 0.5) / ROWS)
    their_sky = smooth_sky(u, np.arange(ROWS) / (ROWS - 1))  # their first and last rows are the poles themselves
    environment = tt.Environment(sky, lookup="bilinear")
    scene = SceneData(mesh, view=COURSE_VIEW, environment=environment)
    renderer = tt.A2Renderer(scene, SIZE, SIZE, sampler="independent").use("mis")
    renderer.camera.set_camera_parameters(handedness="right")
    ours = []
    for seed in range(RENDERS):
        renderer.seed = seed
        renderer.begin_anew()
        ours.append(renderer.render(SPP).image())
    a, b = blocks(np.stack(ours).astype(np.float64)), blocks(theirs(mesh, their_sky).astype(np.float64))
    spread = np.sqrt((a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / RENDERS) + SAME * b.mean(axis=0)
    t = np.abs(a.mean(axis=0) - b.mean(axis=0)) / spread
    p = 2 * stats.t.sf(t, 2 * (RENDERS - 1))
    assert p.min() > 1 - (1 - SIGNIFICANCE) ** (1 / p.size), f"largest t {t.max():.1f} in block {np.argmax(t)}"
