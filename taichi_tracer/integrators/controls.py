"""Values of an integrator that can be changed while its picture is shown: what a window needs to know to offer them.

``Integrator.controls`` returns them, with their present values; ``Integrator.change`` takes the new ones by name.
"""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Slider:
    """A number between two ends, which belong to it. It is whole if both ends are whole.

    Attributes:
        name: of the value, for ``Integrator.change``.
        label: what stands beside the slider; up to 10 characters have room there.
    """

    name: str
    value: float
    low: float
    high: float
    label: str


@dataclass(frozen=True)
class NameControl:
    """One of several names, which a button chooses one after another.

    Attributes:
        name: of the value, for ``Integrator.change``.
        label: what stands before the value on the button.
    """

    name: str
    value: str
    names: Sequence[str]
    label: str


@dataclass(frozen=True)
class BouncesControl:
    """The light of which bounces is shown: of all (None), or of some, (first, last); see ``PathSettings.bounces``.

    Attributes:
        name: of the value, for ``Integrator.change``.
        most: the largest number of bounces.
    """

    name: str
    value: tuple[int, int | None] | None
    most: int


Control = Slider | NameControl | BouncesControl
