"""The published closed forms of single parameters, as printed once their misprints are mended (K 2.2).

The general estimator gives the same numbers where the records are those that a form asks for; these stay as
its check, and for who wants to follow the sources by hand.
"""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array


def six_position_gyro(readings: Array, earth_rate: float, latitude: float) -> tuple[float, float]:
    """Bias b0 and g-sensitivity k_g of one gyro from six positions (K 2.2.2, signs mended).

    readings: (6,) with the sensitive axis up, down, north, south, east, west; rad/s
    up/down: ± (u sin φ + k_g·1 g) + b0;  north/south: ± u cos φ + b0;  east, west: b0
    Returns b0 in rad/s and k_g in rad/s per g.
    """
    up, down = readings[:2]
    return float(np.mean(readings)), float((up - down) / 2.0 - earth_rate * np.sin(latitude))


def six_position_accelerometer(down: float, right: float, up: float, left: float) -> float:
    """Bias of one accelerometer whose slopes for + and − differ and whose mounting is off (K 2.2.3).

        b0 = (D·R − U·L)/(D + R − U − L)

    Exact for U = K₊g + b, D = −K₋g + b, R = K₊gε + b, L = −K₋gε + b with any small tilt ε.
    """
    return (down * right - up * left) / (down + right - up - left)


def rotations(readings: Array, rate: float) -> tuple[Array, Array]:
    """Scale factors K (3,) and correction matrix (3, 3) of a triad from turns about x, y, z (K 2.2.4).

    readings: (3, 3), column j the bias-free readings while turning at `rate` about axis j; also for
    accelerometers, with g in place of the rate.  K_x = |n_x|/ω,  W[x, j] = n_xj/(K_x ω), correction W⁻¹.
    """
    scale = np.linalg.norm(readings, axis=1) / abs(rate)
    W = readings / (scale[:, None] * rate)
    return scale, np.linalg.inv(W)
