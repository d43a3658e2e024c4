"""Parts of meshes: moved, turned inside out, joined; and in several places, against a tree that is walked by hand."""

import numpy as np
import pytest
from shapes import SQUARE, soup, with_spheres

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Instances, group, resolve_instances
from taichi_tracer.materials import Material


def placed_at(x=0.0, y=0.0, z=0.0, linear=None):
    """A (4, 4) matrix."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) if linear is None else linear
    matrix[:3, 3] = x, y, z
    return matrix


def corners_by_hand(mesh, matrix=None):
    """The (3, 3) corners of every triangle of a group and of everything in it, in world space, one by one."""
    matrix = np.eye(4) if matrix is None else matrix
    found = [
        np.array([(matrix @ [*mesh.vertices[vertex], 1.0])[:3] for vertex in face]) for face in np.asarray(mesh.faces)
    ]
    for one in mesh.instances:
        for own in np.asarray(one.transforms):
            found += corners_by_hand(one.mesh, matrix @ own)
    return found


def a_tree(rng, levels=3):
    """A group in groups; each has triangles of its own, stands in two or three places, and is moved in another way."""
    mesh = Mesh(*soup(rng, 3), source="level 0")
    for level in range(1, levels + 1):
        transforms = np.tile(np.eye(4), (2 + level % 2, 1, 1))
        transforms[:, :3] = rng.normal(size=(len(transforms), 3, 4))
        own = Mesh(*soup(rng, 2), source=f"level {level}")
        mesh = group([own, Instances(mesh, transforms)], source=f"level {level}")
    return mesh


@pytest.mark.parametrize("levels", [1, 2, 3])
def test_a_tree_of_groups_is_the_triangles_that_a_walk_finds(levels):
    mesh = a_tree(np.random.default_rng(levels), levels)
    flat = resolve_instances(mesh, choice="copied")
    expected = np.array(corners_by_hand(mesh))
    found = flat.vertices[flat.faces]
    assert flat.placed is None
    assert not flat.instances

    def in_order(corners):  # of triangles, and of the corners of each: a mirrored one is turned round
        rows = np.sort(np.round(corners, 9).view("f8,f8,f8").reshape(len(corners), 3), axis=1).view("f8").reshape(-1, 9)
        return rows[np.lexsort(rows.T)]

    np.testing.assert_allclose(in_order(found), in_order(expected), atol=1e-8)


def in_places(mesh):
    """(n, 3, 3) the corners of all triangles of a mesh without instances, by their ids."""
    if mesh.placed is None:
        return mesh.vertices[mesh.faces]
    found = []
    for own, matrix in zip(mesh.placed.object_of, mesh.placed.matrices, strict=True):
        one = mesh.placed.object(mesh, own)
        found.append(one.vertices[one.faces] @ matrix[:, :3].T + matrix[:, 3])
    return np.concatenate(found)


@pytest.mark.parametrize("lamp_at", [None, 0, 1])
def test_numbers_do_not_depend_on_what_is_shared(lamp_at, rng):
    """Also where copies of lamps stand between objects, and in groups within groups."""

    def turned(count):
        matrices = np.tile(np.eye(4), (count, 1, 1))
        matrices[:, :3] = rng.normal(size=(count, 3, 4))
        matrices[np.linalg.det(matrices[:, :3, :3]) < 0, :3, 0] *= -1
        return matrices

    lamp = Mesh(*SQUARE, materials=[Material("lamp", Ke=(1, 1, 1))], source="lamp")
    twig = Mesh(*soup(rng, 3), source="twig")
    branch = group([Mesh(*soup(rng, 2)), Instances(twig, turned(4))], source="branch")
    parts = [Instances(branch, turned(90)), Instances(twig, turned(3))]
    if lamp_at is not None:
        parts.insert(lamp_at, Instances(lamp, turned(2)))
    shared, copied = (resolve_instances(group(parts), False, choice) for choice in ("shared", "copied"))
    assert (len(copied.faces), len(shared.faces)) == (
        90 * 14 + 9 + (0 if lamp_at is None else 4),
        2 + 3 + 4 * (lamp_at is not None),
    )
    np.testing.assert_allclose(in_places(shared), in_places(copied), atol=1e-12)


def test_a_sphere_is_moved_and_scaled():
    ball = with_spheres([(1, 0, 0, 0.5)])
    turn = np.array([[0, 0, 2.0], [0, -2, 0], [2, 0, 0]])
    flat = resolve_instances(group(Instances(ball, placed_at(1, 1, 1, turn))), False, "copied")
    assert flat.spheres.tolist() == [[1, 1, 3, 1]]


def test_a_group_that_contains_itself_is_an_error_with_its_path():
    leaf = Mesh(*SQUARE, source="leaf")
    branch = group(leaf, source="branch")
    tree = group(Instances(branch, np.eye(4)), source="tree")
    branch.instances.append(Instances(tree, np.eye(4)))
    with pytest.raises(tt.InputError, match="a group contains itself: tree → branch → tree"):
        resolve_instances(tree)


@pytest.mark.parametrize("up_axis", ["y", "z"])
def test_a_ground_lies_under_everything_and_is_not_what_the_camera_shows(up_axis, f32):
    mesh = tt.load_mesh("cube")
    mesh.materials[0] = Material(Kd=(1.0, 1.0, 1.0))
    plain = tt.SceneData(mesh, up_axis=up_axis)
    scene = tt.SceneData(mesh, up_axis=up_axis, ground=True)
    assert (scene.ground, plain.ground) == (True, False)
    for name in ("eye", "at"):
        np.testing.assert_array_equal(scene.view[name], plain.view[name])
    up = 1 if up_axis == "y" else 2
    low, high = plain.geometry.mesh.vertices.min(axis=0), plain.geometry.mesh.vertices.max(axis=0)
    beside = (low + high) / 2 + np.array([30.0, 0, 0])
    down = -np.eye(3)[up]
    hits = scene.intersect(beside[None], down[None])
    assert hits.is_hit[0]
    assert not hits.is_backfacing[0]
    position = beside + hits.distance[0] * down
    size = np.linalg.norm(high - low)
    assert low[up] - 1e-3 * size < position[up] < low[up]
    assert scene.materials[hits.material_id[0]].Kd == (0.6, 0.6, 0.6)
    assert scene.materials[0].Kd == (0.6, 0.6, 0.6)
    assert mesh.materials[0].Kd == (1.0, 1.0, 1.0)
