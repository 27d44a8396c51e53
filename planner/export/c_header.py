"""A calibration as a C header: arrays and the functions that correct a reading (C99, float, math.h only).

The arrays are those of `firmware`; the functions are the measurement equation solved for the input:

    b = bias(T) + drift dT/dt + warm_up exp(−t/τ) + acceleration · f,   v = (y − b)/slope,   u = M⁻¹ v

A temperature that none can be, NaN too, is a dead sensor: then the tables are those at `fallback` (K 4.3.2).
Tables over load and input (`firmware_curves`) and products of conditions (`firmware_products`) add to b, to
the slope and to M where the calibration has them.
"""

from __future__ import annotations

import numpy as np

from planner.export.firmware import FirmwareTables, Float32, firmware_tables
from planner.nouns.calibration import Calibration
from planner.nouns.conditions import POSSIBLE_DEGC

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
}
_FUNCTION = """
static inline void planner_correct_{s}(const float raw[3], float temperature_degc,
                                       float temperature_rate_degc_min, float time_on_s,
                                       const float acceleration_g[3], float corrected[3])
{{
    const float *node = planner_{s}_temperature;
    const int last = PLANNER_{S}_NODES - 1;
    float t = temperature_degc, share = 0.0f, v[3];
    int k = 0, i, j;
    if (!(t >= {coldest} && t <= {hottest})) t = temperature_degc = {fallback};
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
{bias}        y = raw[i] - bias;
        {{
            const float (*table)[3] = y < 0.0f ? planner_{s}_minus : planner_{s}_plus;
            slope = table[k][i] + share * (table[n][i] - table[k][i]);
        }}
        v[i] = y / slope;
        for (j = 0; j < 4; ++j) {{
            cubic = planner_{s}_nonlinearity[i] * (v[i] / {full}) * (v[i] / {full});
{slope}            v[i] = y / (slope + cubic);
        }}
    }}
    for (i = 0; i < 3; ++i)
        corrected[i] = planner_{s}_alignment[i][0] * v[0] + planner_{s}_alignment[i][1] * v[1]
                     + planner_{s}_alignment[i][2] * v[2];
{aligned}}}
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
    parts += dict.fromkeys(curve.look_up for tables in every for curve in tables.curves if curve.look_up)
    for tables in every:
        parts += _arrays(tables)
        suffix = _SUFFIX[tables.sensor]
        parts.append(
            _FUNCTION.format(
                s=suffix,
                S=suffix.upper(),
                reach=_literal(tables.reach),
                full=_literal(tables.full_scale),
                coldest=_literal(np.float32(POSSIBLE_DEGC[0])),
                hottest=_literal(np.float32(POSSIBLE_DEGC[1])),
                fallback=_literal(tables.fallback),
                bias="".join(curve.bias.format(s=suffix) for curve in tables.curves),
                slope="".join(curve.slope.format(s=suffix) for curve in tables.curves),
                aligned="".join(curve.aligned.format(s=suffix) for curve in tables.curves),
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
        shape = _SHAPES[name].format(N=nodes)
        lines.append(f"/* {_MEANING[name].format(unit=unit)} */")
        lines.append(f"static const float planner_{suffix}_{name}{shape} = {_initialiser(values)};")
    for curve in tables.curves:
        for name, values in curve.arrays.items():
            shape = "".join(f"[{n}]" for n in values.shape)
            lines.append(f"/* {curve.meaning[name].format(unit=unit)} */")
            lines.append(f"static const float planner_{suffix}_{name}{shape} = {_initialiser(values)};")
    return lines


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
