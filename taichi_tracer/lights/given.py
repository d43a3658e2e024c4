"""The numbers from which lights are made: checked when they are given, and shown again by ``repr``."""

import numpy as np

from taichi_tracer.lights.base import Light
from taichi_tracer.system.errors import InputError
from taichi_tracer.system.memory import varying
from taichi_tracer.system.types import Numbers


class GivenLight(Light):
    """A light that is described by a few numbers; other numbers compile nothing."""

    def __repr__(self) -> str:
        arguments = ", ".join(f"{name}={value!r}" for name, value in vars(self).items() if not name.startswith("_"))
        return f"tt.{type(self).__name__}({arguments})"

    def _three(self, what: str, given: float | Numbers, least: float = -np.inf) -> tuple[float, ...]:
        """Three finite numbers of at least ``least``; a single number means three equal ones."""
        try:
            values = np.broadcast_to(np.asarray(given, np.float64), 3)
        except (TypeError, ValueError):
            values = np.full(3, np.nan)
        if not (np.isfinite(values).all() and (values >= least).all()):
            bound = "" if least == -np.inf else f" of at least {least:g}"
            raise InputError(f"{self.name} light: {what} must be three finite numbers{bound}, not {given!r}")
        return varying(tuple(values.tolist()))

    def _unit(self, what: str, given: Numbers) -> tuple[float, ...]:
        """A vector divided by its length."""
        largest = np.abs(given).max()
        if not largest > 0:
            raise InputError(f"{self.name} light: {what} must have a length, not {tuple(map(float, given))}")
        vector = np.asarray(given) / largest
        return varying(tuple((vector / np.linalg.norm(vector)).tolist()))

    def _attenuation(self, given: Numbers) -> tuple[float, ...]:
        """Kc, Kl and Kq of ``point_light.fall``: none is negative, and one is positive."""
        values = self._three("attenuation", given, 0)
        if max(values) == 0:
            raise InputError(f"{self.name} light: one number of attenuation must be above 0, not {given!r}")
        return values
