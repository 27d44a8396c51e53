"""A calibration as a C header: arrays and the functions that correct a reading (C99, float, math.h only).

The arrays are those of `firmware`; the functions are the measurement equation solved for the input:

    b = bias(T) + drift dT/dt + warm_up exp(−t/τ) + acceleration · f + ramp(T, dT/dt, t)
    v = (y − b)/slope,   u = M⁻¹ v

`ramp` stands there when the calibration has a table over the rate of temperature.
"""

from __future__ import annotations

import numpy as np

from planner.export.firmware import FirmwareTables, Float32, firmware_tables
from planner.nouns.calibration import Calibration

_SUFFIX = {"gyro": "gyro", "accelerometer": "acc"}
_UNIT = {"gyro": "deg/s", "accelerometer": "g"}
_SHAPES = {
    "temperature": "[{N}]",
    "bias": "[{N}][3]",
    "plus": "[{N}][3]",
    "minus": "[{N}][3]",
    "drift": "[3]",
    "warm_up": "[3]",
    "time_constant": "[3]",
    "acceleration": "[3][3]",
    "nonlinearity": "[3]",
    "alignment": "[3][3]",
    "ramp_temperature": "[{R}]",
    "ramp_rate": "[{Q}]",
    "ramp_time": "[{P}]",
    "ramp_bias": "[{P}][{R}][{Q}][3]",
}
_MEANING = {
    "temperature": "nodes, degC",
    "bias": "{unit} at the nodes, axes x y z",
    "plus": "slope for + input at the nodes",
    "minus": "slope for - input at the nodes",
    "drift": "{unit} per K/min of temperature rate",
    "warm_up": "{unit} at power-on, dies out with time_constant",
    "time_constant": "s",
    "acceleration": "{unit} per g of body axes x y z",
    "nonlinearity": "cubic part of the slope at full scale",
    "alignment": "inverse of the misalignment matrix",
    "ramp_temperature": "nodes of the table over the rate of temperature, degC",
    "ramp_rate": "its rates, K/min; beyond them it goes on",
    "ramp_time": "its times since power-on, s",
    "ramp_bias": "{unit} on top of the bias at a steady temperature",
}
_PLACE = """
static inline float planner_place(const float *node, int nodes, float x, int goes_on, int *k)
{
    *k = 0;
    if (nodes < 2) return 0.0f;
    if (!goes_on && x < node[0]) x = node[0];
    if (!goes_on && x > node[nodes - 1]) x = node[nodes - 1];
    while (*k < nodes - 2 && x >= node[*k + 1]) ++*k;
    return (x - node[*k]) / (node[*k + 1] - node[*k]);
}
"""
_RAMP = """
static inline float planner_{s}_ramp(int axis, float temperature_degc, float rate_degc_min, float time_on_s)
{{
    int a, b, c, corner;
    float sum = 0.0f;
    const float t = planner_place(planner_{s}_ramp_time, {P}, time_on_s, 0, &a);
    const float d = planner_place(planner_{s}_ramp_temperature, {R}, temperature_degc, 0, &b);
    const float r = planner_place(planner_{s}_ramp_rate, {Q}, rate_degc_min, 1, &c);
    for (corner = 0; corner < 8; ++corner) {{
        const int i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
        const float share = (i ? t : 1.0f - t) * (j ? d : 1.0f - d) * (k ? r : 1.0f - r);
        if (share != 0.0f) sum += share * planner_{s}_ramp_bias[a + i][b + j][c + k][axis];
    }}
    return sum;
}}
"""
_FUNCTION = """
static inline void planner_correct_{s}(const float raw[3], float temperature_degc,
                                       float temperature_rate_degc_min, float time_on_s,
                                       const float acceleration_g[3], float corrected[3])
{{
    const float *node = planner_{s}_temperature;
    const int last = PLANNER_{S}_NODES - 1;
    float t = temperature_degc, share = 0.0f, v[3];
    int k = 0, i, j;
    if (t < node[0] - {reach}) t = node[0] - {reach};
    if (t > node[last] + {reach}) t = node[last] + {reach};
    while (k < last - 1 && t >= node[k + 1]) ++k;
    if (last > 0) share = (t - node[k]) / (node[k + 1] - node[k]);
    for (i = 0; i < 3; ++i) {{
        const int n = last > 0 ? k + 1 : k;
        float bias = planner_{s}_bias[k][i] + share * (planner_{s}_bias[n][i] - planner_{s}_bias[k][i]);
        float y, slope, cubic = 0.0f;
        bias += planner_{s}_drift[i] * temperature_rate_degc_min;
        bias += planner_{s}_warm_up[i] * expf(-time_on_s / planner_{s}_time_constant[i]);
        for (j = 0; j < 3; ++j) bias += planner_{s}_acceleration[i][j] * acceleration_g[j];
{ramp}        y = raw[i] - bias;
        {{
            const float (*table)[3] = y < 0.0f ? planner_{s}_minus : planner_{s}_plus;
            slope = table[k][i] + share * (table[n][i] - table[k][i]);
        }}
        v[i] = y / slope;
        for (j = 0; j < 4; ++j) {{
            cubic = planner_{s}_nonlinearity[i] * (v[i] / {full}) * (v[i] / {full});
            v[i] = y / (slope + cubic);
        }}
    }}
    for (i = 0; i < 3; ++i)
        corrected[i] = planner_{s}_alignment[i][0] * v[0] + planner_{s}_alignment[i][1] * v[1]
                     + planner_{s}_alignment[i][2] * v[2];
}}
"""


_RAMP_CALL = """\
        bias += planner_{s}_ramp(i, temperature_degc, temperature_rate_degc_min, time_on_s);
"""


def c_header(calibration: Calibration) -> str:
    """The header's text. Same calibration, same bytes."""
    parts = [
        f"/* Calibration of unit {_plain(calibration.unit)}, written by planner {calibration.version}.",
        f"   Data: {_plain(calibration.source)}.",
        "   Gyros in deg/s, accelerometers in g, temperatures in degC. */",
        "#ifndef PLANNER_CALIBRATION_H",
        "#define PLANNER_CALIBRATION_H",
        "#include <math.h>",
    ]
    every = firmware_tables(calibration)
    parts += [_PLACE] if any(tables.ramp is not None for tables in every) else []
    for tables in every:
        parts += _arrays(tables)
        suffix = _SUFFIX[tables.sensor]
        parts += [] if tables.ramp is None else [_RAMP.format(s=suffix, **_ramp_nodes(tables))]
        parts.append(
            _FUNCTION.format(
                s=suffix,
                S=suffix.upper(),
                reach=_literal(tables.reach),
                full=_literal(tables.full_scale),
                ramp="" if tables.ramp is None else _RAMP_CALL.format(s=suffix),
            )
        )
    return "\n".join([*parts, "#endif", ""])


def _arrays(tables: FirmwareTables) -> list[str]:
    suffix, unit = _SUFFIX[tables.sensor], _UNIT[tables.sensor]
    nodes = f"PLANNER_{suffix.upper()}_NODES"
    lines = ["", f"#define {nodes} {len(tables.temperature)}"]
    if tables.left_out:
        lines += ["/* Not in these arrays, so not corrected here:", *(f"   {one}" for one in tables.left_out)]
        lines += ["   over the table's temperatures, 2 h of power-on, a year, 500 deg/s, 50 g. */"]
    for name, values in tables.arrays().items():
        shape = _SHAPES[name].format(N=nodes, **_ramp_nodes(tables))
        lines.append(f"/* {_MEANING[name].format(unit=unit)} */")
        lines.append(f"static const float planner_{suffix}_{name}{shape} = {_initialiser(values)};")
    return lines


def _ramp_nodes(tables: FirmwareTables) -> dict[str, int]:
    """How many nodes the table over the rate of temperature has: R temperatures, Q rates, P times."""
    ramp = tables.ramp
    return {} if ramp is None else {"R": len(ramp.temperature), "Q": len(ramp.rate), "P": len(ramp.time)}


def _initialiser(values: Float32) -> str:
    if values.ndim == 1:
        return "{" + ", ".join(_literal(v) for v in values) + "}"
    return "{" + ",\n  ".join(_initialiser(row) for row in values) + "}"


def _literal(value: np.float32) -> str:
    """Nine digits give a float back to the last bit."""
    text = f"{float(value):.9g}"
    return (text if any(c in text for c in ".e") else text + ".0") + "f"


def _plain(text: str) -> str:
    """Text that cannot end a comment."""
    return "".join(c if c.isprintable() else " " for c in text).replace("*/", "* /").replace("/*", "/ *")
