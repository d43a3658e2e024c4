"""The lights of RT3 documents (RT-10): how an element is read."""

import numpy as np

from taichi_tracer.lights.ambient_light import AmbientLight
from taichi_tracer.lights.base import Light
from taichi_tracer.lights.directional_light import DirectionalLight
from taichi_tracer.lights.point_light import PointLight
from taichi_tracer.lights.spot_light import SpotLight
from taichi_tracer.rt3.elements import Element
from taichi_tracer.system.errors import InputError

KINDS = {"ambient": "ambient", "directional": "directional", "distant": "directional", "point": "point", "spot": "spot"}
EVEN = np.array([1.0, 0.0, 0.0])  # Kc, Kl, Kq of a light that does not say them: it does not fall off
CUTOFF, FALLOFF = 30.0, 15.0


def read_light(element: Element, ctm: np.ndarray) -> Light:
    """The light that an element describes.

    Args:
        ctm: (4, 4), the transform for ``from`` and ``to``.

    Raises:
        InputError: with file and line.
    """
    kind = element.choice("type", of=KINDS)
    try:
        return _read(element, kind, ctm)
    except InputError as error:
        text = str(error)
        raise (error if text.startswith(element.where) else element.error(text)) from None


def _read(element: Element, kind: str, ctm: np.ndarray) -> Light:
    color = _color(element)
    if kind == "ambient":
        return AmbientLight(color)
    start = _place(element, ctm, "from")
    if kind == "directional":
        return DirectionalLight((_place(element, ctm, "to") if element.find("to") else ctm[:3, 3]) - start, color)
    attenuation = element.numbers("attenuation", default=EVEN)
    if kind == "point":
        return PointLight(start, color, attenuation)
    end = _place(element, ctm, "to")
    cutoff = element.number("cutoff", default=CUTOFF)
    falloff = element.number("falloff", default=min(FALLOFF, cutoff))
    return SpotLight(start, end, color, cutoff, falloff, attenuation)


def _color(element: Element) -> np.ndarray:
    """L or I, times ``scale``."""
    color = np.resize(element.numbers(element.need("L", "I"), count=(1, 3)), 3)
    scale = np.resize(element.numbers("scale", count=(1, 3), default=np.ones(1)), 3)
    if (color < 0).any() or (scale < 0).any():
        raise element.error("L, I and scale must not be negative")
    return color * scale


def _place(element: Element, ctm: np.ndarray, name: str) -> np.ndarray:
    return ctm[:3, :3] @ element.numbers(element.need(name)) + ctm[:3, 3]
