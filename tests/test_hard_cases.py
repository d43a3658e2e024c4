"""The stability suite can be trusted: its oracles are right, its cases are hard, and it fails what is broken."""

import json
from fractions import Fraction

import numpy as np
import pytest
from support import start

from taichi_tracer.apps import cli
from taichi_tracer.contracts.lab import as_f32, sphere
from taichi_tracer.studies import hard_cases
from taichi_tracer.studies.hard import oracle
from taichi_tracer.studies.hard.case import (
    COUNTS,
    RayMode,
    box,
    edges_of,
    normals_of,
    promises_of,
)
from taichi_tracer.studies.hard.triangle_cases import AxisParallel, ClosedSphere, Lattice, UnitTriangles, Windows


@pytest.fixture(autouse=True, scope="module")
def _taichi():
    start("f32")


# ── oracles ──


def by_fractions(o, d, corners):
    """(position, t) by Cramer's rule in fractions."""
    o, d, v0, v1, v2 = ([Fraction(float(x)) for x in row] for row in (o, d, *corners))
    e1, e2, s = ([a - b for a, b in zip(p, q, strict=True)] for p, q in ((v1, v0), (v2, v0), (o, v0)))

    def cross(a, b):
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    def dot(a, b):
        return sum(x * y for x, y in zip(a, b, strict=True))

    det = dot(e1, cross(d, e2))
    if det == 0:
        return -1, None
    u, v, t = dot(s, cross(d, e2)) / det, dot(d, cross(s, e1)) / det, dot(e2, cross(s, e1)) / det
    lowest = min(u, v, 1 - u - v)
    return (lowest > 0) - (lowest < 0), float(t)


def test_the_exact_oracle_agrees_with_fractions(rng):
    n = 300
    corners = as_f32(rng.normal(size=(n, 3, 3)) * 10.0 ** rng.integers(-20, 20, (n, 1, 1)))
    corners[::3] = rng.integers(-2, 3, corners[::3].shape)
    o = as_f32(corners.mean(axis=1) + rng.normal(size=(n, 3)) * np.abs(corners).max(axis=(1, 2))[:, None])
    d = as_f32((corners * rng.dirichlet((1, 1, 1), n)[:, :, None]).sum(axis=1) - o)
    o[::3] = rng.integers(-4, 5, o[::3].shape)
    d[::3] = corners[::3, 0] - o[::3]
    position, t = oracle.exact_hit(o, d, corners)
    truth = [by_fractions(*row) for row in zip(o, d, corners, strict=True)]
    assert list(position) == [p for p, _ in truth]
    assert {-1, 0, 1} <= set(position)
    for mine, (_, exact) in zip(t, truth, strict=True):
        assert np.isnan(mine) if exact is None else mine == exact


def test_closed_meshes_are_closed():
    for vertices, faces in (sphere(12, 7, 2.0, (3, 4, 5)), box((0, 0, 0), (1, 2, 3))):
        directed = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        assert len({tuple(e) for e in directed}) == len(directed)  # each edge once each way: closed and oriented
        assert {tuple(e) for e in directed} == {tuple(e[::-1]) for e in directed}
        centre = vertices.mean(axis=0)
        outward = (normals_of(vertices, faces) * (vertices[faces[:, 0]] - centre)).sum(axis=1)
        assert (outward > 0).all()
        assert len(edges_of(faces)) * 2 == len(directed)


# ── what it passes and what it fails ──


def test_the_watertight_test_passes(monkeypatch):
    few = [ClosedSphere("ball", "unit", 8.0, (0, 0, 0), 8, 5), Lattice(), AxisParallel(), UnitTriangles(), Windows()]
    monkeypatch.setattr(hard_cases, "all_cases", lambda: few)
    monkeypatch.setattr(hard_cases, "modes_of", lambda *of: [RayMode("watertight", "f32", False, "wide_bvh")])
    monkeypatch.setattr(hard_cases, "renderer_cases", lambda *of: [])
    result = hard_cases.run("quick", arch="cpu")
    assert [(v.case, v.broken, v.weak) for v in result.verdicts if v.word != "PASS"] == []
    assert result.passed
    assert len(result.rows) == 1
    assert "backend cpu" in result.machine


def test_promises():
    mode = RayMode("anything", "f32", False, "bvh")
    strict = promises_of(mode)
    assert {name for name, limit in strict.items() if limit == 0} == set(COUNTS)
    assert strict["t_unit"] == pytest.approx(4 * mode.epsilon)
    found = {"nan": 0, "wrong": 1, "t_unit": np.nan, "double_hits": 9}
    assert hard_cases.verdict_of(str(mode), strict, "a case", 9, found).broken == ["wrong", "t_unit"]
    assert promises_of(RayMode("watertight", "f32", True, "bvh")) == {}


# ── the command ──


@pytest.fixture
def canned(monkeypatch):
    """A run that takes no time; ``fail`` breaks a promise."""

    def make(fail=False, **findings):
        mode = RayMode("watertight", "f32", False, "wide_bvh")
        found = {
            "edge_leaks": int(fail),
            "edge_rays": 100,
            "t_unit": float("nan") if fail else 1e-8,
            "nan": 0,
        } | findings
        verdict = hard_cases.verdict_of(str(mode), promises_of(mode), "closed sphere at 0", 100, found)
        row = hard_cases.Row(mode, found, 123.4)
        result = hard_cases.SuiteResult("quick", "python 3", [row], [verdict])
        monkeypatch.setattr(hard_cases, "run", lambda *args, **options: result)

    return make


def test_the_exit_code_says_whether_promises_are_kept(canned, capsys):
    canned()
    assert cli.main(["hardcases", "--quick"]) == 0
    lines = capsys.readouterr().out.strip().splitlines()
    told = "The default (watertight f32 wide_bvh) passes 1 of 1 cases; other modes show what they lose."
    assert lines[0] == lines[-1] == told
    canned(fail=True)
    assert cli.main(["hardcases"]) == 1
    assert "FAIL  closed sphere at 0: edge leaks 1" in capsys.readouterr().out


def test_json_can_be_read_by_anyone(canned, tmp_path):
    canned(fail=True)
    assert cli.main(["hardcases", "--json", str(tmp_path / "a.json")]) == 1

    def refuse(constant):
        raise AssertionError(constant)  # NaN and Infinity are not JSON

    found = json.loads((tmp_path / "a.json").read_text(), parse_constant=refuse)
    assert set(found) == {"suite", "level", "passed", "machine", "modes", "cases"}
    assert found["passed"] is False
    (mode,), (case,) = found["modes"], found["cases"]
    assert {"triangle_test", "precision", "fast_math", "intersector", "ns_per_ray", "findings"} <= set(mode)
    assert mode["edge_leaks_per_million"] == 1e4
    assert case["verdict"] == "FAIL"
    assert case["findings"]["t_unit"] is None
