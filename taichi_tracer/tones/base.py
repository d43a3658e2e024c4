"""The interface of a tone curve: it turns linear radiance of any size into linear light between 0 and 1.

A screen shows values from 0 to 1. Without a curve, everything above 1 becomes white, and its shape is lost. A curve
bends the large values down instead. It is applied to each channel of a picture that shows radiance or colour, after the
exposure and before the sRGB transfer function, and only for a screen and for files of 8 bits. Floating-point files,
errors and comparisons always have the linear values.
"""

from taichi_tracer.system.compile_time import compile_time


class Tone:
    """The interface. A subclass defines ``curve`` and ``white``.

    Attributes:
        name: the name that ``tone=`` and ``--tone`` take.
        label: the text in the window; if it is empty, the name is shown.
        white: the smallest value that becomes 1. All larger values become 1, too.
    """

    kind, name, label = "tone curve", "", ""
    required = ("curve",)
    white: float = 1.0

    @compile_time
    def curve(self, x):
        """Linear light in [0, 1] for exposed radiance x in [0, ``white``]; ``curve(0)`` is 0, and it never decreases.

        Python calls it with an array, and kernels call it with a vector: the formula may use + − × ÷ and powers.
        """
        raise NotImplementedError(f"{type(self).__name__} must say what curve(self, x) is")
