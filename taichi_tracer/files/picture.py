"""A picture as an array of numbers that knows whether the numbers are light, so that it is written right."""

import numpy as np

# Operations whose result has the meaning of their arguments. A picture times two is a brighter picture. A picture to
# the power of 1/2.2 is something else: somebody encoded it by hand, and it must not be encoded once more.
KEEP_MEANING = ("add", "subtract", "multiply", "divide", "negative", "positive", "absolute", "minimum", "maximum")
KEEP_MEANING += ("fmin", "fmax", "clip")
JOIN = (np.concatenate, np.where, np.pad)
SMALLEST = 16  # pixels on a side of what a notebook shows as a picture


class Picture(np.ndarray):
    """A numpy array, usually (height, width, 3), that knows which values it has; ``renderer.image()`` returns one.

    It can be used like every other array, and a notebook shows it as a picture. Slices, copies, sums, means and
    multiples of a picture know the same as the picture. The result of any other operation is a plain array, because
    nobody has said what its values mean.

    Args:
        values: the numbers.
        srgb: True if the values are radiance or colour, which are linear: files of 8 bits then get the sRGB transfer
            function. False if they are data such as normals, which are written unchanged (C-14).

    Attributes:
        srgb: as above; None if nobody has said it. Then it is written like a plain array.
    """

    srgb: bool | None = None

    def __new__(cls, values, srgb: bool | None = None) -> "Picture":
        """An array that shares its memory with ``values``, if ``values`` is an array."""
        picture = np.asarray(values).view(cls)
        picture.srgb = srgb
        return picture

    def __array_finalize__(self, origin) -> None:
        self.srgb = getattr(origin, "srgb", None)

    def __array_ufunc__(self, operation, method, *arguments, out=(), **options):
        options |= {"out": tuple(as_array(array) for array in out)} if out else {}
        result = getattr(operation, method)(*(as_array(argument) for argument in arguments), **options)
        srgb = common_srgb(arguments) if operation.__name__ in KEEP_MEANING else None
        if out:
            for array in out:
                if isinstance(array, Picture):
                    array.srgb = srgb
            return out[0] if len(out) == 1 else out
        return result if srgb is None or not isinstance(result, np.ndarray) else Picture(result, srgb)

    def __array_function__(self, function, types, arguments, options):
        result = super().__array_function__(function, types, arguments, options)
        if function in JOIN and isinstance(result, np.ndarray):
            return Picture(result, common_srgb(arguments[0] if function is np.concatenate else arguments))
        return result

    def __reduce__(self):
        return Picture, (as_array(self), self.srgb)

    def _repr_png_(self) -> bytes | None:
        """What a notebook shows; a few pixels are shown as numbers."""
        from taichi_tracer.files.images import encode_png

        if self.ndim != 3 or self.shape[2] != 3 or min(self.shape[:2]) < SMALLEST:
            return None
        return encode_png(self)


def as_array(value):
    """The same numbers as a plain array, if ``value`` is a picture; anything else as it is."""
    return value.view(np.ndarray) if isinstance(value, Picture) else value


def common_srgb(values) -> bool | None:
    """What all pictures among the values say of themselves; None if they do not agree."""
    said = {value.srgb for value in values if isinstance(value, Picture)}
    return said.pop() if len(said) == 1 else None
