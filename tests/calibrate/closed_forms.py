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


# ---------------------------------------------------------------- SINS outputs (K 2.3), as printed
# Axes X, Y, Z of the sensors, 1, 2, 3 east, north, up. abc: (m, 3) α, β, γ rad, the rotation vector of
# computed against true attitude; v: (m, 3) velocity errors m/s; d: derivatives of either; u rad/s.


def sins_gyro_at_rest(abc: Array, d: Array, u: float, latitude: float) -> Array:
    """ΔΩ_x, ΔΩ_y, ΔΩ_z (m, 3) with Z up, X east, Y north (K eqs 24-26)."""
    (a, b, c), (da, db, dc) = abc.T, d.T
    s, k = u * np.sin(latitude), u * np.cos(latitude)
    return np.column_stack([da - s * b + k * c, db + s * a, dc - k * a])


def sins_accelerometers_at_rest(abc: Array, v: Array, d: Array, u: float, lat: float, g: float) -> dict:
    """Position -> Δn_x, Δn_y, Δn_z (m, 3) in the six positions of K table 2.6."""
    (a, b, c), (v1, v2, v3), (d1, d2, d3) = abc.T, v.T, d.T
    s, k = 2 * u * np.sin(lat), 2 * u * np.cos(lat)
    found = {
        "x_up": (d3 + s * v2 + b * g, d1 - k * v2, d2 + k * v1 - s * v3 - c * g),
        "x_down": (-d3 + s * v2 + b * g, d1 + k * v2, -d2 + k * v1 - s * v3 - c * g),
        "y_up": (d2 - k * v3, d3 - s * v1 + k * v2 - a * g, d1 + s * v3 + c * g),
        "y_down": (-d2 - k * v3, -d3 - s * v1 + k * v2 - a * g, d1 - s * v3 - c * g),
        "z_up": (d1 - s * v2 + k * v3 - b * g, d2 + s * v1 + a * g, d3 - k * v1),
        "z_down": (-s * v2 - k * v3 - b * g - d1, d2 - s * v1 - a * g, k * v1 - d3),
    }
    return {name: np.column_stack(parts) for name, parts in found.items()}


def sins_errors(abc: Array, v: Array, d_abc: Array, d_v: Array, earth: Array, turn: Array, f: Array) -> tuple:
    """ΔΩ = θ' + Ω × θ, Δn = V' + (2 ω_ie + w) × V − θ × f, all along the sensors' axes (K eqs 22, 23).

    Ω = ω_ie + w; earth: (m, 3) ω_ie; turn: (3,) w, what the bench turns; f: (m, 3) specific force. K's eq 22
    has 2 Ω × V: its V is the derivative of a position along the turning axes, not a log's velocity.
    Returns ΔΩ (m, 3) rad/s and Δn (m, 3) m/s².
    """
    gyro = d_abc + np.cross(earth + turn, abc)
    return gyro, d_v + np.cross(2.0 * earth + turn, v) - np.cross(abc, f)
