"""What arrays are, and the words that several nouns share."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rule = Literal["worst_case", "rss", "percentile"]
Placement = Literal["even", "optimal", "joining", "fixed", "room"]
