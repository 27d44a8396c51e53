"""What errors may add to the readings of a flight, as columns: few of them act at a time.

Per sensor, for every moment of the flight c (3) and A − I (9) of û = A u + c and each error that is neither
constant nor proportional, hats in time; then noise, stretch by stretch, and the initial alignment as a turn
of the first sample; last, one column that no reading has, the error of a height aid. Over some samples only
the moments and stretches about them act.

An error that changes with temperature by its own equation has columns at every ten kelvins, for flights start
anywhere: one at T has its value split between the two that T lies between.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.trajectory import Trajectory
from planner.protocols import SENSORS, Sensor
from planner.verify.along_flight import conditions_of
from planner.verify.beside import ALIGNMENT, HEIGHT, NOTHING, Beside, noise_name
from planner.verify.structure import affine

BASIC = 12  # columns of A and c
APART_K = 10.0  # of the temperatures at which errors that change with it have columns


@dataclass(frozen=True)
class Columns:
    """All columns of a flight, gyros first. moments: (K,) s

    extras: (sensor, effect) of each error that is neither constant nor proportional; beside: noise, alignment
    range_degc: within which flights start, None: as warm as the trajectory
    """

    trajectory: Trajectory
    moments: Array
    extras: tuple[tuple[Sensor, str], ...] = ()
    beside: Beside = field(default=NOTHING)
    range_degc: tuple[float, float] | None = None

    # ------------------------------------------------------------ how many, and where

    def width(self, sensor: Sensor) -> int:
        """Columns of one moment."""
        return BASIC + sum(self._columns_of(s, e) for s, e in self.extras if s == sensor)

    def _columns_of(self, sensor: Sensor, effect: str) -> int:
        """Columns of one error at one moment."""
        return len(catalog.effects()[effect].terms(sensor)) * max(len(self.warmer(effect)), 1)

    def warmer(self, effect: str) -> Array:
        """(N,) degC at which an error has columns; none of one that temperature does not change."""
        known = catalog.effects()[effect]
        changes = "temperature_degc" in known.needs and "temperature_rate" not in known.needs
        if self.range_degc is None or known.tabled or not changes:
            return np.empty(0)
        low, high = self.range_degc
        return np.unique([low, *np.arange(np.ceil(low / APART_K), high / APART_K) * APART_K, high])

    @cached_property
    def own_degc(self) -> Array:
        """(1, K) degC of the trajectory at the moments."""
        flown = self.trajectory
        return np.interp(self.moments, flown.time_s, flown.temperature_degc)[None]

    def size(self, sensor: Sensor) -> int:
        """All columns of a sensor."""
        return self._places[sensor][-1]

    @property
    def count(self) -> int:
        """All columns."""
        return sum(self.size(sensor) for sensor in SENSORS) + int(self.beside.height > 0)

    @cached_property
    def _places(self) -> dict[Sensor, tuple[int, int, int]]:
        """Where a sensor's noise begins, where its alignment, and where it ends; moments begin at 0."""
        found: dict[Sensor, tuple[int, int, int]] = {}
        for sensor in SENSORS:
            noise = len(self.moments) * self.width(sensor)
            stretches = 3 * self.beside.stretches if sensor in self.beside.noise else 0
            aligned = 3 if sensor == "gyro" and self.beside.alignment is not None else 0
            found[sensor] = (noise, noise + stretches, noise + stretches + aligned)
        return found

    def active(self, start: int, stop: int) -> NDArray[np.int64]:
        """Which of all columns act over the samples start..stop."""
        first, found = 0, []
        moments, stretches = self._about(start, stop)
        for sensor in SENSORS:
            width, (noise, alignment, end) = self.width(sensor), self._places[sensor]
            found.append(first + np.arange(moments.start * width, moments.stop * width))
            if alignment > noise:
                found.append(first + noise + np.arange(3 * stretches.start, 3 * stretches.stop))
            if end > alignment and start == 0:
                found.append(first + np.arange(alignment, end))
            first += end
        return np.concatenate(found)

    def _about(self, start: int, stop: int) -> tuple[range, range]:
        """Moments whose hats, and stretches of noise that the samples reach into."""
        t = self.trajectory.time_s
        ends = np.array([t[start] + t[start + 1], t[stop - 1] + t[stop]]) / 2.0
        left = int(np.searchsorted(self.moments, ends[0], side="right")) - 1
        right = int(np.searchsorted(self.moments, ends[1], side="left"))
        last = len(self.moments) - 1
        noise = np.clip(np.searchsorted(self.beside.edges, ends) - 1, 0, self.beside.stretches - 1)
        return range(max(left, 0), min(right, last) + 1), range(int(noise[0]), int(noise[1]) + 1)

    # ------------------------------------------------------------ what they are

    def forcing(self, start: int, stop: int) -> tuple[list[Array], list[Array]]:
        """The active columns of both sensors over the samples start..stop."""
        c = conditions_of(self.trajectory, start, stop)
        t = self.trajectory.time_s
        middle = (t[start:stop] + t[start + 1 : stop + 1]) / 2.0
        moments, stretches = self._about(start, stop)
        one = np.eye(len(self.moments))
        hats = [np.interp(middle, self.moments, one[k]) for k in moments]
        found: dict[Sensor, list[Array]] = {}
        for sensor, u in zip(SENSORS, (c.rate, c.specific_force), strict=True):
            own = [self._extra(sensor, e, c) for s, e in self.extras if s == sensor]
            found[sensor] = [h[:, None, None] * x for h in hats for x in (_basic(u), *own)]
            found[sensor].append(self.beside.columns(sensor, self.trajectory, start, stop, stretches))
        return found["gyro"], found["accelerometer"]

    def _extra(self, sensor: Sensor, effect: str, c: Conditions) -> Array:
        """(n, 3, columns) of one error: its terms, at temperature after temperature if it has those."""
        known, nodes = catalog.effects()[effect], self.warmer(effect)
        each = [replace(c, temperature_degc=np.full(len(c.day), degc)) for degc in nodes] or [c]
        return np.concatenate([known.regressors(sensor, one) for one in each], axis=2)

    # ------------------------------------------------------------ coefficients

    def of_values(
        self, basic: Array, sensor: Sensor, values: Mapping[str, Array], degc: Array | None = None
    ) -> Array:
        """(B, K · width) of basic (B, K, 12) and the extras' values (B, K, t), moment by moment.

        degc: (B, K) of the flights; None: as warm as the trajectory
        """
        parts = [basic]
        for s, effect in self.extras:
            if s == sensor:
                none = np.zeros((*basic.shape[:2], len(catalog.effects()[effect].terms(sensor))))
                parts.append(self._split(effect, values.get(effect, none), degc))
        return np.concatenate(parts, axis=2).reshape(len(basic), -1)

    def _split(self, effect: str, value: Array, degc: Array | None) -> Array:
        """(B, K, columns) of values (B, K, t) of one error in flights at (B, K) degC."""
        nodes = self.warmer(effect)
        if not len(nodes):
            return value
        t = np.broadcast_to(self.own_degc if degc is None else degc, value.shape[:2])
        split = _shares(t, nodes)[..., None] * value[:, :, None, :]
        return np.asarray(split.reshape(*value.shape[:2], -1))

    def with_beside(self, own: Mapping[Sensor, Array], beside: Mapping[str, Array]) -> Array:
        """(B, p) gyros then accelerometers, each with its columns beside; a self-alignment's tilt is here."""
        units, every = len(own["gyro"]), []
        for sensor in SENSORS:
            noise, alignment, end = self._places[sensor]
            every.append(own[sensor])
            if alignment > noise:
                every.append(beside.get(noise_name(sensor), np.zeros((units, alignment - noise))))
            if end > alignment:
                given = beside.get(ALIGNMENT, np.zeros((units, 3)))
                every.append(given + own["accelerometer"] @ self.levelling.T)
        if self.beside.height > 0:
            every.append(beside.get(HEIGHT, np.zeros((units, 1))))
        return np.concatenate(every, axis=1)

    @cached_property
    def levelling(self) -> Array:
        """(3, K · width) turn of the first sample by the accelerometers' errors, if they level themselves."""
        force = np.zeros((3, self._places["accelerometer"][0]))
        if self.beside.alignment is None or not self.beside.alignment.self_aligned:
            return force
        acting = self.active(0, 1)
        mine = acting[acting >= self.size("gyro")] - self.size("gyro")
        columns = np.concatenate(self.forcing(0, 1)[1], axis=2)[0]
        inside = mine < force.shape[1]
        force[:, mine[inside]] = columns[:, inside]
        return self.beside.tilt(self.trajectory, force.T).T

    def responses(self, rows: Array, sensor: Sensor, effect: str) -> Array:
        """(R, K, columns) of one error's values at the moments, from what every column adds: rows (R, p).

        As many columns as terms, or as terms at all its temperatures, which `at` reads for one flight.
        """
        first = 0 if sensor == "gyro" else self.size("gyro")
        noise, _, _ = self._places[sensor]
        own = rows[:, first : first + noise]
        if sensor == "accelerometer" and self.beside.alignment is not None:
            _, alignment, end = self._places["gyro"]
            own = own + rows[:, alignment:end] @ self.levelling
        own = own.reshape(len(rows), len(self.moments), self.width(sensor))
        found = affine(sensor, effect)
        if found is not None:
            return np.asarray(
                own[:, :, :3] @ found.constant + own[:, :, 3:BASIC] @ found.slope.reshape(9, -1)
            )
        place = BASIC
        for s, e in self.extras:
            count = self._columns_of(s, e)
            if (s, e) == (sensor, effect):
                return np.asarray(own[:, :, place : place + count])
            place += count if s == sensor else 0
        raise ValueError(f"{sensor}.{effect} is not among the columns of this flight")

    def at(self, response: Array, effect: str, degc: Array) -> Array:
        """(R, K, t) of `responses` for a flight at temperatures (K,)."""
        nodes = self.warmer(effect)
        if not len(nodes):
            return response
        each = response.reshape(*response.shape[:2], len(nodes), -1)
        return np.asarray(np.einsum("kn,rknt->rkt", _shares(degc, nodes), each))


def _shares(degc: Array, nodes: Array) -> Array:
    """(..., N) of a value at temperatures (...) between nodes; the end segments go on."""
    right = np.clip(np.searchsorted(nodes, degc), 1, len(nodes) - 1)
    share = (degc - nodes[right - 1]) / (nodes[right] - nodes[right - 1])
    one = np.eye(len(nodes))
    return np.asarray((1.0 - share)[..., None] * one[right - 1] + share[..., None] * one[right])


def _basic(u: Array) -> Array:
    """(n, 3, 12): one on each channel, then u_j on channel i in the order of A's rows."""
    columns = np.zeros((len(u), 3, BASIC))
    for i in range(3):
        columns[:, i, i] = 1.0
        columns[:, i, 3 + 3 * i : 6 + 3 * i] = u
    return columns


def columns_of(
    trajectory: Trajectory,
    errors: Sequence[tuple[Sensor, str]],
    moments: Array,
    beside: Beside,
    range_degc: tuple[float, float] | None = None,
) -> Columns:
    """The columns of a flight with errors (sensor, effect), which may start within a range."""
    extras = tuple((s, e) for s, e in errors if affine(s, e) is None)
    return Columns(trajectory, moments, extras, beside, range_degc)
