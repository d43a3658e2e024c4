"""The answers of a scene as arrays: chosen, counted, shown as a table."""

import numpy as np
import pytest
from shapes import SQUARE

import taichi_tracer as tt

pytestmark = pytest.mark.usefixtures("f32")


@pytest.fixture(scope="module")
def square():
    return tt.scene_from_mesh(*SQUARE)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([[0, 0]], [[0, 0, 1]]), "origins must have the shape (n, 3), not (1, 2)"),
        (([0, 0, 0], 1.0), "directions must have the shape (n, 3)"),
        ((np.zeros((2, 3)), np.zeros((3, 3))), "do not fit together: (2, 3), (3, 3)"),
        ((np.zeros((2, 3)), np.zeros((2, 3)), [0, 0, 0]), "do not fit together"),
    ],
)
def test_shapes_that_do_not_fit_are_named(square, arguments, message):
    with pytest.raises(tt.InputError) as error:
        square.intersect(*arguments)
    assert message in str(error.value)


@pytest.fixture(scope="module")
def hits():
    origins, directions = [[0.5, 0.25, 2], [5, 5, 2], [0, 0.5, -1]], [[0, 0, -1], [0, 0, -1], [0, 0, 2]]
    return tt.scene_from_mesh(*SQUARE).intersect(origins, directions)


def test_hits_have_points_and_misses_have_none(hits):
    np.testing.assert_array_equal(hits.points, [[0.5, 0.25, 0], [np.nan] * 3, [0, 0.5, 0]])
    np.testing.assert_array_equal(hits.position, [[0.5, 0.25, 0], [0, 0, 0], [0, 0.5, 0]])
    assert hits.points.dtype == hits.distance.dtype


def test_hits_can_be_counted_iterated_and_chosen(hits):
    assert len(hits) == 3
    rows = list(hits)
    assert [row.distance for row in rows] == [2, np.inf, 0.5]
    assert [bool(row.is_backfacing) for row in rows] == [False, False, True]
    assert rows[2].normal.tolist() == hits[-1].normal.tolist() == [0, 0, -1]
    assert repr(rows[1]).startswith("RayHits(is_hit=False, distance=inf, triangle_id=-1")
    chosen = hits[hits.is_hit]
    assert len(chosen) == 2
    np.testing.assert_array_equal(chosen.points, hits.points[[0, 2]])
    assert len(hits[1:]) == 2
    assert repr(hits) == "RayHits(3 rays, 2 hits)"
    with pytest.raises(IndexError):
        hits[3]


def test_hits_are_columns_of_a_table(hits):
    columns = hits.to_dict()
    assert all(values.shape == (3,) for values in columns.values())
    vectors = [f"{name}_{letter}" for name in ("normal", "geometric_normal", "position") for letter in "xyz"]
    numbers = ["is_hit", "distance", "triangle_id", "material_id", "is_backfacing"]
    assert sorted(columns) == sorted([*numbers, "barycentric_coords_u", "barycentric_coords_v", *vectors])
    np.testing.assert_array_equal(columns["position_y"], hits.position[:, 1])
    np.testing.assert_array_equal(columns["barycentric_coords_v"], hits.barycentric_coords[:, 1])
