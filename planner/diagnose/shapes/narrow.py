"""Narrow alternatives without a name: a few columns for courses of which wide bins see too little.

A wave over twenty power-ons, a gyro that locks in at small rates, an axis that leans as the case warms:
bins of the variable have as many columns as it has levels, and by the criterion each costs log n. They are
asked beside those bins, and of the likelihood where the noise is judged; its full model goes without them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.effects._history import power_ons
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, over_records
from planner.nouns.dwell_table import DwellTable
from planner.temperature_table import hats, temperature_nodes
from planner.units import STANDARD_GRAVITY_MPS2

CYCLES = (1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0)  # of a wave over all the days
A_CYCLE = 6  # power-ons for each of them
CYCLES_ON = (1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0)  # of one over the time since power-on
A_TIME = 6  # different times for each of them
CORNERS = (0.1, 0.2, 0.35, 0.5, 0.65, 0.8)  # of the largest input: beyond the last is hardly a record
A_LEVEL = 0.03  # of it, by which levels differ
LEAST_APART = 12  # power-ons, below which a wave of the days is anything
LEAST_DAYS = 1.0
SMALL_RATES = (0.02, 0.1, 0.4)  # of the largest rate: up to where a gyro locks in, or leaves its line
LEAST_RATES = 8  # different ones, fewer of which bins follow as well
A_RATE = float(np.radians(1.0))  # by which rates differ; the Earth turns 240 times slower
A_BEND = 3  # nodes of temperature, fewer of which show none
LEVEL_RATE = float(np.radians(1e-3))  # of the Earth's 4.2e-3 deg/s, from which it names a north
LEAST_HEADINGS = 7  # different parts of north along a body axis, of 21 from −1 to 1
A_LEANING = 0.1  # of g, by which attitudes differ along an axis
LEAST_LEANINGS = 7  # different ones along an axis, fewer of which a few powers follow as well
A_CORNER = 0.02  # of the largest column, below which one has no more than leans and rounding
OWN_NODES = (-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0)  # g
FACES = 3  # forces along an axis: up, level and down
BETWEEN = 3  # sizes of it: none, all of it, and one between, where its modulus is no square of it
OF_ITSELF = 0.5  # of a product of three forces, that no product of two has
PLAYS = (0.1, 0.2, 0.3)  # of the largest input
LEAST_PLAYED = 5  # inputs, as two ways up and a rest have fewer
TILTED = 3  # different values of a product of three forces: either sign, and none on a face
MODULUS_NODES = (0.0, 0.3, 0.6, 1.0)  # g
PLACES = 12  # at which a reading may step after power-on: the rows between two of them hide little of it
A_SIDE = 5  # rows that such a step has on either side, and power-ons
_LOADED = 1.5 * STANDARD_GRAVITY_MPS2  # below that a load is not told from gravity


def waves(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 2) sine and cosine over the days of the table, slow and quick ones, as power-ons show them.

    None of less than two days of work a cycle (Nyquist): every such wave is another one, or a step.
    """
    runs, span = len(np.unique(table.run)), float(np.ptp(table.day))
    if runs < LEAST_APART or span < LEAST_DAYS:
        return []
    turns = (table.day - table.day.min()) / span
    days = len(np.unique(np.round(table.day, 2)))
    around = [2.0 * np.pi * k * turns for k in CYCLES if k * A_CYCLE <= runs and 2.0 * k < days]
    return [np.column_stack([np.sin(x), np.cos(x)]) for x in around]


def waves_after_power_on(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 2) sine and cosine over the time since power-on: a heater's controller swings, the same every time.

    A table of the library over the time follows such a wave by five segments, and was its name; of less than
    eight sigma neither that nor eight bins were worth their columns, and nothing was said.
    """
    t, span = table.time_on, float(np.ptp(table.time_on))
    if len(np.unique(table.run)) < LEAST_APART or span <= 0.0:
        return []
    turns, times = (t - t.min()) / span, len(np.unique(np.round(t)))
    around = [2.0 * np.pi * k * turns for k in CYCLES_ON if A_TIME * k <= times]
    return [np.column_stack([np.sin(x), np.cos(x)]) for x in around]


def steps_after_power_on(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 1) each: whether a time has passed since power-on, at some times; a heater or a filter switches.

    Half of such a step is a straight line, and by bins of the time, which cost eight columns, it is that.
    """
    t, runs = table.time_on, np.unique(table.run)
    ends = np.sort(t)[[A_SIDE - 1, -A_SIDE]] if len(t) >= 2 * A_SIDE else t[:0]
    if len(runs) < A_SIDE or len(ends) == 0 or ends[0] >= ends[1]:
        return []
    places = np.unique(np.quantile(t, np.linspace(0.0, 1.0, PLACES + 2)[1:-1]))
    later = [t > at for at in places if ends[0] <= at < ends[1]]
    return [x[:, None].astype(float) for x in later if _within(x, table.run) >= A_SIDE]


def _within(later: NDArray[np.bool_], run: NDArray[np.int64]) -> int:
    """How many power-ons have rows on both sides: what only differs between them is no step within."""
    return len(np.intersect1d(run[later], run[~later]))


def input_over_time(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 1) the own input times the time since power-on: a scale factor that drifts while the unit is on.

    Nodes of the time cost eight columns, and by the likelihood a scale factor that wanders in every power-on,
    one variance, was the cheaper word for what all of them do alike.
    """
    u = _turning(c) if c.sensor == "gyro" else c.u
    span = float(np.ptp(table.time_on))
    if len(np.unique(table.run)) < LEAST_APART or span <= 0.0 or not np.any(u):
        return []
    return [(u * (table.time_on - table.time_on.mean()) / span)[:, None]]


def odd_courses(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 5) of a gyro's own rate x: itself held at small sizes, x |x| and x³."""
    x = _turning(c)
    if c.sensor != "gyro" or len(np.unique(np.round(x / A_RATE))) < LEAST_RATES:
        return []
    x = x / np.abs(x).max()
    return [np.column_stack([*(np.clip(x, -k, k) / k for k in SMALL_RATES), x * np.abs(x), x**3])]


def beyond_corners(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 1) each: what of the own input lies beyond a share of the largest, signed.

        sign(u) max(|u| − k U, 0),   two levels of |u| beyond k U and one within

    A reading that saturates, or sticks below some input: by the bins of all levels, ten columns, such a one
    was a cubic, or the load times the rate.
    """
    u = _turning(c) if c.sensor == "gyro" else c.u
    size = np.abs(u) / np.abs(u).max(initial=1e-300)
    levels = np.unique(np.round(size / A_LEVEL)) * A_LEVEL
    within = [k for k in CORNERS if np.sum(levels > k) > 1 and np.any((levels > 0.0) & (levels <= k))]
    return [(np.sign(u) * np.maximum(size - k, 0.0))[:, None] for k in within]


def rate_under_load(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 3) a scale factor that goes with the load, signed: a gyro's own rate times each force.

    Gravity alone is up or down, as the turns are: only an arm tells the one from the other.
    """
    force = c.model.conditions.specific_force
    if c.sensor != "gyro" or not np.any(np.linalg.norm(force, axis=1) > _LOADED):
        return []
    return [_turning(c)[:, None] * force]


def heading_at_rest(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 3) where north lies in the level of a gyro's rests, in body axes: what a magnetic field does to it.

    Of headings in between no bin of the six ways has the sine. Where north lies along a body axis in every
    rest these bins are as good, and on six faces such a one is a square of the force.
    """
    rate, force = c.model.conditions.rate, c.model.conditions.specific_force
    up = force / np.maximum(np.linalg.norm(force, axis=1, keepdims=True), 1e-9)
    level = rate - up * np.sum(up * rate, axis=1, keepdims=True)
    size = np.linalg.norm(level, axis=1)
    rests = (np.linalg.norm(rate, axis=1) < A_RATE) & (size > LEVEL_RATE)
    north = level * (rests / np.where(rests, size, 1.0))[:, None]
    if c.sensor != "gyro" or max(_leanings(x) for x in north.T) < LEAST_HEADINGS:
        return []
    return [north]


def leaning(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 4) the forces across an accelerometer, in any attitude, times the temperature and its square."""
    if c.sensor != "accelerometer" or len(temperature_nodes(table.temperature_degc)) < A_BEND:
        return []
    t = ((table.temperature_degc - 20.0) / 60.0)[:, None]
    across = np.delete(c.model.conditions.specific_force, c.axis, axis=1)
    return [np.concatenate([across * t, across * t**2], axis=1)]


def force_over_days(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 3) a gyro's sensitivity to forces that changes from day to day: each force times the days."""
    span = float(np.ptp(table.day))
    if c.sensor != "gyro" or span < LEAST_DAYS or len(np.unique(table.run)) < LEAST_APART:
        return []
    return [c.model.conditions.specific_force * ((table.day - table.day.mean()) / span)[:, None]]


def gravity_along_axes(c: Channel, table: DwellTable) -> list[Array]:
    """(n, k) curves of the force in many attitudes: over an accelerometer's own, and |f_j| of an axis.

    Three powers of gravity were named for one bend, and a product of two axes for the root of one of them:
    on six faces they are the same, and no curve is asked. Of a gyro an axis has an odd curve besides: what
    begins at half a g is a straight line, roughly, and bins of the attitude do not see where it bends.

    Beside loads an accelerometer's own curve is asked, and is beyond a g what it is there; on six faces too,
    where the loads say what its scale factor is. One that sticks at small forces is off by as much at one g
    as at fifty, and of that no power of the load knows.
    """
    along = c.model.conditions.specific_force / STANDARD_GRAVITY_MPS2
    loaded = np.linalg.norm(along, axis=1) * STANDARD_GRAVITY_MPS2 > _LOADED
    gravity, accelerometer = along[~loaded], c.sensor == "accelerometer"
    found = []
    if accelerometer and _leanings(gravity[:, c.axis]) >= LEAST_LEANINGS:
        found.append(_over_force(c, c.axis, OWN_NODES))
    if accelerometer and loaded.any() and _leanings(gravity[:, c.axis]) >= FACES:
        found.append(_within_a_g(c))
    if loaded.any():
        return found
    each = [j for j in range(3) if _leanings(np.abs(along[:, j])) >= BETWEEN]
    odd = [j for j in range(3) if not accelerometer and _leanings(along[:, j]) >= LEAST_LEANINGS]
    return [*found, *(_over_force(c, j, MODULUS_NODES) for j in each), *(_odd_force(c, j) for j in odd)]


def cubic_products(c: Channel, table: DwellTable) -> list[Array]:
    """(n, ≤ 7) f_j² f_k of two axes, f_x f_y f_z, of the force in g in tilted attitudes or on an arm.

    They are nothing on six faces, and odd: no product of two forces, no curve along one axis and no bin of
    the six ways up has them, so that an error of this kind was a few records off by themselves, or noise.
    Of an accelerometer they are clear of what a lean of its own does. On an arm whose axis always points up
    f_j² f_k is the square of the load: beside loads they are asked where one of them is no product of two
    forces. They stand together, as products of two do: one of seven alone would be chosen before a true one
    of those, and without those that are half a product of two such a one was named, and the rest unknown.
    """
    along = c.model.conditions.specific_force / STANDARD_GRAVITY_MPS2
    loaded = bool(np.any(np.linalg.norm(along, axis=1) * STANDARD_GRAVITY_MPS2 > _LOADED))
    linear = 4 if c.sensor == "accelerometer" else 1

    def products(at: Conditions) -> Array:
        f = at.specific_force / STANDARD_GRAVITY_MPS2
        two = [f[:, j] * f[:, k] for j in range(3) for k in range(j, 3)]
        three = [f[:, j] ** 2 * f[:, k] for j in range(3) for k in range(3) if j != k]
        return np.column_stack([np.ones(len(f)), f, *two, *three, np.prod(f, axis=1)])

    every = np.asarray(over_records(products, c.model.conditions))
    tilted = every[:, [10 + k for k, x in enumerate(every[:, 10:].T) if _leanings(x) >= TILTED]]
    kept = tilted[:, _own_share(every[:, :linear], tilted) > A_CORNER]
    if loaded and not np.any(_own_share(every[:, :10], kept) > OF_ITSELF):
        return []
    return [kept] if kept.shape[1] else []


def _own_share(known: Array, columns: Array) -> Array:
    """(k,) of the length of columns (n, k) that what is known (n, m) leaves."""
    left = np.linalg.norm(clear(orthonormal(known), columns), axis=0)
    return np.asarray(left / np.linalg.norm(columns, axis=0))


def force_before(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 1) which way an accelerometer's own force last changed while it was on: its hysteresis (IEEE 1293).

    +1 or −1 after a change by A_LEANING, carried on where it stays; 0 before the first. Faces come in another
    order in every power-on, so what it leaves is no scatter of theirs, and counts as noise of every record.
    """
    if c.sensor != "accelerometer":
        return []
    came, last = np.zeros(len(c.u)), 0.0
    change = np.diff(c.u, prepend=c.u[:1]) / STANDARD_GRAVITY_MPS2
    for i, first in enumerate(power_ons(c.model.conditions)):
        last = 0.0 if first else float(np.sign(change[i])) if abs(change[i]) > A_LEANING else last
        came[i] = last
    return [came[:, None]] if len(np.unique(came[came != 0.0])) > 1 else []


def size_of_force(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 1) |f| beside loads: what goes with their size is its square by name, and was called so."""
    size = np.linalg.norm(c.model.conditions.specific_force, axis=1)
    return [size[:, None]] if np.any(size > _LOADED) else []


def play(c: Channel, table: DwellTable) -> list[Array]:
    """(n, 3) how far what has play follows behind the own input, at three widths of it r: hysteresis.

        p_i = min(max(p_(i−1), u_i − r), u_i + r),   p = 0 before a power-on;   column p − u

    of the records in their order (Prandtl and Ishlinskii; Brokate, Sprekels, Hysteresis and phase
    transitions, 1996, 2.3). On the way up it is a curve over the input, and on the way down another one: by
    bins of the input it is half of either, and by those of the time, along which loads rise, it was a scale
    factor that drifts.
    """
    u = _turning(c) if c.sensor == "gyro" else c.u
    first = np.flatnonzero(power_ons(c.model.conditions))
    if len(first) < A_SIDE or len(np.unique(np.round(u / np.abs(u).max(initial=1e-300), 2))) < LEAST_PLAYED:
        return []
    width = np.abs(u).max() * np.array(PLAYS)
    rows = np.diff(np.append(first, len(u)))
    follows, before = np.empty((len(u), len(width))), np.zeros((len(first), len(width)))
    for k in range(int(rows.max())):
        on = rows > k
        at = first[on] + k
        before[on] = np.clip(before[on], u[at, None] - width, u[at, None] + width)
        follows[at] = before[on]
    return [follows - u[:, None]]


def _odd_force(c: Channel, axis: int) -> Array:
    """(n, 3) f, f |f| and f³ of the force in g along an axis."""

    def powers(at: Conditions) -> Array:
        f = at.specific_force[:, axis] / STANDARD_GRAVITY_MPS2
        return np.column_stack([f, f * np.abs(f), f**3])

    return np.asarray(over_records(powers, c.model.conditions))


def _over_force(c: Channel, axis: int, nodes: tuple[float, ...]) -> Array:
    """(n, k) bends over the force in g along an axis, of its modulus where no node is below zero.

    An accelerometer's are clear of a straight line, which is declared but for κ times a lean: what is left of
    it goes with temperature as a misalignment does. So do hats of which records reach no more than a corner.
    """

    def shares(at: Conditions) -> Array:
        f = at.specific_force[:, axis] / STANDARD_GRAVITY_MPS2
        x = f if nodes[0] < 0.0 else np.abs(f)
        return np.column_stack([np.ones(len(f)), f, hats(x, np.array(nodes), 0.0)])

    both = over_records(shares, c.model.conditions)
    declared = both[:, : 2 if c.sensor == "accelerometer" else 1]
    bends = clear(orthonormal(declared), both[:, 2:])
    size = np.linalg.norm(bends, axis=0)
    return orthonormal(bends[:, size > A_CORNER * size.max(initial=0.0)], A_CORNER)


def _within_a_g(c: Channel) -> Array:
    """(n, 1) an accelerometer's own force as far as it is within a g, clear of a straight line."""

    def shares(at: Conditions) -> Array:
        f = at.specific_force[:, c.axis] / STANDARD_GRAVITY_MPS2
        return np.column_stack([np.ones(len(f)), f, np.clip(f, -1.0, 1.0)])

    both = over_records(shares, c.model.conditions)
    return clear(orthonormal(both[:, :2]), both[:, 2:])


def _leanings(force: Array) -> int:
    """How many different ones there are of a force in g."""
    return len(np.unique(np.round(force / A_LEANING)))


def _turning(c: Channel) -> Array:
    """(n,) the own rate of a gyro; the Earth's at rest is none."""
    return np.where(np.abs(c.u) > A_RATE, c.u, 0.0)


MAKERS: Mapping[str, Callable[[Channel, DwellTable], list[Array]]] = {
    "day": waves,
    "time_on": lambda c, table: [*waves_after_power_on(c, table), *steps_after_power_on(c, table)],
    "time_on_and_rate": lambda c, table: input_over_time(c, table) if c.sensor == "gyro" else [],
    "time_on_and_specific_force": lambda c, table: input_over_time(c, table) if c.sensor != "gyro" else [],
    "rate": lambda c, table: (
        [*odd_courses(c, table), *play(c, table), *beyond_corners(c, table)] if c.sensor == "gyro" else []
    ),
    "rate_and_specific_force": rate_under_load,
    "orientation": heading_at_rest,
    "temperature": leaning,
    "day_and_specific_force": force_over_days,
    "specific_force": lambda c, table: [
        *gravity_along_axes(c, table),
        *cubic_products(c, table),
        *force_before(c, table),
        *size_of_force(c, table),
        *([*play(c, table), *beyond_corners(c, table)] if c.sensor == "accelerometer" else []),
    ],
}
"""What they vary with -> what makes them."""
