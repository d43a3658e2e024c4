"""What a scene calls for is found from it, and leaving out the rest changes no bit of the picture."""

import numpy as np
import pytest
from shapes import SQUARE
from support import start

import taichi_tracer as tt
from taichi_tracer import brdf
from taichi_tracer.geometry import Mesh
from taichi_tracer.materials import Material
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.studies import effects as study


@pytest.fixture(scope="module", autouse=True)
def _taichi():
    start("f32")


def square_of(*materials, environment=None, used=(0, 0)):
    mesh = Mesh(*SQUARE, face_materials=np.array(used, np.int32), materials=list(materials))
    return tt.SceneData(mesh, environment=environment).effects


def names(effects):
    return [brdf.ALL[i].name for i in effects.brdfs]


def test_materials_call_for_their_brdfs():
    assert names(square_of(Material())) == ["diffuse"]
    assert names(square_of(Material(Ns=30), Material(Ns=1e21), used=(0, 1))) == ["mirror", "phong"]
    assert names(square_of(Material(), Material(Ns=30))) == ["diffuse"]  # no triangle has the second


def test_light_is_what_the_environment_and_the_materials_emit():
    kinds = {name: square_of(Material(), environment=name).environment for name in ("white", "black", "studio")}
    assert kinds == {"white": "constant", "black": "black", "studio": "image"}
    assert square_of(Material()).environment == "none"
    assert square_of(Material()).is_dark
    assert not square_of(Material(Ke=(1, 0, 0))).is_dark
    assert not square_of(Material(), environment="white").is_dark
    assert square_of(Material(), environment="black").is_dark


def test_the_receipt_names_every_effect_with_its_reason():
    lines = square_of(Material(), environment="white").receipt()
    text = "\n".join(lines)
    assert "phong           not simulated, no triangle has a material with Ns > 1" in text
    assert "look-up         not simulated, its radiance is the same in every direction" in text
    assert "diffuse         simulated, 1 of 1 materials" in text
    assert len(lines) == len(brdf.ALL) + 8


@pytest.mark.parametrize(
    ("scene", "environment", "estimator"),
    [
        pytest.param("sphere", "white", "mis", marks=pytest.mark.long),
        ("specular_spheres", "studio", "brdf"),
        pytest.param("cube", "black", "mis", marks=pytest.mark.long),
    ],
)
def test_everything_compiled_in_gives_the_same_bits(scene, environment, estimator):
    pictures = []
    for mode in ("scene", "all"):
        loaded = tt.load_scene_data(scene, environment=environment, effects_mode=mode, intersector="brute_force")
        with_light = A2Renderer(loaded, 24, 24).use(estimator)
        if loaded.effects.is_dark:
            with pytest.warns(UserWarning, match="nothing in this scene emits light"):
                with_light.render(3)
        pictures.append(with_light.render(3).image())
    np.testing.assert_array_equal(*pictures)


@pytest.mark.long
def test_the_study_finds_the_same_bits_and_positive_times():
    options = {"environment": "white", "intersector": "brute_force"}
    scene, complete = (tt.load_scene_data("cube", effects_mode=m, **options) for m in ("scene", "all"))
    variants = study.measure(scene, complete, width=32, height=32)
    assert [v.name for v in variants] == [
        "as the scene needs",
        "+ mirror",
        "+ phong",
        "+ environment look-up",
        "+ emitters",
        "everything",
    ]
    assert all(v.is_equal for v in variants)
    assert all(v.milliseconds > 0 for v in variants)
    assert "the same bits" in study.table(variants)[1]


def test_unknown_modes_are_named():
    with pytest.raises(tt.InputError, match="all"):
        tt.load_scene_data("cube", effects_mode="al")
