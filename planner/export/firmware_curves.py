"""Tables over load, input and rate of temperature in firmware: values at the nodes, and C that looks them up.

A calibration without them has none of this, and its header and image stay as they were.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.effects._rate_table import RateTable
from planner.effects._segments import shares
from planner.effects.drift_curve import TIMES_S
from planner.effects.drift_curve_over_temperature import TEMPERATURES_DEGC, warmer
from planner.effects.load_curve import LOADS_G
from planner.effects.scale_factor_curve import INPUTS
from planner.effects.scale_factor_polynomial import FULL, LEAST
from planner.nouns.array import Array
from planner.nouns.calibration import ExtraTerm
from planner.nouns.conditions import Conditions
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
GRID = """
static inline float planner_place(const float *node, int nodes, float x, int goes_on, int *k)
{
    *k = 0;
    if (nodes < 2) return 0.0f;
    if (!goes_on && x < node[0]) x = node[0];
    if (!goes_on && x > node[nodes - 1]) x = node[nodes - 1];
    while (*k < nodes - 2 && x >= node[*k + 1]) ++*k;
    return (x - node[*k]) / (node[*k + 1] - node[*k]);
}

static inline float planner_grid(const float *time, int times, const float *degc, int degcs,
                                 const float *rate, int rates, const float *value,
                                 float time_on_s, float temperature_degc, float rate_degc_min, int axis)
{
    int a, b, c, corner;
    float sum = 0.0f;
    const float t = planner_place(time, times, time_on_s, 0, &a);
    const float d = planner_place(degc, degcs, temperature_degc, 0, &b);
    const float r = planner_place(rate, rates, rate_degc_min, 1, &c);
    for (corner = 0; corner < 8; ++corner) {
        const int i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
        const float share = (i ? t : 1.0f - t) * (j ? d : 1.0f - d) * (k ? r : 1.0f - r);
        if (share != 0.0f) sum += share * value[(((a + i) * degcs + b + j) * rates + c + k) * 3 + axis];
    }
    return sum;
}
"""


@dataclass(frozen=True)
class FirmwareCurve:
    """One table. number: of its kind in the binary image; arrays: name -> values; meaning: in words

    bias: C that adds to `bias` of axis i; slope: C that adds to `cubic`, the bend of the slope of axis i at
        the input v[i]; aligned: C that turns the input v into `corrected` anew; {s} stands for the sensor;
        look_up: the C function that these call, if any
    """

    number: int
    effects: tuple[str, ...]
    arrays: Mapping[str, Float32]
    meaning: Mapping[str, str]
    bias: str = ""
    slope: str = ""
    aligned: str = ""
    look_up: str = ""


def firmware_curves(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> tuple[FirmwareCurve, ...]:
    """The tables among the terms of a sensor; unit: of its output."""
    there = {e.effect for e in terms}
    made = {
        "load_curve": _load,
        "scale_factor_curve": _scale,
        "scale_factor_polynomial": _polynomial,
        "scale_factor_acceleration": _acceleration,
        "scale_factor_acceleration_squared": _acceleration,
        "drift_curve": _drift,
        "drift_curve_temperature": _drift,
        "drift_curve_over_temperature": _drift_over_temperature,
        "settling": _settling,
    }
    makers = dict.fromkeys(make for effect, make in made.items() if effect in there)
    if any(isinstance(catalog.effects()[effect], RateTable) for effect in there):
        makers[_rate] = None
    return tuple(make(sensor, terms, unit) for make in makers)


def _values(effect: str, sensor: Sensor, terms: Sequence[ExtraTerm]) -> Array:
    """(n_terms,) coefficients in the effect's order, SI; zero where the calibration has none."""
    found = {e.term: e.value for e in terms if e.effect == effect}
    return np.array([found.get(t.name, 0.0) for t in catalog.effects()[effect].terms(sensor)])


def _load(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> FirmwareCurve:
    found = _values("load_curve", sensor, terms).reshape(3, 3, -1) / unit_factor(unit)[0]
    line = np.stack([found[:, :, :1], -found[:, :, :1]], axis=2)
    rises = np.concatenate([line, found[:, :, 1:].reshape(3, 3, 2, -1)], axis=3)
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
        look_up=LOOK_UP,
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
        look_up=LOOK_UP,
    )


def _polynomial(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> FirmwareCurve:
    """Slope over the size of the input in U, c1 x + c2 x² for + and for − input."""
    found = _values("scale_factor_polynomial", sensor, terms).reshape(3, 2, 2)
    full = FULL[sensor] / unit_factor(unit)[0]
    return FirmwareCurve(
        7,
        ("scale_factor_polynomial",),
        {"scale_polynomial": found.astype(np.float32)},
        {"scale_polynomial": f"added to the slope per share of {full:g} {unit}, its square: axis, + and -"},
        slope=f"""\
            {{{{
                const float *c = planner_{{s}}_scale_polynomial[i][v[i] < 0.0f];
                const float x = fminf(fabsf(v[i]) / {full:.1f}f - {LEAST!r}f, 1.0f);
                if (x > 0.0f) cubic += x * (c[0] + x * c[1]);
            }}}}
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


def _drift(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> FirmwareCurve:
    """Drift over time since power-on, and its change per kelvin from 20 degC."""
    names = ("drift_curve", "drift_curve_temperature")
    n = len(TIMES_S)
    found = []
    for name in names:
        rises = _values(name, sensor, terms).reshape(3, n - 1) / unit_factor(unit)[0]
        found.append(np.concatenate([np.zeros((3, 1)), np.cumsum(rises, axis=1)], axis=1))
    return FirmwareCurve(
        5,
        names,
        {
            "time_node": np.array(TIMES_S, dtype=np.float32),
            "time_curve": found[0].astype(np.float32),
            "time_curve_per_k": found[1].astype(np.float32),
        },
        {
            "time_node": "s since power-on",
            "time_curve": "{unit} of drift at these times, at 20 degC",
            "time_curve_per_k": "its change per kelvin",
        },
        bias=f"""\
        bias += planner_curve(planner_{{s}}_time_node, planner_{{s}}_time_curve[i], {n}, time_on_s)
              + (temperature_degc - 20.0f) * planner_curve(planner_{{s}}_time_node,
                                                          planner_{{s}}_time_curve_per_k[i], {n}, time_on_s);
""",
        look_up=LOOK_UP,
    )


def _drift_over_temperature(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> FirmwareCurve:
    """K's `drGX`: drift over temperatures and times, zero at 20 degC, where the drift over time stands."""
    degc, time = np.array(TEMPERATURES_DEGC), np.array(TIMES_S)
    rises = _values("drift_curve_over_temperature", sensor, terms).reshape(3, len(degc) - 1, len(time) - 1)
    table = np.einsum("mj,ajk,qk->qma", warmer(degc), rises / unit_factor(unit)[0], shares(time, TIMES_S))
    return FirmwareCurve(
        8,
        ("drift_curve_over_temperature",),
        {
            "drift_time": time.astype(np.float32),
            "drift_temperature": degc.astype(np.float32),
            "drift_table": table.astype(np.float32),
        },
        {
            "drift_time": "s since power-on",
            "drift_temperature": "temperatures, degC",
            "drift_table": "{unit} more drift than at 20 degC: time, temperature, axis",
        },
        bias=f"""\
        bias += planner_grid(planner_{{s}}_drift_time, {len(time)},
                             planner_{{s}}_drift_temperature, {len(degc)},
                             planner_{{s}}_drift_temperature, 1, &planner_{{s}}_drift_table[0][0][0],
                             time_on_s, temperature_degc, 0.0f, i);
""",
        look_up=GRID,
    )


def _settling(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> FirmwareCurve:
    default = catalog.effects()["settling"].nonlinear
    found = np.array([[0.0, default["time_constant"]]] * 3)
    for e in terms:
        if e.effect == "settling":
            shape = {**default, **e.nonlinear}
            found["xyz".index(e.term)] = e.value / unit_factor(unit)[0], shape["time_constant"]
    return FirmwareCurve(
        6,
        ("settling",),
        {"settling": found.astype(np.float32)},
        {"settling": "{unit} from the initial bias to the settled one, and its time constant in s"},
        bias="""\
        bias -= planner_{s}_settling[i][0] * expm1f(-time_on_s / planner_{s}_settling[i][1]);
""",
    )


def _rate(sensor: Sensor, terms: Sequence[ExtraTerm], unit: str) -> FirmwareCurve:
    """All tables over temperature and its rate as one, on the nodes of all: on these each is exact."""
    known = catalog.effects()
    tables = {e.effect: t for e in terms if isinstance(t := known[e.effect], RateTable)}
    degc = np.unique([x for t in tables.values() for x in t.temperatures])
    rate = np.unique([x for t in tables.values() for x in (*t.rates, 0.0)])
    time = np.unique([x for t in tables.values() for x in t.times or (0.0,)])
    on, T, r = (x.ravel() for x in np.meshgrid(time, degc, rate, indexing="ij"))
    at_rest = np.zeros((len(on), 3))
    nodes = Conditions(at_rest, at_rest, T, r / 60.0, on, np.zeros(len(on)))
    bias = sum(t.regressors(sensor, nodes) @ _values(name, sensor, terms) for name, t in tables.items())
    shape = (len(time), len(degc), len(rate))
    named = {"time": time, "temperature": degc, "rate": rate, "bias": bias / unit_factor(unit)[0]}
    arrays = {f"ramp_{name}": np.asarray(x, dtype=np.float32) for name, x in named.items()}
    return FirmwareCurve(
        4,
        tuple(tables),
        {
            "ramp_shape": np.array(shape, dtype=np.float32),
            **arrays,
            "ramp_bias": arrays["ramp_bias"].reshape(*shape, 3),
        },
        {
            "ramp_shape": "how many times, temperatures and rates the table over the rate of temperature has",
            "ramp_time": "times since power-on, s",
            "ramp_temperature": "temperatures, degC",
            "ramp_rate": "rates, K/min; beyond them it goes on",
            "ramp_bias": "{unit} on top of the bias at a steady temperature",
        },
        bias=f"""\
        bias += planner_grid(planner_{{s}}_ramp_time, {shape[0]}, planner_{{s}}_ramp_temperature, {shape[1]},
                             planner_{{s}}_ramp_rate, {shape[2]}, &planner_{{s}}_ramp_bias[0][0][0][0],
                             time_on_s, temperature_degc, temperature_rate_degc_min, i);
""",
        look_up=GRID,
    )
