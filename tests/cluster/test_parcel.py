"""What travels: the options and the contents of files; no path of the sender, and no way out of the folder."""

import json

import numpy as np
import pytest

import taichi_tracer as tt
from taichi_tracer.cluster import namespace, parcel, words_of
from taichi_tracer.cluster.parcel import check_place, hash_of, name_of_files, pack, unpack, without
from taichi_tracer.environment import load_environment
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


def test_a_large_file_travels_in_pieces_and_equal_ones_once(secret, monkeypatch, tmp_path):
    monkeypatch.setattr(parcel, "CHUNK", 40)
    (secret / "sky.npy").write_bytes(bytes(200))
    made = packed(secret)
    assert len(dict(made.files)["environment/sky.npy"]) == 5
    assert len(made.hashes) < sum(len(pieces) for _, pieces in made.files)
    args = unpack(made.message(), pieces_of(made), tmp_path / "there")
    assert (tmp_path / "there/environment/sky.npy").read_bytes() == bytes(200)
    assert read_obj(args.scene).faces.shape == (1, 3)


def test_a_shipped_scene_keeps_its_name_by_whatever_way_it_was_given():
    args = namespace("cube", {"environment": "studio"})
    made = pack(args, [])
    assert made.files == ()
    assert (json.loads(made.options)["scene"], json.loads(made.options)["environment"]) == ("cube", "studio")
    path = tt.load_scene_data.__globals__["find_scene"]("cornell_box")
    assert json.loads(pack(namespace(path, {}), [path]).options)["scene"] == "cornell_box"


def test_a_shipped_environment_does_not_travel_and_no_folder_of_the_sender_is_named(secret):
    scene = secret / "scene" / "meshes" / "one.obj"
    args = namespace(scene, {"environment": "studio", "estimator": "mis"})
    with noting_reads() as paths:
        read_obj(scene)
        load_environment("studio")
    assert len(paths) == 3
    assert [place for place, _ in pack(args, paths).files] == ["scene/meshes/one.obj", "scene/materials/m.mtl"]


def test_a_file_that_changes_on_the_way_is_told(secret):
    made = packed(secret)
    (secret / "sky.npy").write_bytes(b"other")
    with pytest.raises(tt.InputError, match="has changed since the rendering began"):
        pieces_of(made)


def test_another_content_than_was_promised_is_refused(secret, tmp_path):
    made = packed(secret)
    pieces = dict.fromkeys(made.hashes, b"evil")
    with pytest.raises(tt.InputError, match="what came is not what was sent"):
        unpack(made.message(), pieces, tmp_path / "there")


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


def test_pictures_that_differ_only_in_the_camera_share_files_and_scene(secret):
    one, other = packed(secret, eye=(1, 0, 0)), packed(secret, eye=(0, 1, 0))
    assert one.id != other.id
    assert name_of_files(one.message()) == name_of_files(other.message())
    assert without(one.message(), parcel.PICTURE) == without(other.message(), parcel.PICTURE)
    assert packed(secret, smooth=30).options != one.options
    scenes = [without(p.message(), parcel.PICTURE) for p in (one, packed(secret, smooth=30))]
    assert scenes[0] != scenes[1]


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--spp", 4, ["--spp", "4"]),
        ("--plain", True, ["--plain"]),
        ("--plain", False, []),
        ("--size", (64, 32), ["--size", "64x32"]),
        ("--size", "64", ["--size", "64"]),
        ("--eye", (1.5, 0, -2), ["--eye", "1.5", "0", "-2"]),
        ("--brdfs", ["phong", "diffuse"], ["--brdfs", "phong,diffuse"]),
        ("--parts", ["a.py", "b.py"], ["--parts", "a.py", "--parts", "b.py"]),
        ("--environment", None, []),
    ],
)
def test_options_of_python_are_words_of_the_command_line(option, value, words):
    assert words_of(option, value) == words
