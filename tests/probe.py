"""Asks Taichi functions from Python, over arrays of arguments.

A probe is a ``@ti.func`` that reads row i of one array and writes row i of another:

    @ti.func
    def _unit(rows: ti.template(), out: ti.template(), i):
        put(out, i, 0, unit(vec3(rows, i, 0)))

    directions = ask(_unit, vectors, columns=3)
"""

import numpy as np
import taichi as ti
import taichi.math as tm

from taichi_tracer.ray import real
from taichi_tracer.system import runtime


@ti.func
def vec3(rows: ti.template(), i, column: ti.template()):
    """Three numbers of a row."""
    return tm.vec3(rows[i, column], rows[i, column + 1], rows[i, column + 2])


@ti.func
def put(out: ti.template(), i, column: ti.template(), value):
    """Write a vec3 into a row."""
    for k in ti.static(range(3)):
        out[i, column + k] = value[k]


@ti.kernel
def _for_every_row(probe: ti.template(), rows: ti.types.ndarray(ndim=2), out: ti.types.ndarray(ndim=2)):
    for i in range(rows.shape[0]):
        probe(rows, out, i)


def ask(probe, rows, columns):
    """(N, columns) numbers, in the running precision, from (N, any) arguments."""
    rows = np.ascontiguousarray(rows, runtime.dtype())
    out = np.zeros((len(rows), columns), runtime.dtype())
    if len(rows) > 0:
        _for_every_row(probe, rows, out)
    return out


@ti.dataclass
class Numbers:
    """What the shipped BRDFs read of a material."""

    Kd: tm.vec3
    Ns: real


KD = (0.75, 0.5, 0.25)  # of the materials that ``brdf_values`` asks about


@ti.kernel
def _brdf(
    brdf: ti.template(),
    ns: float,
    wo: ti.types.ndarray(ndim=2),
    wi: ti.types.ndarray(ndim=2),
    out: ti.types.ndarray(ndim=2),
):
    for i in range(wo.shape[0]):
        n = tm.vec3(0, 0, 1)
        w_o, w_i = vec3(wo, i, 0), vec3(wi, i, 0)
        m = Numbers(Kd=tm.vec3(KD[0], KD[1], KD[2]), Ns=ns)
        out[i, 0] = brdf.eval(m, w_o, w_i, n).x
        out[i, 1] = brdf.pdf(m, w_o, w_i, n)
        out[i, 2] = brdf.weight(m, w_o, w_i, n).x


def brdf_values(brdf, ns, w_o, w_i):
    """(N, 3) float64: f_r and the weight of the first channel, and between them the pdf; the normal is +z."""
    out = np.zeros((len(w_o), 3), runtime.dtype())
    _brdf(brdf, ns, *(np.ascontiguousarray(w, runtime.dtype()) for w in (w_o, w_i)), out)
    return out.astype(np.float64)


@ti.kernel
def _brdf_samples(
    brdf: ti.template(),
    ns: float,
    w_o: tm.vec3,
    n: tm.vec3,
    xi: ti.types.ndarray(ndim=2),
    out: ti.types.ndarray(ndim=2),
):
    for i in range(xi.shape[0]):
        m = Numbers(Kd=tm.vec3(KD[0], KD[1], KD[2]), Ns=ns)
        put(out, i, 0, brdf.sample(m, w_o, n, tm.vec2(xi[i, 0], xi[i, 1])))


def brdf_samples(brdf, ns, w_o, n, xi):
    """(N, 3) float64 directions that a BRDF makes of (N, 2) random numbers."""
    out = np.zeros((len(xi), 3), runtime.dtype())
    _brdf_samples(brdf, ns, ti.Vector(w_o), ti.Vector(n), np.ascontiguousarray(xi, runtime.dtype()), out)
    return out.astype(np.float64)
