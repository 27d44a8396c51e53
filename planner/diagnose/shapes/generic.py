"""Generic alternatives: what a channel's reading could vary with when no effect of the library is the cause.

Each is a block of bins or hat functions over one variable of the table (or two). They compete with the
library: one that wins clearly means that something is missing which we cannot name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from planner.diagnose.channels.channel import Channel
from planner.diagnose.shapes.between_nodes import between_nodes
from planner.diagnose.shapes.narrow import LEVEL_RATE
from planner.diagnose.shapes.narrow import MAKERS as NARROW
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Condition, Effect, Sensor
from planner.temperature_table import hats, temperature_nodes
from planner.units import STANDARD_GRAVITY_MPS2

MOST_LEVELS = 12  # of one variable; more nodes would follow single records
MOST_RATES = 24  # a table and a centrifuge together have some twenty rates
MOST_LOADS = 17
COARSE, FINE = 9, 25
NEARLY_ALONG = 0.87  # cosine of 30 degrees: what leans further is on no face
LEAST_APART = 12  # power-ons, below which a ramp is a time since power-on, and a wave of the day anything
FEW = 4  # nodes of one variable where it is multiplied by several others
SAME_HOUR = 1e-6  # of a wave's amplitude, by which it differs from hour to hour
A_NODE = 5  # observations: rows for what varies within a power-on, power-ons for what varies between them
REST_RATE = float(np.radians(1.0))  # the Earth turns 240 times slower, tables do not turn slower than this
SMALL = 0.15  # of the largest load: where a curve that saturates has left its line
_LOADED = 1.5 * STANDARD_GRAVITY_MPS2  # below that a load is not told from gravity
_ONE_G = (0.9 * STANDARD_GRAVITY_MPS2, 1.1 * STANDARD_GRAVITY_MPS2)  # gravity alone, biases beside


@dataclass(frozen=True)
class Generic:
    """A block without a name of its own. varies_with: the variable; columns: (n, k); narrow: from there."""

    varies_with: str
    columns: Array
    narrow: bool = False


def generics(c: Channel, table: DwellTable) -> list[Generic]:
    """The generic alternatives that this table's rows can show on a channel; empty blocks are left out.

    Smooth variables come coarse and fine: few columns see a weak bend, many follow a strong one.
    """
    makers = {**_MAKERS, **_OF_THE_INPUT[c.sensor]}
    found = [Generic(name, columns) for name, make in makers.items() for columns in make(c, table)]
    found += [Generic(name, x, narrow=True) for name, make in NARROW.items() for x in make(c, table)]
    return [g for g in found if g.columns.shape[1] > 0 and np.any(g.columns)]


def levels(values: Array, gap: float, most: int = MOST_LEVELS) -> Array:
    """(k,) middles of the clusters of values that lie further apart than `gap`; thinned to `most`."""
    v = np.sort(values[np.isfinite(values)])
    if len(v) == 0:
        return v
    middles = np.array([float(np.median(part)) for part in np.split(v, np.flatnonzero(np.diff(v) > gap) + 1)])
    if len(middles) > most:
        middles = np.unique(np.quantile(middles, np.linspace(0.0, 1.0, most)))
    return middles


def _hats(values: Array, gap: float, most: int = MOST_LEVELS) -> Array:
    """(n, k − 1) hat functions over the levels of a variable, the first left to the constant."""
    nodes = levels(values, gap, most)
    if len(nodes) < 2:
        return np.empty((len(values), 0))
    return hats(values, nodes, 0.0)[:, 1:]


def _smooth(values: Array, least: float, most: int) -> list[Array]:
    """Hat functions over evenly filled nodes, coarse and fine; none when it moves less than `least`.

    most: nodes that the data can carry; what has as many columns as observations leaves no noise to judge by
    """
    different = np.unique(np.round(values / least) * least)
    if len(different) < 2:
        return []
    found = []
    for count in sorted({min(COARSE, most), min(FINE, most)}):
        if count < 2:
            continue
        nodes = np.quantile(different, np.linspace(0.0, 1.0, min(count, len(different))))
        nodes = np.unique(np.clip(nodes, *_carried(values)))
        found.append(hats(values, nodes, 0.0)[:, 1:])
        if len(different) <= count:
            break
    return found


def _carried(values: Array) -> tuple[float, float]:
    """The ends that several rows carry: a node of one row alone would follow it wherever it lies."""
    rows = np.sort(values)
    k = min(A_NODE, len(rows)) - 1
    return float(rows[k]), float(rows[-1 - k])


def _time_on(c: Channel, table: DwellTable) -> list[Array]:
    return _smooth(table.time_on, 15.0, len(table) // A_NODE)


def _day(c: Channel, table: DwellTable) -> list[Array]:
    return _smooth(table.day, 0.02, len(np.unique(table.run)) // A_NODE)


def _time_of_day(c: Channel, table: DwellTable) -> list[Array]:
    """A wave of one day, whatever its phase: the hall's temperature, the mains, who sits at the bench."""
    if len(np.unique(table.run)) < LEAST_APART:
        return []
    around = 2.0 * np.pi * table.day
    wave = np.column_stack([np.sin(around), np.cos(around)])
    return [wave[:, np.ptp(wave, axis=0) > SAME_HOUR]]  # days without a time have what rounding leaves


def _temperature_rate(c: Channel, table: DwellTable) -> list[Array]:
    return [_hats(table.temperature_rate * 60.0, 0.3)]


def _rate(c: Channel, table: DwellTable) -> list[Array]:
    """Bins of the own rate, of its modulus in any direction, of the other axes' rates; whether it turns.

    And the moduli along the axes, few: a square of the library follows the modulus of another axis roughly.
    """
    if c.sensor != "gyro":
        return _turned(c)
    rate = c.model.conditions.rate
    others = np.concatenate([_hats(rate[:, j], REST_RATE, 7) for j in range(3) if j != c.axis], axis=1)
    own, size = _hats(c.u, REST_RATE, MOST_RATES), np.linalg.norm(rate, axis=1)
    turns = (size > REST_RATE).astype(float)[:, None]
    return [own, _hats(size, REST_RATE, MOST_RATES), others, np.abs(rate), turns]


def _turned(c: Channel) -> list[Array]:
    """What a turn adds to an accelerometer other than by its square, which is a lever arm.

    Bins of how fast it turns are on tables alone. On an arm the rate is the root of the load, and they would
    follow every curve of that.
    """
    rate, force = c.model.conditions.rate, c.model.conditions.specific_force
    size = np.linalg.norm(rate, axis=1)
    if not np.any(size > REST_RATE):
        return []
    on_a_table = np.where(np.linalg.norm(force, axis=1) < _LOADED, size, 0.0)
    return [size[:, None], np.abs(rate), _hats(on_a_table, REST_RATE, MOST_LEVELS)]


def _orientation(c: Channel, table: DwellTable) -> list[Array]:
    """Which way is up; and at rest alone, for a gyro with which way is north."""
    rate = c.model.conditions.rate
    still = np.linalg.norm(rate, axis=1) < REST_RATE
    if still.all() and c.sensor != "gyro":
        return [_ways_up(c)]
    at_rest = [_ways_up(c, still)]
    if c.sensor == "gyro":
        f = c.model.conditions.specific_force
        up = f / np.maximum(np.linalg.norm(f, axis=1, keepdims=True), 1e-9)
        level = rate - up * np.sum(up * rate, axis=1, keepdims=True)
        size = np.linalg.norm(level, axis=1)
        at_rest.append(_ways(level, still & (size > LEVEL_RATE)))
    return [_ways_up(c), np.concatenate(at_rest, axis=1)]


def _ways_up(c: Channel, among: Array | bool = True) -> Array:
    """The six ways up, at one g; one less where they are all there is, for the constant has their sum."""
    f = c.model.conditions.specific_force
    size = np.linalg.norm(f, axis=1)
    return _ways(f, (size > _ONE_G[0]) & (size < _ONE_G[1]) & among)


def _ways(v: Array, there: Array) -> Array:
    """(n, k) along which body axis a vector (n, 3) points, either way, in the rows where it is there."""
    along = np.argmax(np.abs(v), axis=1)
    positive = v[np.arange(len(v)), along] > 0
    size = np.linalg.norm(v, axis=1)
    there = there & (np.abs(v[np.arange(len(v)), along]) > NEARLY_ALONG * size)
    bins = [(there & (along == j) & (positive == s)).astype(float) for j in range(3) for s in (True, False)]
    kept = [b for b in bins if b.any()]
    if len(kept) < 2:
        return np.empty((len(v), 0))
    return np.array(kept[1:] if np.all(np.sum(kept, axis=0) == 1.0) else kept).T


def _specific_force(c: Channel, table: DwellTable) -> list[Array]:
    """Modulus, square and cube of the load along each axis: a centrifuge has too few runs for bins of all.

    An accelerometer's own load has them: where a reading saturates no power of the load does. Moduli of the
    force by themselves, rests included, are few: with the powers of the load alone what faces show of them
    goes to the orientation, and what the arm shows to its days or to a square. So are curves along one axis
    that turn round with it: what saturates is a straight line, roughly, and the table of all axes has twenty.
    """
    force = c.model.conditions.specific_force
    loaded = np.linalg.norm(force, axis=1) > _LOADED
    if not loaded.any():
        return []
    own = _hats(np.where(loaded, c.u, 0.0), _LOADED, MOST_LOADS)
    f = np.where(loaded[:, None], force, 0.0) / np.abs(force[loaded]).max()
    powers, moduli = np.concatenate([np.abs(f), f**2, f**3], axis=1), np.abs(force)
    odd = [_odd(x) for x in force.T if np.ptp(x[loaded]) > _LOADED]
    return [powers, moduli, *odd, own] if c.sensor == "accelerometer" else [powers, moduli, *odd]


def _odd(f: Array) -> Array:
    """(n, 4) of a force along one axis: as far as it is small, itself, its square and cube, signed."""
    x = f / np.abs(f).max()
    return np.column_stack([np.clip(x, -SMALL, SMALL) / SMALL, x, x * np.abs(x), x**3])


def _temperature(c: Channel, table: DwellTable) -> list[Array]:
    """The bias over temperature, and by orientation: bends that a common table does not have.

    And what a sweep shows between the nodes of the table, which every other record about it follows.
    """
    t = (table.temperature_degc - 20.0) / 60.0
    nodes = temperature_nodes(table.temperature_degc)
    plain = hats(table.temperature_degc, nodes, 0.0)[:, 1:] if len(nodes) > 1 else np.empty((len(t), 0))
    ways = _ways_up(c)
    of_the_table = np.concatenate([plain, ways * t[:, None], ways * t[:, None] ** 2], axis=1)
    return [of_the_table, *between_nodes(table.temperature_degc, nodes)]


def _temperature_and_rate(c: Channel, table: DwellTable) -> list[Array]:
    """Even and cubic parts of the input, and the other inputs, that change with temperature."""
    if c.sensor != "gyro":
        return []
    t = (table.temperature_degc - 20.0) / 60.0
    w = c.model.conditions.rate
    shapes = [np.abs(w[:, c.axis]), w[:, c.axis] ** 3]
    shapes += [np.abs(w[:, j]) for j in range(3) if j != c.axis]
    shapes += [w[:, j] for j in range(3) if j != c.axis]
    return [np.array([s * t**k for s in shapes for k in (1, 2)]).T]


def _time_on_and_temperature(c: Channel, table: DwellTable) -> list[Array]:
    """What changes after power-on by another amount at every temperature."""
    if len(np.unique(table.run)) < LEAST_APART:
        return []
    t = (table.temperature_degc - 20.0) / 60.0
    few = _smooth(table.time_on, 15.0, min(FEW, len(table) // A_NODE))[:1]
    return [np.concatenate([columns * (t**k)[:, None] for k in (0, 1, 2)], axis=1) for columns in few]


def _input_over_time_on(c: Channel, table: DwellTable) -> list[Array]:
    """A scale factor that changes after power-on: the own input, about its nodes over the time."""
    return [_own_input(c)[:, None] * columns for columns in _time_on(c, table)[:1]]


def _input_over_days(c: Channel, table: DwellTable) -> list[Array]:
    """A scale factor that changes from day to day; what the other inputs add, not on an arm: that bends."""
    own = [_own_input(c)[:, None] * columns for columns in _day(c, table)[:1]]
    conditions = c.model.conditions
    unloaded = np.linalg.norm(conditions.specific_force, axis=1) < _LOADED
    inputs = conditions.rate if c.sensor == "gyro" else conditions.specific_force
    others = [inputs[:, j] * unloaded for j in range(3) if j != c.axis]
    few = _smooth(table.day, 0.02, min(FEW, len(np.unique(table.run)) // A_NODE))[:1]
    return [*own, *(np.concatenate([x[:, None] * columns for x in others], axis=1) for columns in few)]


def _own_input(c: Channel) -> Array:
    """(n,) that a scale factor multiplies: not the Earth's rate at rest, which shows where north is instead.

    Where rests come before turns a node over the time has rests alone.
    """
    return np.where(np.abs(c.u) > REST_RATE, c.u, 0.0) if c.sensor == "gyro" else c.u


def _bench(c: Channel, table: DwellTable) -> list[Array]:
    if table.bench is None:
        return []
    names = np.unique(table.bench)
    if len(names) < 2:
        return []
    return [np.array([(table.bench == n).astype(float) for n in names[1:]]).T]


VARIES_WITH: Mapping[Condition | None, str] = {
    "rate": "rate",
    "specific_force": "specific_force",
    "temperature_degc": "temperature",
    "temperature_rate": "temperature_rate",
    "time_on": "time_on",
    "day": "day",
}
"""The condition along which an effect runs -> the generic alternative over the same variable."""


OF_TWO: Mapping[frozenset[Condition], str] = {
    frozenset(("time_on", "temperature_degc")): "time_on_and_temperature"
}
"""The two conditions on which an effect depends, and no other -> the generic alternative over both."""


def of_the_sensor(variable: str, sensor: Sensor) -> str:
    """A variable as it is called of a sensor: an accelerometer's input is the load."""
    return "specific_force" if variable == "rate" and sensor == "accelerometer" else variable


def variable_of(effect: Effect, sensor: Sensor) -> str | None:
    """What stays sure of a sensor's effect whose name falls: the variable, or the two, that it follows."""
    one = VARIES_WITH.get(effect.variable)
    return OF_TWO.get(effect.needs, one and of_the_sensor(one, sensor))


_MAKERS: Mapping[str, Callable[[Channel, DwellTable], list[Array]]] = {
    "time_on": _time_on,
    "day": _day,
    "time_of_day": _time_of_day,
    "temperature_rate": _temperature_rate,
    "rate": _rate,
    "orientation": _orientation,
    "specific_force": _specific_force,
    "temperature": _temperature,
    "temperature_and_rate": _temperature_and_rate,
    "time_on_and_temperature": _time_on_and_temperature,
    "bench": _bench,
}
_OF_THE_INPUT: Mapping[Sensor, Mapping[str, Callable[[Channel, DwellTable], list[Array]]]] = {
    "gyro": {"time_on_and_rate": _input_over_time_on, "day_and_rate": _input_over_days},
    "accelerometer": {
        "time_on_and_specific_force": _input_over_time_on,
        "day_and_specific_force": _input_over_days,
    },
}
