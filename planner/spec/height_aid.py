"""What becomes of the vertical channel of a long flight that nothing holds, in words."""

from __future__ import annotations

import math

LONG_S = 1800.0
RATE = 1.755e-3  # 1/s, √(2 g/R): gravitation falls with height, so that an error of height grows by it


def unaided(duration_s: float) -> str | None:
    """A remark on a flight of so many seconds without a height aid; None where it is short."""
    if duration_s <= LONG_S:
        return None
    grown = math.cosh(min(RATE * duration_s, 600.0))
    return (
        f"nothing holds the height in a flight of {duration_s / 3600:.3g} h: an error of the vertical "
        f"channel grows by e every {1.0 / (60.0 * RATE):.1f} min, here {grown:.2g} times; give what aids it, "
        "'vertical: {aided: 10 m}' (one sigma of a barometer's height)"
    )
