"""What travels: the options and the contents of files; no path of the sender, and no way out of the folder."""

import json

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.cluster import namespace
from taichi_tracer.cluster.parcel import check_place, hash_of, pack, unpack
from taichi_tracer.files.disk import noting_reads
from taichi_tracer.files.obj import read_obj

OBJ = "mtllib ../materials/m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n"


@pytest.fixture
def secret(tmp_path):
    """A scene of two files in a folder whose name nobody should see, and an environment elsewhere."""
    scene = tmp_path / "secret" / "scene"
    (scene / "meshes").mkdir(parents=True)
    (scene / "materials").mkdir()
    (scene / "meshes" / "one.obj").write_text(OBJ)
    (scene / "materials" / "m.mtl").write_text("newmtl a\nKd 1 0 0\n")
    np.save(tmp_path / "secret" / "sky.npy", np.ones((2, 4, 3), np.float32))
    return tmp_path / "secret"


def packed(secret, **options):
    args = namespace(
        secret / "scene/meshes/one.obj", {"environment": secret / "sky.npy", "estimator": "mis", **options}
    )
    with noting_reads() as paths:
        read_obj(secret / "scene/meshes/one.obj")
    return pack(args, paths)


def pieces_of(made):
    return {one: made.content(one) for one in made.hashes}


def test_files_travel_by_their_contents_and_come_out_in_their_places(secret, tmp_path):
    made = packed(secret, size=(64, 32), eye=(1, 2, -3))
    message = json.loads(json.dumps(made.message()))
    assert "secret" not in json.dumps(message)
    assert str(tmp_path) not in json.dumps(message)
    assert [place for place, _ in message["files"]] == [
        "environment/sky.npy",
        "scene/meshes/one.obj",
        "scene/materials/m.mtl",
    ]
    args = unpack(message, pieces_of(made), tmp_path / "there")
    mesh = read_obj(args.scene)
    assert args.scene == str(tmp_path / "there/scene/meshes/one.obj")
    assert mesh.materials[mesh.face_materials[0]].Kd == (1, 0, 0)
    assert np.load(args.environment).shape == (2, 4, 3)
    assert (args.size, args.eye, args.view) == ((64, 32), (1, 2, -3), "mis")
    assert args.spp is None


@pytest.mark.parametrize(
    "place", ["../x", "/etc/passwd", "scene/../../x", "a\\..\\b", "C:/x", "", ".", "scene//x", "scene/./x", "a\0b"]
)
def test_no_place_leads_out_of_the_folder(place, tmp_path):
    with pytest.raises(tt.InputError, match="does not lie within the worker's folder"):
        check_place(place)
    message = {"files": [[place, [hash_of(b"")]]], "options": "{}"}
    with pytest.raises(tt.InputError):
        unpack(message, {hash_of(b""): b""}, tmp_path / "there")
    assert not (tmp_path / "x").exists()
