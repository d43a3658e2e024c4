"""Every scene, view and estimator shows what it showed: the means of blocks of small pictures."""

import numpy as np
import pytest
from acceptance import cases

import taichi_tracer as tt

pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture(scope="module")
def maker():
    """Scenes as they are loaded without options, but for those with a few triangles."""
    return cases.Maker(is_quick=True)


@pytest.mark.parametrize("case", cases.quick())
def test_a_picture_has_its_means(maker, case):
    assert cases.wrong(case, maker.blocks(case)) == ""


@pytest.mark.slow
def test_the_file_has_every_case():
    assert list(cases.known()) == cases.names()


def test_the_quick_cases_have_every_scene_view_and_estimator():
    quick = [case.split() for case in cases.quick()]
    assert {scene for _, scene, _ in quick} == set(tt.scene_names())
    for kind in ("A1", "A3", "A4", "RT3"):
        assert {shows for its, _, shows in quick if its == kind} == set(cases.renderer_class(kind).names()), kind


def test_the_comparison_notices_a_twentieth_more_light_and_two_exchanged_columns(maker):
    """Without this, the tests above could pass with bounds that are too wide."""
    for case in ("A3 cube mis_balance", "A4 white_room path"):
        right = maker.blocks(case)
        assert cases.wrong(case, 1.05 * right) != ""
    assert cases.wrong("A3 cube mis_balance", maker.blocks("A3 cube mis_balance")[:, [1, 0, 2, 3]]) != ""
    assert cases.wrong("A1 cornell_box normal", 1.02 * maker.blocks("A1 cornell_box normal")) != ""


@pytest.mark.slow
def test_the_second_renderer_has_the_pictures_of_the_third(maker):
    scene = maker.scene("specular_spheres", True)
    renderer = tt.A2Renderer(scene_data=scene, width=32, height=32, seed=1)
    assert cases.wrong("A3 specular_spheres mis", cases.blocks(renderer.use("mis").render(256).image())) == ""


@pytest.mark.parametrize("intersector", ["brute_force", pytest.param("bvh", marks=pytest.mark.slow)])
def test_a_map_counts_the_triangles_that_a_ray_asks(intersector):
    scene = tt.load_scene_data("cube", intersector=intersector)
    maps = tt.MapRenderer(scene_data=scene, width=32, height=32)
    maps.of = "normal"
    triangles = np.asarray(maps.use("triangles").render().image())[..., 0]
    if intersector == "brute_force":
        assert (triangles == 12).all()
    else:
        hit = np.isfinite(tt.A1Renderer(scene, 32, 32).aov("distance"))
        assert (triangles == np.round(triangles)).all()
        assert (triangles[hit] >= 1).mean() > 0.9  # a ray through another point of the pixel may miss
        assert triangles.mean() < 12


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in tt.MapRenderer.names() if name != "triangles"])
def test_every_map_is_finite_and_shows_the_scene(name):
    maps = tt.MapRenderer(scene_data=tt.load_scene_data("cornell_box"), width=32, height=32)
    maps.of = "mis"
    image = np.asarray(maps.use(name).render(4).image())
    assert np.isfinite(image).all()
    assert (image >= 0).all()
    assert image.max() > 0 or name == "below_horizon"


@pytest.mark.slow
def test_a_picture_is_the_same_with_all_effects_compiled():
    everything = cases.Maker(effects="all")
    asked = ["A1 globe normal", "A3 cube mis_balance", "A3 specular_spheres mis", "A4 white_room path"]
    assert [problem for case in asked if (problem := cases.wrong(case, everything.blocks(case)))] == []


@pytest.mark.slow
@pytest.mark.parametrize("half", [0, 1])
@pytest.mark.parametrize("kind", ["A1", "RT3", "A3", "A4"])
def test_every_other_picture_has_its_means(maker, kind, half):
    asked = [case for case in cases.names() if case.startswith(f"{kind} ") and case not in cases.quick()]
    of_half = asked[half * len(asked) // 2 : (half + 1) * len(asked) // 2]  # two processes share the work
    problems = [cases.wrong(case, maker.blocks(case)) for case in of_half]
    assert [problem for problem in problems if problem != ""] == []
