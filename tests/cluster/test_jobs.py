"""What is sent to a worker: the options and the contents of files, and no path of the sender."""

import pickle

import numpy as np
from support import start

import taichi_tracer as tt
from taichi_tracer.cluster import settings_from, worker
from taichi_tracer.cluster.worker import pack
from taichi_tracer.files.disk import noting_reads

OBJ = "mtllib ../materials/m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n"


def test_a_worker_renders_the_samples_of_the_sender_without_its_files(tmp_path):
    start("f32")
    mesh, material, sky = (tmp_path / "secret" / name for name in ("meshes/one.obj", "materials/m.mtl", "sky.npy"))
    for path, text in ((mesh, OBJ), (material, "newmtl a\nKd 1 0 0\n")):
        path.parent.mkdir(parents=True)
        path.write_text(text)
    np.save(sky, np.ones((2, 4, 3), np.float32))
    place = {"eye": (0.3, 0.3, 2), "at": (0.3, 0.3, 0)}
    settings = settings_from(mesh, {"environment": sky, "estimator": "mis", "size": (8, 4), "arch": "cpu", **place})
    with noting_reads() as paths:
        scene = tt.load_scene_data(mesh, environment=sky)
    sent = pickle.dumps(pack(settings, paths))
    assert b"secret" not in sent
    assert str(tmp_path).encode() not in sent
    job = pickle.loads(sent)
    assert set(job.files) == {"environment/sky.npy", "scene/meshes/one.obj", "scene/materials/m.mtl"}
    mesh.unlink()
    parts = [worker.samples_of(job, str(tmp_path), first, 2)["arrays"]["total"] for first in (0, 2)]
    alone = tt.A2Renderer(scene, 8, 4, camera=worker.kept["renderer"].camera).use("mis").render(4)
    np.testing.assert_allclose(sum(parts).sum(axis=2), alone.film.total.to_numpy().sum(axis=2), rtol=1e-12)
