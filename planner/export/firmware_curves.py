"""Tables over load and input in firmware: arrays of their values at the nodes, and the C that looks them up.

A calibration without them has none of this, and its header and image stay as they were.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.effects.load_curve import LOADS_G
from planner.effects.scale_factor_curve import INPUTS
from planner.nouns.array import Array
from planner.nouns.calibration import ExtraTerm
from planner.protocols import Sensor
from planner.units import unit_factor

Float32 = NDArray[np.float32]
LOOK_UP = """
static inline float planner_curve(const float *node, const float *value, int nodes, float x)
{
    int k = 0;
    if (x <= node[0]) return value[0];
    if (x >= node[nodes - 1]) return value[nodes - 1];
    while (x >= node[k + 1]) ++k;
    return value[k] + (value[k + 1] - value[k]) * (x - node[k]) / (node[k + 1] - node[k]);
}
"""


@dataclass(frozen=True)
class FirmwareCurve:
    """One table. number: of its kind in the binary image; arrays: name -> values; meaning: in words

    bias: C that adds to `bias` of axis i; slope: C that adds to `cubic`, the bend of the slope of axis i at
        the input v[i]; {s} stands for the sensor
    """

    number: int
    effects: tuple[str, ...]
    arrays: Mapping[str, Float32]
    meaning: Mapping[str, str]
    bias: str = ""
    slope: str = ""


def firmware_curves(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> tuple[FirmwareCurve, ...]:
    """The tables among the terms of a sensor; unit: of its output."""
    there = {e.effect for e in terms}
    made = {
        "load_curve": _load,
        "scale_factor_curve": _scale,
        "scale_factor_acceleration": _acceleration,
        "scale_factor_acceleration_squared": _acceleration,
    }
    makers = dict.fromkeys(make for effect, make in made.items() if effect in there)
    return tuple(make(sensor, terms, unit) for make in makers)


def _values(effect: str, sensor: Sensor, terms: Sequence[ExtraTerm]) -> Array:
    """(n_terms,) coefficients in the effect's order, SI; zero where the calibration has none."""
    found = {e.term: e.value for e in terms if e.effect == effect}
    return np.array([found.get(t.name, 0.0) for t in catalog.effects()[effect].terms(sensor)])


def _load(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> FirmwareCurve:
    rises = _values("load_curve", sensor, terms).reshape(3, 3, 2, -1) / unit_factor(unit)[0]
    curve = np.concatenate([np.zeros((3, 3, 2, 1)), np.cumsum(rises, axis=3)], axis=3)
    n = len(LOADS_G)
    return FirmwareCurve(
        1,
        ("load_curve",),
        {"load_node": np.array(LOADS_G, dtype=np.float32), "load_curve": curve.astype(np.float32)},
        {
            "load_node": "loads, g",
            "load_curve": "{unit} at the loads: axis, axis of the load, + and -",
        },
        bias=f"""\
        for (j = 0; j < 3; ++j)
            bias += planner_curve(planner_{{s}}_load_node,
                                  planner_{{s}}_load_curve[i][j][acceleration_g[j] < 0.0f],
                                  {n}, fabsf(acceleration_g[j]));
""",
    )


def _scale(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> FirmwareCurve:
    rises = _values("scale_factor_curve", sensor, terms).reshape(3, 2, -1)
    to_the_end = np.cumsum(rises[:, :, ::-1], axis=2)[:, :, ::-1]
    curve = np.concatenate([to_the_end, np.zeros((3, 2, 1))], axis=2)
    n = len(INPUTS[sensor])
    return FirmwareCurve(
        2,
        ("scale_factor_curve",),
        {"input_node": np.array(INPUTS[sensor], dtype=np.float32), "scale_curve": curve.astype(np.float32)},
        {"input_node": "inputs, {unit}", "scale_curve": "added to the slope at the inputs: axis, + and -"},
        slope=f"""\
            cubic += planner_curve(planner_{{s}}_input_node, planner_{{s}}_scale_curve[i][v[i] < 0.0f],
                                   {n}, fabsf(v[i]));
""",
    )


def _acceleration(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> FirmwareCurve:
    """Slope over the modulus of the load, k1 a + k2 a²; an accelerometer's over its own input."""
    names = ["scale_factor_acceleration"]
    names += ["scale_factor_acceleration_squared"] if sensor == "gyro" else []
    g = unit_factor("g")[0]
    found = np.zeros((3, 2))
    for power, name in enumerate(names):
        found[:, power] = _values(name, sensor, terms) * g ** (power + 1)
    modulus = (
        "sqrtf(acceleration_g[0] * acceleration_g[0] + acceleration_g[1] * acceleration_g[1]"
        " + acceleration_g[2] * acceleration_g[2])"
        if sensor == "gyro"
        else "fabsf(v[i])"
    )
    return FirmwareCurve(
        3,
        tuple(names),
        {"scale_acceleration": found.astype(np.float32)},
        {"scale_acceleration": "added to the slope per g and per g squared of the load"},
        slope=f"""\
            {{{{
                const float load = {modulus};
                cubic += load * (planner_{{s}}_scale_acceleration[i][0]
                                 + load * planner_{{s}}_scale_acceleration[i][1]);
            }}}}
""",
    )
