"""Forecasts of a unit's channels → the date until which it keeps its requirements.

With the forecast's law of the residuals m(t) and what flights add (run-to-run, in-run, and the temperature
residual of the plan),

    date = the last day t with  P( T_c(m(s)) <= L_c for every c and every s <= t ) >= confidence

counted from the unit's last value, so the unit is late, past its limit before that date, with at most
1 − confidence. The probability is counted over simulated paths: of the states that the model of the type
leaves open (`forecast._states`), of other methods m(t) = mean(t) + w Σ ΔV^½ z, with V = scale² of the
forecast and w the heavy tail of Student's t; independent increments cross a limit earlier than any smoother
path of the same spread.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.fleet.allowed_region import PARTS, AllowedRegion, Reserve, reserve_of
from planner.fleet.drift import ChannelForecast, Correction
from planner.fleet.history import History
from planner.fleet.validation import MethodScore
from planner.nouns.array import Array
from planner.nouns.progress import Progress, silent

Outcome = Literal["date", "kept", "overdue", "passed", "unknown"]
PATHS = 1600
PATHS_OF_PERCENTILES = 200  # each costs an exact distribution
GRID = 120
_DENSE = 1.4  # days of the grid lie closer at its beginning: a near date is told to the day
_SEED = 20240801


@dataclass(frozen=True)
class UnitDate:
    """Until when a unit keeps its requirements.

    outcome: `date`, `kept` (until the end of the horizon), `overdue` (its date lies before today), `passed`
    (at its last value already), `unknown`
    day: of the history's count; days: (h,) from its last value on; middle, upper: (h,) load, median and at
    the confidence; constraint: what is passed first; terms: which terms take most of it then, largest first
    """

    unit: str
    outcome: Outcome
    day: float | None
    days: Array
    middle: Array
    upper: Array
    constraint: int
    terms: tuple[tuple[str, float], ...]
    notes: tuple[str, ...] = ()

    @property
    def due_now(self) -> bool:
        """Whether it should have been calibrated already."""
        return self.outcome in ("overdue", "passed")

    def load_on(self, day: float) -> float:
        """The share of the limit at the confidence on a day."""
        return float(np.interp(day, self.days, self.upper))


@dataclass(frozen=True)
class FleetForecast:
    """All channels and units; scores: of the rolling origins; until: last day of the horizon; today: a day,
    too; units: none where no dates were asked for
    """

    history: History
    channels: tuple[ChannelForecast, ...]
    units: tuple[UnitDate, ...]
    scores: tuple[MethodScore, ...]
    methods: Mapping[str, str]
    confidence: float
    until: float
    correction: Correction
    notes: tuple[str, ...] = ()
    today: float = 0.0

    @property
    def by_urgency(self) -> list[UnitDate]:
        """Overdue units first, then by date; those without one, those that are not due."""
        rank = {"passed": 0, "overdue": 0, "date": 1, "unknown": 2, "kept": 3}
        return sorted(self.units, key=lambda u: (rank[u.outcome], u.day or 0.0, u.unit))


def unit_dates(
    channels: Sequence[ChannelForecast],
    region: AllowedRegion,
    until: float,
    today: float,
    confidence: float,
    progress: Progress = silent,
) -> tuple[UnitDate, ...]:
    """One entry per unit, in the order of names; a unit whose date lies before `today` is overdue."""
    if until <= today:
        raise InputError("--until lies before the last value of the history; give a later date")
    units = sorted({c.series.unit for c in channels})
    found = []
    for i, unit in enumerate(units):
        if i % 20 == 0:
            progress(f"dates: unit {i + 1} of {len(units)}")
        own = [c for c in channels if c.series.unit == unit]
        last = max(float(c.series.day[-1]) for c in own)
        days = last + (until - last) * np.linspace(0.0, 1.0, GRID + 1) ** _DENSE
        found.append(_unit_date(unit, own, region, days, confidence, today, i))
    return tuple(found)


def _unit_date(
    unit: str,
    channels: Sequence[ChannelForecast],
    region: AllowedRegion,
    days: Array,
    confidence: float,
    today: float,
    place: int,
) -> UnitDate:
    felt = [(region.index(c.series.error, c.series.term), c) for c in channels]
    known = [(place, c) for place, c in felt if place is not None and c.forecast is not None]
    notes = _notes(region, felt)
    lost = [c.series for place, c in felt if place is not None and c.forecast is None]
    if lost or not known:
        nothing = np.full(len(days), np.nan)
        return UnitDate(unit, "unknown", None, days, nothing, nothing, 0, (), notes)
    places = np.array([place for place, _ in known])
    reserve = drifting_reserve(region, places)
    count = PATHS_OF_PERCENTILES if any(c.rule == "percentile" for c in region.constraints) else PATHS
    paths = _paths([c for _, c in known], days, count, place)  # (paths, days, terms known)
    loads = np.stack([_load(region, i, paths, places, reserve) for i in range(len(region.constraints))])
    worst = loads.max(axis=0)  # (paths, days)
    prudent = worst[_livelier([c for _, c in known], region.steepest[places], days, count)]
    passed = np.logical_or.accumulate(prudent > 1.0, axis=1).mean(axis=0)
    outcome, day, at = _outcome(passed, days, confidence, today)
    upper = np.quantile(prudent, confidence, axis=0)
    binding = int(np.argmax(np.quantile(loads[:, :, at], confidence, axis=1)))
    size = np.quantile(np.abs(paths[:, at]), confidence, axis=0)
    share = size * region.constraints[binding].steepest[places] / region.constraints[binding].limit
    order = np.argsort(-share)[:3]
    terms = tuple((region.terms[places[i]].name, float(share[i])) for i in order)
    return UnitDate(unit, outcome, day, days, np.median(worst, axis=0), upper, binding, terms, notes)


def _outcome(
    passed: Array, days: Array, confidence: float, today: float
) -> tuple[Outcome, float | None, int]:
    """What the shares (h,) of paths that have passed the limit by each day mean."""
    late = np.flatnonzero(passed > 1 - confidence)
    if len(late) == 0:
        return "kept", None, len(days) - 1
    if late[0] == 0:
        return "passed", float(days[0]), 0
    i = int(late[0])
    day = float(np.floor(np.interp(1 - confidence, passed[i - 1 : i + 1], days[i - 1 : i + 1])))
    return ("date" if day >= today else "overdue"), day, i


def drifting_reserve(region: AllowedRegion, places: Array) -> Reserve:
    """What flights add: all parts of terms without a history, else without estimate and storage."""
    kept = np.ones((len(region.terms), len(PARTS)))
    for part in ("estimate", "storage"):  # both are in the measured values and their forecast
        kept[places, PARTS.index(part)] = 0.0
    return reserve_of(region, kept)


def _paths(channels: Sequence[ChannelForecast], days: Array, count: int, place: int) -> Array:
    """(count, days, channels) simulated residuals; place: of the unit, for draws of its own."""
    rng = np.random.default_rng([_SEED, place])
    found = np.empty((count, len(days), len(channels)))
    for i, c in enumerate(channels):
        found[:, :, i] = _futures(c, days, rng, count) - c.correction
    return found


def _livelier(
    channels: Sequence[ChannelForecast], slope: Array, days: Array, count: int
) -> NDArray[np.bool_]:
    """(count,) the paths of the livelier half of the types that the data leave open.

    Few units with a short history cannot tell a walk from an ageing; a mean over both would be late in a
    fifth of the units where it is the ageing. Where the fleet tells the type, its halves are alike and
    nothing is lost.
    """
    states = [c.forecast.states for c in channels if c.forecast is not None and c.forecast.states is not None]
    if len(states) < len(channels):
        return np.ones(count, dtype=bool)
    size = np.zeros(len(states[0].level))
    for c, s, weight in zip(channels, states, slope, strict=True):
        mean, variance = s.moments(np.array([days[-1] - c.series.day[-1]]))
        size += weight * np.sqrt((mean[:, 0] - c.correction) ** 2 + variance[:, 0])
    return np.asarray((size >= np.median(size))[np.arange(count) % len(size)])


def _futures(c: ChannelForecast, days: Array, rng: np.random.Generator, count: int) -> Array:
    """(count, days) of one channel."""
    assert c.forecast is not None
    if c.forecast.states is not None:
        return c.forecast.states.paths(np.maximum(days - c.series.day[-1], 0.0), rng, count)
    f = c.at(days)
    assert f is not None
    variance = np.maximum.accumulate(f.scale**2)
    steps = np.sqrt(np.diff(variance, prepend=0.0)) * rng.standard_normal((count, len(days)))
    freedom = float(np.mean(f.freedom))
    tail = 1.0 if np.isinf(freedom) else np.sqrt(freedom / rng.chisquare(freedom, (count, 1)))
    return np.asarray(f.mean + tail * np.cumsum(steps, axis=1))


def _load(region: AllowedRegion, i: int, paths: Array, places: Array, reserve: Reserve) -> Array:
    """(paths, days) share of the limit of one constraint."""
    c = region.constraints[i]
    slope = c.steepest
    if c.rule == "worst_case":
        return np.asarray((np.abs(paths) @ slope[places] + slope @ reserve.sums) / c.limit)
    if c.rule == "rss":
        return np.asarray(np.sqrt(paths**2 @ slope[places] ** 2 + slope**2 @ reserve.squares) / c.limit)
    residual = np.zeros((*paths.shape[:2], len(region.terms)))
    residual[:, :, places] = paths
    return region.value(c, residual, reserve) / c.limit


def _notes(region: AllowedRegion, felt: Sequence[tuple[int | None, ChannelForecast]]) -> tuple[str, ...]:
    notes, seen = [], {place for place, _ in felt}
    known = {region.terms[place].error for place in seen if place is not None}
    rest = [(t.error, t.term) for i, t in enumerate(region.terms) if i not in seen]
    if rest:
        by = {error: [term for e, term in rest if e == error] for error, _ in rest}
        said = [f"{error} {' '.join(terms)}" if error in known else error for error, terms in by.items()]
        notes.append(f"no history, so counted as the plan left it: {', '.join(said)}")
    unfelt = [c.series.error for place, c in felt if place is None]
    if unfelt:
        notes.append(f"no requirement feels it: {', '.join(dict.fromkeys(unfelt))}")
    for place, c in felt:
        if place is not None and c.forecast is None:
            notes.append(f"{c.series.error} {c.series.term}: {c.why}, and the spec has no storage for it")
    return tuple(notes)
