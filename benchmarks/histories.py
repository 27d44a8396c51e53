"""Histories in store that know nothing of `planner.fleet`: plain NumPy, day by day, and who knows the
process.

Each law moves a channel's true residual from day to day; sizes are in units of the spec's storage, so that 1
is what the spec expects of 60 days. Months before the history are lived through, too, so that slopes and
seasons are under way when it begins, and the residual starts at zero on its first day (the unit has just
been calibrated).

    python benchmarks/study_fleet_dates.py      # uses them
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import date, timedelta

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
YEAR = 365
START = date(2026, 1, 5)


@dataclass(frozen=True)
class Law:
    """How channels move, in storage units: walk, slope and season are of 60 days (season: its amplitude).

    common: share of the slope that all units of the type have alike; fade: days over which ageing dies away
    (0: never); pull: days over which the residual is drawn back (0: a pure walk); tail: degrees of freedom
    of the walk's steps (0: normal); apart: spread of ln(size) from unit to unit; jumps: unmarked steps a
    year and channel
    """

    walk: float = 0.0
    slope: float = 0.0
    season: float = 0.0
    noise: float = 0.1
    common: float = 0.0
    fade: float = 0.0
    pull: float = 0.0
    tail: float = 0.0
    apart: float = 0.0
    jumps: float = 0.0
    mess: bool = False


# set up on, and judged on: no law and no seed is in both
TUNED: Mapping[str, Law] = {
    "walk": Law(walk=0.4),
    "ageing+season": Law(walk=0.15, slope=0.25, season=0.35),
    "messy": Law(walk=0.35, slope=0.15, apart=0.3, mess=True),
}
JUDGED: Mapping[str, Law] = {
    "walk, 0.5": Law(walk=0.5, noise=0.15),
    "walk, 0.25": Law(walk=0.25, noise=0.3),
    "heavy steps": Law(walk=0.4, tail=4.0),
    "ageing+season": Law(walk=0.12, slope=0.35, season=0.4, noise=0.2),
    "ageing that fades": Law(walk=0.2, slope=0.5, fade=200.0, common=0.6),
    "drawn back": Law(walk=0.5, pull=90.0),
    "apart": Law(walk=0.35, slope=0.2, season=0.15, apart=0.5),
    "messy": Law(walk=0.4, slope=0.15, season=0.15, apart=0.3, noise=0.15, mess=True),
}


@dataclass(frozen=True)
class Lived:
    """A fleet's truth, in storage units. value: (units, channels, days) from day 0; size: (units, channels)

    step: (units,) day of an unmarked step or −1; repaired: (units,) day of a declared repair or −1
    """

    law: Law
    value: Array
    size: Array
    rate: Array
    wave: Array
    step: npt.NDArray[np.int64]
    repaired: npt.NDArray[np.int64]


def lived(law: Law, units: int, channels: int, weeks: int, rng: np.random.Generator) -> Lived:
    """True residuals from day 0 to a year after the last of so many weekly visits."""
    known = 7 * (weeks - 1)
    days = known + YEAR + 1
    size = np.exp(law.apart * rng.normal(size=(units, 1))) * np.ones((units, channels))
    alike = rng.normal(size=(1, channels))
    rate = law.slope * (np.sqrt(law.common) * alike + np.sqrt(1 - law.common) * rng.normal(size=size.shape))
    wave = law.season * rng.normal(size=(*size.shape, 2))
    drift = _smooth(law, size, rate, wave, np.arange(days))
    steps = _steps(law, (*size.shape, days - 1), rng)
    value = drift + size[..., None] * np.concatenate(
        [np.zeros((*size.shape, 1)), _summed(law, steps)], axis=2
    )
    step, repaired = np.full(units, -1), np.full(units, -1)
    if law.mess and weeks >= 6:
        for u in range(units):
            if rng.random() < 1 / 3:  # unmarked, on one channel
                step[u] = 7 * int(rng.integers(2, weeks - 2)) - 3
                value[u, rng.integers(channels), step[u] :] += rng.uniform(1.5, 3.0) * rng.choice([-1.0, 1.0])
            elif rng.random() < 1 / 4:
                repaired[u] = 7 * int(rng.integers(2, weeks - 2)) - 3
                value[u, :, repaired[u] :] += rng.normal(size=(channels, 1))
    return Lived(law, value, size, rate, wave, step, repaired)


def _smooth(law: Law, size: Array, rate: Array, wave: Array, day: npt.NDArray[np.int64]) -> Array:
    """(units, channels, days) ageing and season, zero on day 0."""
    grown = day / 60.0 if law.fade == 0 else law.fade / 60.0 * (1 - np.exp(-day / law.fade))
    angle = 2 * np.pi * day / YEAR
    turned = wave[..., :1] * np.sin(angle) + wave[..., 1:] * (np.cos(angle) - 1)
    return np.asarray(size[..., None] * (rate[..., None] * grown + turned))


def _steps(law: Law, shape: tuple[int, ...], rng: np.random.Generator) -> Array:
    if law.tail == 0:
        return np.asarray(law.walk / np.sqrt(60.0) * rng.normal(size=shape))
    scale = law.walk / np.sqrt(60.0 * law.tail / (law.tail - 2))
    return np.asarray(scale * rng.standard_t(law.tail, size=shape))


def _summed(law: Law, steps: Array) -> Array:
    """The walk from its steps, drawn back where the law says so."""
    if law.pull == 0:
        return np.asarray(np.cumsum(steps, axis=-1))
    out, level = np.empty_like(steps), np.zeros(steps.shape[:-1])
    for d in range(steps.shape[-1]):
        level = level * (1 - 1 / law.pull) + steps[..., d]
        out[..., d] = level
    return out


def possible(fleet: Lived, weeks: int, load: Callable[[Array], Array], count: int, seed: int) -> Array:
    """(units,) days until 5 % of the futures have passed the limit, for one who knows law and present truth.

    load: (..., channels) residuals in storage units -> (...) share of the limit
    """
    rng, last = np.random.default_rng(seed), 7 * (weeks - 1)
    law, units = fleet.law, len(fleet.value)
    day = np.arange(last, last + YEAR + 1)
    smooth = _smooth(law, fleet.size, fleet.rate, fleet.wave, day)
    found = np.empty(units)
    for u in range(units):
        steps = _steps(law, (count, fleet.value.shape[1], YEAR), rng)
        walk = fleet.size[u][:, None] * _summed(law, steps)
        now = fleet.value[u, :, last]
        if law.pull:
            level = now - smooth[u, :, 0]
            walk = walk + level[:, None] * ((1 - 1 / law.pull) ** np.arange(1, YEAR + 1) - 1)
        future = now[:, None] + (smooth[u, :, 1:] - smooth[u, :, :1]) + walk
        over = np.logical_or.accumulate(load(np.moveaxis(future, 1, 2)) > 1.0, axis=1).mean(axis=0)
        late = np.flatnonzero(over > 0.05)
        found[u] = late[0] if len(late) else YEAR
    return found


def passed(fleet: Lived, weeks: int, load: Callable[[Array], Array]) -> Array:
    """(units,) days from the last visit to the first beyond the limit, infinite if none within a year."""
    future = np.moveaxis(fleet.value[:, :, 7 * (weeks - 1) :], 1, 2)
    over = load(future) > 1.0
    return np.where(over.any(axis=1), over.argmax(axis=1), np.inf)


@dataclass
class Sheet:
    """The history as somebody would keep it. rows: of the CSV; seen: (unit, channel) -> days that have a
    value."""

    rows: list[str] = field(default_factory=list)


def sheet(
    fleet: Lived,
    weeks: int,
    names: list[tuple[str, str, str, float]],
    rng: np.random.Generator,
    *,
    stated: bool,
) -> str:
    """The CSV. names: (error, term, unit, one storage in that unit) of every channel."""
    law, rows = fleet.law, ["unit,date,error,term,value,uncertainty,event"]
    for u in range(len(fleet.value)):
        gap = range(weeks // 3, weeks // 3 + weeks // 5) if law.mess and rng.random() < 0.3 else range(0)
        marked = fleet.repaired[u] < 0
        for week in range(weeks):
            if week in gap and 0 < week < weeks - 1:
                continue
            event = "repair" if not marked and 7 * week >= fleet.repaired[u] else ""
            marked = marked or bool(event)
            when = START + timedelta(days=7 * week)
            for c, (error, term, unit, one) in enumerate(names):
                value = fleet.value[u, c, 7 * week] + law.noise * rng.normal()
                if law.mess and weeks >= 6 and rng.random() < 0.01:
                    value += rng.choice([-1.0, 1.0]) * rng.uniform(10, 20) * law.noise
                text = f"{round(value / 0.05) * 0.05 * one:.9g}" if law.mess else f"{value * one:.9g}"
                sigma = f"{law.noise * one:.6g} {unit}" if stated else ""
                rows.append(f"u{u:02d},{when},{error},{term},{text} {unit},{sigma},{event}")
    return "\n".join(rows) + "\n"
