"""What machines must have in common is compared by name, with both values."""

import pytest

import taichi_tracer as tt
from taichi_tracer.cluster.versions import difference, installation


def test_the_same_installation_does_not_differ():
    assert difference(installation(), installation()) == ""
    assert installation()["taichi_tracer"].startswith(f"{tt.__version__} (source ")


@pytest.mark.parametrize(
    ("name", "there", "told"),
    [
        ("taichi_tracer", "0.0.9 (source 123)", "taichi_tracer 0.0.9 (source 123) there, "),
        ("Taichi", "1.7.3", "Taichi 1.7.3 there, "),
        ("Python", "3.10", "Python 3.10 there, "),
    ],
)
def test_what_differs_is_named_with_both_values(name, there, told):
    ours = installation() if there != installation()[name] else installation() | {name: "other"}
    assert difference(ours | {name: there}, ours) == f"{told}{ours[name]} here"


def test_another_precision_is_named():
    ours = {"backend": "cpu", "precision": "f32", "fast math": "False"}
    assert difference(ours | {"precision": "f64"}, ours) == "precision f64 there, f32 here"
    assert difference({}, ours).startswith("backend unknown there, cpu here")
