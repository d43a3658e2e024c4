"""How the error of a picture fell while it was rendered, for every estimator that was tried on this picture."""

from typing import NamedTuple

from taichi_tracer.picture.error_estimate import RelativeError


class ErrorPoint(NamedTuple):
    """One look at the error.

    Attributes:
        samples: per pixel. seconds: of rendering, without compilation.
        error: relative RMSE, a fraction.
    """

    samples: int
    seconds: float
    error: RelativeError


class ErrorCurves(dict[str, list[ErrorPoint]]):
    """The name of an integrator → its curve.

    A curve stays while another integrator shows the same picture, so that they can be compared. It begins anew with
    the samples; all end when the camera, the scene or the light changes, because they belong to another picture then.
    """

    def __init__(self) -> None:
        super().__init__()
        self._of: object = None

    def begin(self, name: str, of: object) -> None:
        """The picture of an integrator begins; ``of`` is everything that it depends on beside the integrator."""
        if of != self._of:
            self.clear()
            self._of = of
        self.pop(name, None)

    def add(self, name: str, point: ErrorPoint) -> None:
        """One more look, unless there is one after so many samples."""
        curve = self.setdefault(name, [])
        if not curve or curve[-1].samples < point.samples:
            curve.append(point)
