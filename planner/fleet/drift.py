"""History → forecasts of every channel.

The residual of a term is m(t) = y(t) − c, c being what corrects it (`Correction`). `auto` takes the model of
the whole type of unit (`forecast.hierarchical`); rolling origins show beside it how every method would have
done.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from planner.fleet.forecast._method import Forecast
from planner.fleet.forecast.hierarchical import forecast_of
from planner.fleet.history import History, Series
from planner.fleet.shocks import past_of
from planner.fleet.validation import MODEL, MethodScore, installed, method_named, scores
from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.spec.budget import STORAGE_DAYS

Correction = Literal["none", "first", "last"]
GRID = 120
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
        if f.states is not None:
            return forecast_of(f.states, h)
        mean, variance = np.interp(h, self.ahead, f.mean), np.interp(h, self.ahead, f.scale**2)
        freedom = f.freedom if np.ndim(f.freedom) == 0 else np.interp(h, self.ahead, f.freedom)
        return Forecast(mean, np.sqrt(variance), f.noise, freedom)


def forecast_channels(
    history: History,
    models: Mapping[str, ErrorModel],
    until: float,
    confidence: float,
    method: str,
    correction: Correction,
    progress: Callable[[str], None],
    *,
    validated: bool = True,
) -> tuple[tuple[ChannelForecast, ...], tuple[MethodScore, ...], Mapping[str, str]]:
    """Every series forecast to day `until` of the history's count; validated: with scores of rolling origins.

    method: a name, or `auto`: the model of the whole type; any other is always validated, as its intervals
    are widened by what that shows. Raises InputError for an unknown method.
    """
    name = MODEL if method == AUTO else method
    method_named(name)
    storage = {m.name: m.storage for m in models.values()}
    past = [past_of(s, storage.get(s.error, np.nan)) for s in history.series]
    found: tuple[MethodScore, ...] = ()
    if validated or name != MODEL:
        progress("rolling origins: how every method would have done")
        found = scores(past, confidence, installed() if method == AUTO else [name])
    factor = {s.kind: s.factor for s in found if s.method == name and name != MODEL}
    ahead = [np.linspace(0.0, max(until - s.day[-1], 1.0), GRID + 1)[1:] for s in history.series]
    progress(f"forecasting by {name}")
    made = method_named(name).forecast(past, ahead)
    channels = [
        _channel(s, name, _widened(answer, factor.get(s.error, 1.0)), h, models.get(s.error), correction)
        for s, answer, h in zip(history.series, made, ahead, strict=True)
    ]
    alone = _without_company(history.series)
    channels = [
        _by_storage(c, models.get(c.series.error)) if c.series.error in alone and name == MODEL else c
        for c in channels
    ]
    return tuple(channels), found, dict.fromkeys((s.error for s in history.series), name)


def _widened(answer: Forecast | str, factor: float) -> Forecast | str:
    return answer.widened(factor) if isinstance(answer, Forecast) and factor > 1 else answer


def _without_company(series: Sequence[Series]) -> set[str]:
    """Kinds of error of which no series has two values: nothing is told but the storage of the spec."""
    return {s.error for s in series} - {s.error for s in series if len(s) > 1}


def _by_storage(c: ChannelForecast, model: ErrorModel | None) -> ChannelForecast:
    made = _channel(c.series, STORAGE, "one point tells no drift", c.ahead, model, "none")
    return replace(made, correction=c.correction)


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
