"""Products of inputs, temperature and time since power-on in firmware: coefficients, and C that adds them.

The inputs of a bias are those that `apply` takes: the readings of the sensor itself, and the corrected
specific force for the gyros (`calibrate.correction`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from planner.export.firmware_curves import FirmwareCurve
from planner.nouns.array import Array
from planner.nouns.calibration import ExtraTerm
from planner.protocols import AXES, Sensor
from planner.units import unit_factor

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
OVER_FORCE = ("g_squared_sensitivity", "g_product_sensitivity", "vibration_rectification")
_SUM = """\
        for (j = 0; j < 6; ++j) {{{{
            static const int one[6] = {{{{0, 0, 0, 1, 1, 2}}}}, other[6] = {{{{0, 1, 2, 1, 2, 2}}}};
            bias += planner_{{s}}_{name}[i][j] * {x}[one[j]] * {x}[other[j]];
        }}}}
"""


def firmware_products(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> tuple[FirmwareCurve, ...]:
    """The terms of a sensor that are products of its conditions; unit: of its output."""
    found: dict[str, list[ExtraTerm]] = {}
    for e in terms:
        found.setdefault(e.effect, []).append(e)
    makers = (_drift, _over_force, _over_input, _force_over_temperature, _alignment_over_temperature)
    return tuple(made for make in makers if (made := make(sensor, found, unit)) is not None)


_Terms = Mapping[str, Sequence[ExtraTerm]]


def _drift(sensor: Sensor, found: _Terms, unit: str) -> FirmwareCurve | None:
    if "drift" not in found:
        return None
    per_hour = np.zeros(3)
    for e in found["drift"]:
        per_hour[AXES.index(e.term)] = e.value / unit_factor(f"{unit}/h")[0]
    return FirmwareCurve(
        9,
        ("drift",),
        {"time_slope": per_hour.astype(np.float32)},
        {"time_slope": "{unit} of drift per hour since power-on"},
        bias="        bias += planner_{s}_time_slope[i] * time_on_s / 3600.0f;\n",
    )


def _over_force(sensor: Sensor, found: _Terms, unit: str) -> FirmwareCurve | None:
    """Bias per product of two forces; what an accelerometer senses is a force."""
    names = [n for n in (*OVER_FORCE, *(() if sensor == "gyro" else ("cross_coupling",))) if n in found]
    if not names:
        return None
    values = sum(_pairs(found[n]) for n in names) / unit_factor(f"{unit}/g**2")[0]
    return FirmwareCurve(
        10,
        tuple(names),
        {"force_product": np.asarray(values, dtype=np.float32)},
        {"force_product": "{unit} per g squared of the products xx xy xz yy yz zz of the specific force"},
        bias=_SUM.format(name="force_product", x="acceleration_g"),
    )


def _over_input(sensor: Sensor, found: _Terms, unit: str) -> FirmwareCurve | None:
    if sensor != "gyro" or "cross_coupling" not in found:
        return None
    values = _pairs(found["cross_coupling"]) * unit_factor(unit)[0]  # per rate: u_j u_k / unit
    return FirmwareCurve(
        11,
        ("cross_coupling",),
        {"rate_product": values.astype(np.float32)},
        {"rate_product": "{unit} per product xx xy xz yy yz zz of two rates in {unit}"},
        bias=_SUM.format(name="rate_product", x="raw"),
    )


def _force_over_temperature(sensor: Sensor, found: _Terms, unit: str) -> FirmwareCurve | None:
    if "g_sensitivity_temperature" not in found:
        return None
    values = _matrix(found["g_sensitivity_temperature"]) / unit_factor(f"{unit}/g/K")[0]
    return FirmwareCurve(
        12,
        ("g_sensitivity_temperature",),
        {"acceleration_per_k": values.astype(np.float32)},
        {"acceleration_per_k": "{unit} per g of body axes x y z and per kelvin from 20 degC"},
        bias="""\
        for (j = 0; j < 3; ++j)
            bias += planner_{s}_acceleration_per_k[i][j] * acceleration_g[j] * (temperature_degc - 20.0f);
""",
    )


def _alignment_over_temperature(sensor: Sensor, found: _Terms, unit: str) -> FirmwareCurve | None:
    """u = M⁻¹ (v − (T − 20 °C) M' u) by repetition: M' is some 1e-5 rad/K."""
    if "misalignment_temperature" not in found:
        return None
    return FirmwareCurve(
        13,
        ("misalignment_temperature",),
        {"misalignment_per_k": _matrix(found["misalignment_temperature"]).astype(np.float32)},
        {"misalignment_per_k": "rad per kelvin from 20 degC, channel by body axis"},
        aligned="""\
    for (k = 0; k < 5; ++k) {{
        float w[3];
        for (i = 0; i < 3; ++i)
            w[i] = v[i] - (temperature_degc - 20.0f)
                 * (planner_{s}_misalignment_per_k[i][0] * corrected[0]
                    + planner_{s}_misalignment_per_k[i][1] * corrected[1]
                    + planner_{s}_misalignment_per_k[i][2] * corrected[2]);
        for (i = 0; i < 3; ++i)
            corrected[i] = planner_{s}_alignment[i][0] * w[0] + planner_{s}_alignment[i][1] * w[1]
                         + planner_{s}_alignment[i][2] * w[2];
    }}
""",
    )


def _pairs(terms: Sequence[ExtraTerm]) -> Array:
    """(3, 6) coefficients of the products of two axes on each channel; one axis alone is its square,

    and of vibration rectification all three squares.
    """
    found = np.zeros((3, len(PAIRS)))
    for e in terms:
        channel, *axes = (AXES.index(a) for a in e.term)
        if e.effect == "vibration_rectification":
            pairs = [(j, j) for j in range(3)]
        else:
            pairs = [(axes[0], axes[1]) if axes else (channel, channel)]
        for pair in pairs:
            found[channel, PAIRS.index(pair)] += e.value
    return found


def _matrix(terms: Sequence[ExtraTerm]) -> Array:
    """(3, 3) coefficients of channel by body axis."""
    found = np.zeros((3, 3))
    for e in terms:
        found[AXES.index(e.term[0]), AXES.index(e.term[1])] = e.value
    return found
