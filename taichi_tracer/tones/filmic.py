"""The filmic curve: bright places keep their shape, as on photographic film."""

from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.parts import register
from taichi_tracer.tones.base import Tone

# The constants of the source: shoulder strength, linear strength, linear angle, toe strength, toe numerator and toe
# denominator, the value that becomes white, and the factor by which a value is multiplied first.
A, B, C, D, E, F = 0.15, 0.50, 0.10, 0.20, 0.02, 0.30
WHITE, BIAS = 11.2, 2.0


def hable(x):
    """(x (A x + C B) + D E) / (x (A x + B) + D F) − E/F, as one fraction, so that 0 becomes exactly 0."""
    return x * (A * (F - E) * x + B * (C * F - E)) / (F * (x * (A * x + B) + D * F))


@register
class Filmic(Tone):
    """h(2 x) / h(11.2), where h is ``hable``: x = 0.18 becomes 0.13, x = 1 becomes 0.49, and x = 5.6 becomes white.

    Source: John Hable, "Filmic Tonemapping Operators", filmicworlds.com, 2010, with its constants of the game
    Uncharted 2. The source then takes the power 1/2.2; here the sRGB transfer function follows.
    """

    name, label, white = "filmic", "Filmic", WHITE / BIAS

    @compile_time
    def curve(self, x):
        """h(2 x) / h(11.2)."""
        return hable(BIAS * x) * (1 / hable(WHITE))
