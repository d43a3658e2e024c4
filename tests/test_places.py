"""Where objects stand, in kernels: against the same matrices in float64."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm
from shapes import SQUARE, with_spheres

import taichi_tracer as tt
from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Instances, group
from taichi_tracer.ray import Ray


@pytest.fixture(scope="module", params=[False, True], ids=["triangles", "with spheres"])
def placed(request):
    """(scene, matrices)."""
    rng = np.random.default_rng(5)
    matrices = np.tile(np.eye(4), (40, 1, 1))
    matrices[:, :3] = rng.normal(size=(40, 3, 4))
    parts = [Instances(Mesh(*SQUARE, source="square"), matrices)]
    if request.param:
        parts.append(Instances(with_spheres([(0, 0, 0, 1)]), matrices[:3]))
    scene = tt.scene_from_mesh(group(parts), instances="shared")
    return scene, matrices


def test_every_id_has_its_place_and_its_number(placed):
    scene, _ = placed
    places, count = scene.geometry.places, int(scene.mesh.placed.starts[-1])
    found = ti.Vector.ndarray(2, ti.i32, count)

    @ti.kernel
    def ask(found: ti.types.ndarray()):
        for i in found:
            found[i] = ti.Vector([places.place_of(i), scene.geometry.number(i)])

    ask(found)
    starts, numbers = scene.mesh.placed.starts, []
    for place, own in enumerate(scene.mesh.placed.object_of):
        first = scene.mesh.placed.primitives[own]
        numbers += [(place, first + k) for k in range(starts[place + 1] - starts[place])]
    assert found.to_numpy().tolist() == [list(pair) for pair in numbers]


def test_points_normals_and_rays_go_there_and_back(placed):
    scene, matrices = placed
    places = scene.geometry.places
    found = ti.Vector.ndarray(3, float, (len(matrices), 4))

    @ti.kernel
    def ask(found: ti.types.ndarray()):
        for i in range(found.shape[0]):
            ray = Ray(origin=tm.vec3(1, 2, 3), direction=tm.vec3(0, -4, 0.5))
            o, d = places.to_object(i, ray)
            found[i, 0], found[i, 1] = places.to_world(i, tm.vec3(0.5, -1, 2)), ti.cast(o, float)
            found[i, 2], found[i, 3] = ti.cast(d, float), places.normal_to_world(i, tm.vec3(0, 0, 1))

    ask(found)
    inverses = np.linalg.inv(matrices)
    expected = np.stack(
        [
            matrices[:, :3] @ [0.5, -1, 2, 1],
            inverses[:, :3] @ [1, 2, 3, 1],
            inverses[:, :3] @ [0, -4, 0.5, 0],
            inverses[:, 2, :3],
        ],
        axis=1,
    )
    np.testing.assert_allclose(found.to_numpy(), expected, rtol=2e-4, atol=2e-4)
    assert scene.geometry.places.facing.to_numpy()[:40].tolist() == np.sign(np.linalg.det(matrices)).tolist()
