"""History → forecasts of every channel, and the date until which a unit keeps its requirements.

The residual of a term is m(t) = y(t) − c, c being what corrects it (`Correction`). With the forecast's law of
m(t) and what flights add (run-to-run, in-run, and the temperature residual of the plan),

    date = the last day t with  P( T_c(m(s)) <= L_c for every c and every s <= t ) >= confidence

so the unit is late, past its limit before that date, with at most 1 − confidence. The probability is counted
over simulated paths: m(t) = mean(t) + w Σ ΔV^½ z, with V = scale² of the forecast and w the heavy tail of
Student's t; independent increments cross a limit earlier than any smoother path of the same spread.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from planner.errors import InputError
from planner.fleet.allowed_region import PARTS, AllowedRegion, Reserve, reserve_of
from planner.fleet.forecast._method import Forecast, Past, two_sided
from planner.fleet.history import History, Series
from planner.fleet.validation import UNVALIDATED, MethodScore, chosen, method_named, methods, scores
from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.spec.budget import STORAGE_DAYS

Correction = Literal["none", "first", "last"]
Outcome = Literal["date", "kept", "passed", "unknown"]
PATHS = 1000
PATHS_OF_PERCENTILES = 200  # each costs an exact distribution
GRID = 120
_SEED = 20240801
AUTO = "auto"
STORAGE = "storage of the spec"


@dataclass(frozen=True)
class ChannelForecast:
    """One series with its future, SI. ahead: (h,) days after its last value.

    correction: what is subtracted for the residual; rate: change per day over the horizon, with half of its
    95 % interval; why: what stands against it, empty for a forecast
    """

    series: Series
    method: str
    correction: float
    ahead: Array
    forecast: Forecast | None
    rate: float
    rate_half: float
    why: str = ""

    def at(self, days: Array) -> Forecast | None:
        """The forecast on days of the history's count, constant before its first."""
        if self.forecast is None:
            return None
        h = np.maximum(days - self.series.day[-1], 0.0)
        f = self.forecast
        mean, variance = np.interp(h, self.ahead, f.mean), np.interp(h, self.ahead, f.scale**2)
        return Forecast(mean, np.sqrt(variance), f.noise, f.freedom)


@dataclass(frozen=True)
class UnitDate:
    """Until when a unit keeps its requirements.

    outcome: `date`, `kept` (until the end of the horizon), `passed` (already now), `unknown`
    day: of the history's count; days: (h,); middle, upper: (h,) load, median and at the confidence
    constraint: what is passed first; terms: which terms take most of it then, largest first
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


@dataclass(frozen=True)
class FleetForecast:
    """All channels and units; scores: of the rolling origins; until: last day of the horizon."""

    history: History
    channels: tuple[ChannelForecast, ...]
    units: tuple[UnitDate, ...]
    scores: tuple[MethodScore, ...]
    methods: Mapping[str, str]
    confidence: float
    until: float
    correction: Correction
    notes: tuple[str, ...] = ()


def forecast_channels(
    history: History,
    models: Mapping[str, ErrorModel],
    until: float,
    confidence: float,
    method: str,
    correction: Correction,
    progress: Callable[[str], None],
) -> tuple[tuple[ChannelForecast, ...], tuple[MethodScore, ...], Mapping[str, str]]:
    """Every series forecast to day `until` of the history's count.

    method: a name, or `auto`: the best on rolling origins of each kind of error.
    Raises InputError for an unknown method.
    """
    if method != AUTO:
        method_named(method)
    past = [Past(s.error, s.day, s.value, s.sigma) for s in history.series]
    progress("rolling origins: which method forecasts best")
    found = scores(past, confidence, list(methods()) if method == AUTO else [method])
    use = {kind: name if method == AUTO else method for kind, name in chosen(found).items()}
    factor = {(s.kind, s.method): s.factor for s in found}
    ahead = [np.linspace(0.0, max(until - s.day[-1], 1.0), GRID + 1)[1:] for s in history.series]
    made: list[Forecast | str] = [""] * len(past)
    for kind, name in use.items():
        progress(f"forecasting {kind} by {name}")
        places = [i for i, p in enumerate(past) if p.kind == kind]
        own, times = [past[i] for i in places], [ahead[i] for i in places]
        answers = method_named(name).forecast(own, times)
        prudent = method_named(UNVALIDATED).forecast(own, times) if method == AUTO else answers
        for i, answer, other in zip(places, answers, prudent, strict=True):
            made[i] = answer
            if isinstance(answer, Forecast):
                wide = answer.widened(factor.get((kind, name), 1.0))
                made[i] = enveloping(wide, other, confidence) if isinstance(other, Forecast) else wide
    channels = [
        _channel(s, use[s.error], answer, h, models.get(s.error), correction)
        for s, answer, h in zip(history.series, made, ahead, strict=True)
    ]
    return tuple(channels), found, use


def enveloping(chosen: Forecast, prudent: Forecast, confidence: float) -> Forecast:
    """The chosen forecast with intervals that hold those of the prudent one.

    Rolling origins look a few weeks ahead only, and those of a few series cannot tell whether intervals hold
    what they promise: on fleets of two units with 12 weeks of history, dates from the chosen method's own
    intervals were late in a quarter of the units.
    """
    quantile = two_sided(confidence, chosen.freedom)
    apart = np.abs(chosen.mean - prudent.mean)
    needed = (apart + prudent.half_width(confidence, measured=False)) / quantile
    return Forecast(chosen.mean, np.maximum(chosen.scale, needed), chosen.noise, chosen.freedom)


def _channel(
    series: Series,
    name: str,
    answer: Forecast | str,
    ahead: Array,
    model: ErrorModel | None,
    correction: Correction,
) -> ChannelForecast:
    why = answer if isinstance(answer, str) else ""
    if isinstance(answer, str):
        name, answer = STORAGE, _from_storage(series, ahead, model) or answer
    base = {"none": 0.0, "first": float(series.value[0]), "last": float(series.value[-1])}[correction]
    if isinstance(answer, str):
        return ChannelForecast(series, "none", base, ahead, None, np.nan, np.nan, why)
    rate = float((answer.mean[-1] - series.value[-1]) / ahead[-1])
    half = float(answer.half_width(0.95, measured=False)[-1] / ahead[-1])
    return ChannelForecast(series, name, base, ahead, answer, rate, half, why)


def _from_storage(series: Series, ahead: Array, model: ErrorModel | None) -> Forecast | None:
    """What the spec says of two months in store, as a random walk: for series too short to tell."""
    if model is None or model.storage <= 0:
        return None
    known = float(series.sigma[-1]) if np.isfinite(series.sigma[-1]) else 0.0
    scale = np.sqrt(model.storage**2 * ahead / STORAGE_DAYS + known**2)
    return Forecast(np.full(len(ahead), series.value[-1]), scale, known, np.inf)


# ---------------------------------------------------------------- dates


def unit_dates(
    channels: Sequence[ChannelForecast],
    region: AllowedRegion,
    until: float,
    today: float,
    confidence: float,
    progress: Callable[[str], None] = lambda message: None,
) -> tuple[UnitDate, ...]:
    """One entry per unit, in the order of names; today: the day from which on dates are looked for."""
    if until <= today:
        raise InputError("--until lies before the last value of the history; give a later date")
    days = np.linspace(today, until, GRID + 1)
    units = sorted({c.series.unit for c in channels})
    found = []
    for i, unit in enumerate(units):
        if i % 20 == 0:
            progress(f"dates: unit {i + 1} of {len(units)}")
        found.append(
            _unit_date(unit, [c for c in channels if c.series.unit == unit], region, days, confidence)
        )
    return tuple(found)


def _unit_date(
    unit: str, channels: Sequence[ChannelForecast], region: AllowedRegion, days: Array, confidence: float
) -> UnitDate:
    felt = [(region.index(c.series.error, c.series.term), c) for c in channels]
    known = [(place, c) for place, c in felt if place is not None and c.forecast is not None]
    notes = _notes(region, [place for place, _ in known], felt)
    lost = [c.series for place, c in felt if place is not None and c.forecast is None]
    if lost or not known:
        nothing = np.full(len(days), np.nan)
        return UnitDate(unit, "unknown", None, days, nothing, nothing, 0, (), notes)
    places = np.array([place for place, _ in known])
    reserve = drifting_reserve(region, places)
    count = PATHS_OF_PERCENTILES if any(c.rule == "percentile" for c in region.constraints) else PATHS
    paths = _paths([c for _, c in known], days, count)  # (paths, days, terms known)
    loads = np.stack([_load(region, i, paths, places, reserve) for i in range(len(region.constraints))])
    worst = loads.max(axis=0)  # (paths, days)
    passed = np.logical_or.accumulate(worst > 1.0, axis=1).mean(axis=0)
    outcome, day, at = _outcome(passed, days, confidence)
    upper = np.quantile(worst, confidence, axis=0)
    binding = int(np.argmax(np.quantile(loads[:, :, at], confidence, axis=1)))
    size = np.quantile(np.abs(paths[:, at]), confidence, axis=0)
    share = size * region.constraints[binding].steepest[places] / region.constraints[binding].limit
    order = np.argsort(-share)[:3]
    terms = tuple((region.terms[places[i]].name, float(share[i])) for i in order)
    return UnitDate(unit, outcome, day, days, np.median(worst, axis=0), upper, binding, terms, notes)


def _outcome(passed: Array, days: Array, confidence: float) -> tuple[Outcome, float | None, int]:
    """What the shares (h,) of paths that have passed the limit by each day mean."""
    late = np.flatnonzero(passed > 1 - confidence)
    if len(late) == 0:
        return "kept", None, len(days) - 1
    if late[0] == 0:
        return "passed", float(days[0]), 0
    return "date", float(np.floor(days[late[0] - 1])), int(late[0])


def drifting_reserve(region: AllowedRegion, places: Array) -> Reserve:
    """What flights add: all parts of terms without a history, else without estimate and storage."""
    kept = np.ones((len(region.terms), len(PARTS)))
    for part in ("estimate", "storage"):  # both are in the measured values and their forecast
        kept[places, PARTS.index(part)] = 0.0
    return reserve_of(region, kept)


def _paths(channels: Sequence[ChannelForecast], days: Array, count: int) -> Array:
    """(count, days, channels) simulated residuals; the same seed for every unit."""
    rng = np.random.default_rng(_SEED)
    found = np.empty((count, len(days), len(channels)))
    for i, c in enumerate(channels):
        f = c.at(days)
        assert f is not None
        variance = np.maximum.accumulate(f.scale**2)
        steps = np.sqrt(np.diff(variance, prepend=0.0)) * rng.standard_normal((count, len(days)))
        tail = 1.0 if np.isinf(f.freedom) else np.sqrt(f.freedom / rng.chisquare(f.freedom, (count, 1)))
        found[:, :, i] = f.mean - c.correction + tail * np.cumsum(steps, axis=1)
    return found


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


def _notes(
    region: AllowedRegion, known: Sequence[int], felt: Sequence[tuple[int | None, ChannelForecast]]
) -> tuple[str, ...]:
    notes = []
    rest = [t.error for i, t in enumerate(region.terms) if i not in known]
    if rest:
        notes.append(f"no history, so counted as the plan left it: {', '.join(dict.fromkeys(rest))}")
    unfelt = [c.series.error for place, c in felt if place is None]
    if unfelt:
        notes.append(f"no requirement feels it: {', '.join(dict.fromkeys(unfelt))}")
    for place, c in felt:
        if place is not None and c.forecast is None:
            notes.append(f"{c.series.error} {c.series.term}: {c.why}, and the spec has no storage for it")
    return tuple(notes)
