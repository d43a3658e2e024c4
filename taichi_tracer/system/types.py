"""Types that the signatures of several files share."""

from collections.abc import Sequence

import numpy as np

Numbers = Sequence[float] | np.ndarray  # a few numbers: a point, a direction, a colour, a window
