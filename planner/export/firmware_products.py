"""Products of inputs, temperature and time since power-on in firmware: coefficients, and C that adds them.

The inputs of a bias are those that `apply` takes: the readings of the sensor itself, and the corrected
specific force for the gyros (`calibrate.correction`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.effects.cross_coupling import PAIRS
from planner.export.extra_terms import ExtraTerms
from planner.export.firmware_curves import FirmwareCurve
from planner.nouns.array import Array
from planner.nouns.calibration import ExtraTerm
from planner.protocols import Sensor
from planner.units import unit_factor

OVER_FORCE = ("g_squared_sensitivity", "g_product_sensitivity", "vibration_rectification")
_SUM = """\
        for (j = 0; j < 6; ++j) {{{{
            static const int one[6] = {{{{0, 0, 0, 1, 1, 2}}}}, other[6] = {{{{0, 1, 2, 1, 2, 2}}}};
            bias += planner_{{s}}_{name}[i][j] * {x}[one[j]] * {x}[other[j]];
        }}}}
"""


def firmware_products(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> tuple[FirmwareCurve, ...]:
    """The terms of a sensor that are products of its conditions; unit: of its output."""
    found, made = ExtraTerms(terms), list[FirmwareCurve]()
    of_forces = OVER_FORCE if sensor == "gyro" else (*OVER_FORCE, "cross_coupling")  # it senses forces
    there = tuple(name for name in of_forces if found.of(name))
    if found.of("drift"):
        made.append(_drift(found, unit))
    if there:
        made.append(_over_force(there, found, unit))
    if sensor == "gyro" and found.of("cross_coupling"):
        made.append(_over_rates(found, unit))
    if found.of("g_sensitivity_temperature"):
        made.append(_force_over_temperature(found, unit))
    if found.of("misalignment_temperature"):
        made.append(_alignment_over_temperature(found))
    return tuple(made)


def _drift(found: ExtraTerms, unit: str) -> FirmwareCurve:
    per_hour = found.channels("drift") / unit_factor(f"{unit}/h")[0]
    return FirmwareCurve(
        9,
        ("drift",),
        {"time_slope": per_hour.astype(np.float32)},
        {"time_slope": "{unit} of drift per hour since power-on"},
        bias="        bias += planner_{s}_time_slope[i] * time_on_s / 3600.0f;\n",
    )


def _over_force(names: tuple[str, ...], found: ExtraTerms, unit: str) -> FirmwareCurve:
    values = sum(_of_forces(name, found) for name in names) / unit_factor(f"{unit}/g**2")[0]
    return FirmwareCurve(
        10,
        names,
        {"force_product": np.asarray(values, dtype=np.float32)},
        {"force_product": "{unit} per g squared of the products xx xy xz yy yz zz of the specific force"},
        bias=_SUM.format(name="force_product", x="acceleration_g"),
    )


def _of_forces(name: str, found: ExtraTerms) -> Array:
    """(3, 6) bias of each channel per product of two forces, SI."""
    squares = [PAIRS.index((j, j)) for j in range(3)]
    values = np.zeros((3, len(PAIRS)))
    if name == "g_squared_sensitivity":
        values[range(3), squares] = found.channels(name)
    elif name == "vibration_rectification":  # of |f|²
        values[:, squares] = found.channels(name)[:, None]
    else:
        values = found.products(name)
    return values


def _over_rates(found: ExtraTerms, unit: str) -> FirmwareCurve:
    values = found.products("cross_coupling") * unit_factor(unit)[0]  # per rate: u_j u_k / unit
    return FirmwareCurve(
        11,
        ("cross_coupling",),
        {"rate_product": values.astype(np.float32)},
        {"rate_product": "{unit} per product xx xy xz yy yz zz of two rates in {unit}"},
        bias=_SUM.format(name="rate_product", x="raw"),
    )


def _force_over_temperature(found: ExtraTerms, unit: str) -> FirmwareCurve:
    values = found.matrix("g_sensitivity_temperature") / unit_factor(f"{unit}/g/K")[0]
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


def _alignment_over_temperature(found: ExtraTerms) -> FirmwareCurve:
    """u = M⁻¹ (v − (T − 20 °C) M' u) by repetition: M' is some 1e-5 rad/K."""
    return FirmwareCurve(
        13,
        ("misalignment_temperature",),
        {"misalignment_per_k": found.matrix("misalignment_temperature").astype(np.float32)},
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
