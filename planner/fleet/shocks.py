"""Steps and outliers that nobody declared: values that the drift of the type does not explain.

With Σ the covariance of a series' values under the type's sizes of drift and P = Σ⁻¹ after the level is taken
out, a shock of shape d (one value, or all from one on) is tested by

    z² = (d'P y)² / d'P d

(de Jong, Penzer, J. Am. Stat. Assoc. 93, 1998, 796), all days at once from one inverse. The threshold is
Bonferroni's over a unit's channels and days. One that is found is taken out (an outlier) or lets the level
start anew (a step), the sizes are learned again, and what it hid is looked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from planner.fleet.forecast._hyper import SPREADS, Learned, learned
from planner.fleet.forecast._method import Past
from planner.fleet.forecast._states import columns_at
from planner.fleet.forecast.hierarchical import fleet_of, unit_of
from planner.fleet.history import History, Series
from planner.nouns.array import Array
from planner.nouns.progress import Progress, silent
from planner.solvers.distributions import normal_quantile

FALSE = 0.002  # of the units may be told of a shock that was none
ROUNDS = 3  # of learning the sizes; within one, every series is searched until nothing is found
MOST = 0.25  # of the values of a series that may be shocks: beyond it the series is simply rough
FEWEST = 4  # values of a series in which a shock may be sought
BLOCK = 150  # values that are looked at together
_DIFFUSE = 1e4  # variance of a level that is not known, in storages
_ROBUST = 1.4826
_FIRST = 8.0  # robust sigmas of a first look, before sizes are known

Kind = Literal["step", "outlier"]


@dataclass(frozen=True)
class Shock:
    """One shock: what it is, on which day, how large in the series' unit and in sigmas."""

    kind: Kind
    day: float
    size: float
    sigmas: float


@dataclass(frozen=True)
class _Sizes:
    """Sizes of drift in storages: walk and slope of 60 days, amplitude of the year, noise."""

    walk: float
    age: float
    season: float
    noise: float


def without_shocks(history: History, storage: Mapping[str, float], progress: Progress = silent) -> History:
    """The history with steps marked as fresh levels and outliers set aside, one note a unit."""
    progress("steps and outliers")
    series, shocks = list(history.series), dict[tuple[str, str, str], list[Shock]]()
    for kind in dict.fromkeys(s.error for s in series):
        places = [i for i, s in enumerate(series) if s.error == kind]
        level = _threshold(series, kind)
        cleared = _cleared([series[i] for i in places], storage.get(kind, np.nan), level)
        for i, (one, found) in zip(places, cleared, strict=True):
            series[i] = one
            if found:
                shocks[one.unit, one.error, one.term] = found
    return replace(history, series=tuple(series), notes=(*history.notes, *_notes(history, shocks)))


def past_of(one: Series, storage: float) -> Past:
    """A series as methods of forecasting know it."""
    return Past(one.error, one.day, one.value, one.sigma, storage, one.fresh, one.doubtful)


def _threshold(series: Sequence[Series], kind: str) -> float:
    """Sigmas beyond which a shock is no chance, for a usual unit of the fleet."""
    tests = 2.0 * float(np.median([len(s) for s in series if s.error == kind]))
    channels = len(series) / max(len({s.unit for s in series}), 1)
    return float(-normal_quantile(0.5 * FALSE / (tests * channels)))


def _cleared(series: Sequence[Series], storage: float, level: float) -> list[tuple[Series, list[Shock]]]:
    """Every series of a kind without its shocks, and these."""
    found = [(s, list[Shock]()) for s in series]
    unit = unit_of([past_of(s, storage) for s in series])
    if unit is None:
        return found
    first = _first_look(series)
    for turn in range(ROUNDS):
        now = [past_of(s, storage) for s, _ in found] if turn else [past_of(s, storage) for s in first]
        fleet = fleet_of(now, unit)
        sizes = _sizes(learned(fleet))
        again = [_searched(s, unit, sizes, fleet.stated, level) for s in series]
        same = [[(x.kind, x.day) for x in a[1]] for a in again] == [
            [(x.kind, x.day) for x in f[1]] for f in found
        ]
        found = again
        if same and turn:
            break
    return found


def _sizes(known: Learned) -> _Sizes:
    mean, _ = known.sizes()
    by_spread = known.weight.sum(axis=(1, 2, 3, 4))
    apart = float(by_spread @ SPREADS / by_spread.sum())  # a lively unit is not to be taken for a broken one
    walk, age, season, noise = (float(2.0**m) for m in mean)
    more = 2.0 ** (1.5 * apart)
    return _Sizes(walk * more, age, season, noise * more)


def _first_look(series: Sequence[Series]) -> list[Series]:
    """The series with the coarsest steps let go, so that sizes are not learned from them."""
    steps = [np.diff(s.value) / np.sqrt(np.maximum(np.diff(s.day), 1.0)) for s in series]
    every = np.concatenate(steps) if steps else np.zeros(0)
    if len(every) < FEWEST:
        return list(series)
    spread = _ROBUST * float(np.median(np.abs(every - np.median(every))))
    if spread <= 0:
        return list(series)
    found = []
    for one, step in zip(series, steps, strict=True):
        far = np.abs(step) > _FIRST * spread
        few = far.sum() <= max(MOST * len(one), 1)
        fresh = {*one.fresh, *map(float, one.day[1:][far])} if few else set(one.fresh)
        found.append(replace(one, fresh=tuple(sorted(fresh))))
    return found


def _searched(
    one: Series, unit: float, sizes: _Sizes, stated: bool, level: float
) -> tuple[Series, list[Shock]]:
    """A series searched until nothing more is found."""
    found: list[Shock] = []
    most = max(1, int(MOST * len(one)))
    first = one
    while len(one) >= FEWEST and len(found) <= most:
        shock = _largest(one, unit, sizes, stated)
        if shock is None or shock.sigmas <= level:
            return one, sorted(found, key=lambda s: s.day)
        found.append(shock)
        at_end = shock.day == one.day[-1]
        if shock.kind == "outlier" and not at_end:
            one = one.only(one.day != shock.day)
        else:
            one = replace(one, fresh=tuple(sorted({*one.fresh, shock.day})), doubtful=one.doubtful or at_end)
    return (one, sorted(found, key=lambda s: s.day)) if len(found) <= most else (first, [])


def _largest(one: Series, unit: float, sizes: _Sizes, stated: bool) -> Shock | None:
    """The shock with the most sigmas, block by block."""
    n = len(one)
    best: Shock | None = None
    for start in range(0, max(n - BLOCK // 2, 1), BLOCK // 2):
        block = one.only((np.arange(n) >= start) & (np.arange(n) < start + BLOCK))
        shock = _largest_of(block, unit, sizes, stated, first=start == 0)
        if shock is not None and (best is None or shock.sigmas > best.sigmas):
            best = shock
    return best


def _largest_of(one: Series, unit: float, sizes: _Sizes, stated: bool, *, first: bool) -> Shock | None:
    if len(one) < FEWEST:
        return None
    P = np.linalg.inv(_covariance(one, unit, sizes, stated))
    r = P @ (one.value / unit)
    lone = r**2 / np.maximum(np.diag(P), 1e-300)
    after = np.cumsum(r[::-1])[::-1]
    of_step = np.diag(np.cumsum(np.cumsum(P[::-1, ::-1], axis=0), axis=1))[::-1]
    fresh = np.isin(one.day, one.fresh)
    step = np.where(fresh | (np.arange(len(one)) == 0), 0.0, after**2 / np.maximum(of_step, 1e-300))
    alone = fresh & np.append(fresh[1:], True)  # between two fresh levels nothing says that it is wrong
    lone = np.where(alone | (not first and np.arange(len(one)) == 0), 0.0, lone)
    i, j = int(np.argmax(lone)), int(np.argmax(step))
    if step[j] >= lone[i]:
        return Shock("step", float(one.day[j]), float(unit * after[j] / of_step[j]), float(np.sqrt(step[j])))
    return Shock("outlier", float(one.day[i]), float(unit * r[i] / P[i, i]), float(np.sqrt(lone[i])))


def _covariance(one: Series, unit: float, sizes: _Sizes, stated: bool) -> Array:
    """(n, n) of the values in storages; levels that start anew are as good as unknown."""
    t = one.day - one.day[0]
    X = columns_at(one.day)
    X = X - X[0]
    known = (
        one.sigma / unit if stated else np.where(np.isnan(one.sigma), 1.0, np.sqrt(past_of(one, 1.0).weights))
    )
    noise = (sizes.noise * np.where(np.isfinite(known), known, np.nanmedian(known))) ** 2
    S = sizes.walk**2 / 60.0 * np.minimum.outer(t, t) + np.diag(noise) + _DIFFUSE
    S += X @ np.diag([sizes.age**2, sizes.season**2, sizes.season**2]) @ X.T
    for day in one.fresh:
        after = (one.day >= day).astype(float)
        S += _DIFFUSE * np.outer(after, after)
    return np.asarray(S)


def _notes(history: History, shocks: Mapping[tuple[str, str, str], Sequence[Shock]]) -> list[str]:
    """One note a unit: what was found on which days and channels."""
    by_unit: dict[str, dict[tuple[str, float], list[str]]] = {}
    last = {(s.unit, s.error, s.term): float(s.day[-1]) for s in history.series}
    for key, found in shocks.items():
        for shock in found:
            what = "last" if shock.day == last[key] else shock.kind
            by_unit.setdefault(key[0], {}).setdefault((what, shock.day), []).append(f"{key[1]} {key[2]}")
    words = {
        "step": "jumps on {day}, as after a repair: its level starts anew ({who})",
        "outlier": "the value on {day} lies alone and was set aside ({who})",
        "last": "the last value, of {day}, lies apart, an outlier or a jump: both count for now ({who})",
    }
    notes = []
    for unit in sorted(by_unit):
        each = sorted(by_unit[unit].items(), key=lambda item: item[0][1])
        said = [words[w].format(day=history.label(d), who=", ".join(who)) for (w, d), who in each]
        notes.append(f"{unit}: {'; '.join(said)}")
    return notes
