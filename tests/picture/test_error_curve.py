"""Curves of all estimators stay side by side, as long as they are of one picture."""

from taichi_tracer.picture.error_curve import ErrorCurves, ErrorPoint
from taichi_tracer.picture.error_estimate import RelativeError


def point(n, error=0.1):
    return ErrorPoint(n, 0.01 * n, RelativeError(error, error, error))


def test_another_estimator_begins_a_curve_and_leaves_the_others():
    curves = ErrorCurves()
    curves.begin("brdf", of="a view")
    for n in (2, 4, 4, 8):
        curves.add("brdf", point(n))
    curves.begin("mis", of="a view")
    curves.add("mis", point(2))
    assert {name: [p.samples for p in curve] for name, curve in curves.items()} == {"brdf": [2, 4, 8], "mis": [2]}


def test_a_curve_stays_until_its_picture_has_begun_anew():
    curves = ErrorCurves()
    curves.begin("mis", of="a view")
    curves.add("mis", point(8))
    curves.begin("mis", of="a view")
    assert [p.samples for p in curves["mis"]] == [8]
    curves.add("mis", point(2))
    assert [p.samples for p in curves["mis"]] == [2]


def test_another_picture_ends_them_all():
    curves = ErrorCurves()
    for name in ("brdf", "mis"):
        curves.begin(name, of="a view")
        curves.add(name, point(2))
    curves.begin("mis", of="another view")
    assert curves == {}
