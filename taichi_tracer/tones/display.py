"""Exposure and tone curve together: what a screen and a file of 8 bits show of linear radiance."""

from dataclasses import dataclass

import numpy as np

from taichi_tracer.system.errors import InputError, digits
from taichi_tracer.system.parts import PARTS
from taichi_tracer.tones.base import Tone

PLAIN_TONE = "none"
BRIGHT, AIM = 0.9, 0.5  # the fitting exposure shows this quantile of the light as this number
DARKEST = 1 / 255 / 12.92  # linear: what is below becomes no more than 1/255 by the sRGB transfer function
MOST_STOPS = 64.0  # a factor of 2^64: more would leave the numbers of f32 pictures


@dataclass(frozen=True)
class Display:
    """How a picture of radiance is shown.

    Args:
        exposure: in stops: each stop doubles the light. 0 changes nothing.
        tone: the name of a registered tone curve, or a ``Tone``; "none" changes nothing.

    Raises:
        InputError: the curve is unknown, or the exposure is not a number between −64 and 64.
    """

    exposure: float = 0.0
    tone: str | Tone = PLAIN_TONE

    def __post_init__(self) -> None:
        PARTS.find("tone curve", self.tone)
        if not (isinstance(self.exposure, (int, float, np.number)) and abs(self.exposure) <= MOST_STOPS):
            raise InputError(
                f"exposure must be between {-MOST_STOPS:g} and {MOST_STOPS:g} stops, not {self.exposure!r}: "
                "1 doubles the light, and -1 halves it"
            )

    @property
    def part(self) -> Tone:
        """The tone curve."""
        return PARTS.find("tone curve", self.tone)

    @property
    def scale(self) -> float:
        """The factor of the exposure: 2 to the power of its stops."""
        return 2.0 ** float(self.exposure)

    @property
    def is_plain(self) -> bool:
        """Whether a picture is shown without any change."""
        return self.exposure == 0 and self.part.name == PLAIN_TONE

    def shown(self, image: np.ndarray) -> np.ndarray:
        """(h, w, 3) float64 in [0, 1]: linear light of an (h, w, 3) image of radiance; NaN becomes 0."""
        x = np.nan_to_num(np.asarray(image, np.float64), nan=0.0, posinf=np.inf, neginf=0.0) * self.scale
        return np.clip(self.part.curve(np.clip(x, 0.0, self.part.white)), 0.0, 1.0)

    def __str__(self) -> str:
        return f"exposure {digits(float(self.exposure), '+.9g')} stops, tone curve {self.part.name}"


def fitting_exposure(image: np.ndarray) -> int:
    """The whole number of stops that shows an (h, w, 3) image of radiance well; 0 if it has no light."""
    light = lit(image)
    if light.size == 0:
        return 0
    stops = round(np.log2(AIM / float(np.quantile(light, BRIGHT))))
    return int(np.clip(stops, -MOST_STOPS, MOST_STOPS))


def share_in_the_dark(image: np.ndarray, display: Display) -> float:
    """The share of the pixels with light that are shown as no more than 1/255; 0 if there is no light."""
    light = lit(image)
    return 0.0 if light.size == 0 else float((light * display.scale < DARKEST).mean())


def lit(image: np.ndarray) -> np.ndarray:
    """The brightest channel of each pixel that has light, in float64."""
    brightest = np.asarray(image, np.float64).max(axis=2)
    return brightest[np.isfinite(brightest) & (brightest > 0)]
