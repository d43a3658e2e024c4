"""No curve: values up to 1 are shown as they are, and larger values are cut off."""

from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.parts import register
from taichi_tracer.tones.base import Tone


@register
class NoTone(Tone):
    """x. It is the default: two pictures can be compared by eye, because equal light has equal colour."""

    name, label, white = "none", "None", 1.0

    @compile_time
    def curve(self, x):
        """x."""
        return x
