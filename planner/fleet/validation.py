"""Rolling origins: every method forecasts what came later from what came before, and the errors decide.

Of each series up to six origins are cut off; the values after each, at most seven steps ahead, are the test.
Scores of all series of a kind are taken together. The best method is the one with the least mean interval
score (Gneiting, Raftery, J. Am. Stat. Assoc. 102, 2007: width plus 2/α times what lies outside) among those
whose root mean square error is below that of `naive` on the same cases; with none of them it is `naive`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.errors import Fault, InputError
from planner.fleet.forecast._method import Forecast, Method, Past
from planner.nouns.array import Array

ORIGINS = 6
STEPS_AHEAD = 7
SAMPLED = 12  # series of a kind on which a slow method is tried
SAMPLED_ORIGINS = 3
LEAST_CASES = 4
NAIVE = "naive"
MODEL = "hierarchical"  # the one that dates are made of
_CLOSE = 0.05  # scores that differ by less are one; the faster method, tried on all series, is then taken
_DOUBT = 0.01  # probability below which the intervals of a method count as too narrow


@dataclass(frozen=True)
class MethodScore:
    """One method on the series of one kind.

    cases: values forecast; rmse, naive_rmse: SI, on the same cases; coverage: share inside the intervals
    score: mean interval score, SI; factor: by which its intervals are widened, at least 1
    compared: its score on the cases on which slow methods were tried, too, by which methods are chosen
    why: why there is no score
    """

    kind: str
    method: str
    cases: int
    rmse: float
    naive_rmse: float
    coverage: float
    score: float
    factor: float
    compared: float = np.nan
    recommended: bool = False
    why: str = ""

    @property
    def beats_naive(self) -> bool:
        """Whether its error is smaller on the same cases."""
        return self.cases > 0 and self.rmse < self.naive_rmse


REMEDY = "pip install 'planner[forecast]'"


def methods() -> dict[str, Method]:
    """All methods by name, naive first."""
    found = catalog.plugins("planner.fleet.forecast", "METHOD")
    return {NAIVE: found[NAIVE], **{name: m for name, m in found.items() if name != NAIVE}}


def installed() -> list[str]:
    """The names of the methods whose packages are installed."""
    return [name for name, m in methods().items() if not m.needs or find_spec(m.needs) is not None]


def left_out() -> tuple[str, ...]:
    """What is to be said where methods could not be compared."""
    lacking = [name for name in methods() if name not in installed()]
    return (f"not compared, for lack of their packages: {', '.join(lacking)}; {REMEDY}",) if lacking else ()


def method_named(name: str) -> Method:
    """One method. Raises InputError for an unknown name, and for one whose package is not installed."""
    known = methods()
    if name not in known:
        raise InputError(f"--method: unknown method {name!r}; known are {', '.join(known)}, or auto")
    if name not in installed():
        said = f"needs {known[name].needs}, which is not installed; {REMEDY}, or forecast by 'auto'"
        raise InputError("no forecast", [Fault(f"--method {name}", 0, 0, "", said, "P811")])
    return known[name]


def scores(series: Sequence[Past], confidence: float, names: Sequence[str]) -> tuple[MethodScore, ...]:
    """Every method on every kind, with the recommended one marked; naive is always among them."""
    found: list[MethodScore] = []
    for kind in dict.fromkeys(s.kind for s in series):
        own = [s for s in series if s.kind == kind]
        each = [_score(kind, methods()[name], own, confidence) for name in dict.fromkeys((NAIVE, *names))]
        each = [_compared(score, own, confidence) for score in each]
        best = recommended(each)
        found += [MethodScore(**{**vars(score), "recommended": score.method == best}) for score in each]
    return tuple(found)


def recommended(each: Sequence[MethodScore]) -> str | None:
    """The method to use, None when nothing could be validated."""
    naive = next(s for s in each if s.method == NAIVE)
    if naive.cases < LEAST_CASES:
        return None
    able = [s for s in each if s.cases >= LEAST_CASES and s.beats_naive]
    if not able:
        return NAIVE
    best = min(s.compared for s in able)
    close = [s for s in able if s.compared <= best * (1 + _CLOSE)]
    # a sample tells scores to some per cent; of equals the one that was tried on all series
    return min(close, key=lambda s: (methods()[s.method].slow, s.compared)).method


@dataclass(frozen=True)
class _Case:
    """One origin of one series: what was known, and (h,) days and values that came later."""

    series: int
    past: Past
    ahead: Array
    later: Array


def _cases(series: Sequence[Past], least: int, origins: int) -> list[_Case]:
    found = []
    for i, one in enumerate(series):
        first = max(least, 2)
        if len(one) <= first:
            continue
        every = np.unique(np.linspace(first, len(one) - 1, origins).round().astype(int))
        if len(one) - 1 - first >= 2 * STEPS_AHEAD:  # old origins tell less of what comes next
            every = np.unique(
                np.linspace(max(first, len(one) // 2), len(one) - 1, origins).round().astype(int)
            )
        for origin in every:
            end = min(origin + STEPS_AHEAD, len(one))
            cut = {name: getattr(one, name)[:origin] for name in ("day", "value", "sigma")}
            past = replace(one, **cut, doubtful=False)
            found.append(_Case(i, past, one.day[origin:end] - one.day[origin - 1], one.value[origin:end]))
    return found


def _compared(score: MethodScore, series: Sequence[Past], confidence: float) -> MethodScore:
    """The score with that on the sample; a fast method is tried on it once more."""
    method = methods()[score.method]
    same = score if method.slow else _score(score.kind, method, series, confidence, sampled=True)
    return MethodScore(**{**vars(score), "compared": same.score})


def _score(
    kind: str, method: Method, series: Sequence[Past], confidence: float, *, sampled: bool = False
) -> MethodScore:
    chosen, origins = list(series), ORIGINS
    if method.slow or sampled:
        places = np.unique(np.linspace(0, len(series) - 1, min(SAMPLED, len(series))).round().astype(int))
        chosen, origins = [series[i] for i in places], SAMPLED_ORIGINS
    cases = _cases(chosen, max(method.least, methods()[NAIVE].least), origins)
    nothing = MethodScore(kind, method.name, 0, np.nan, np.nan, np.nan, np.nan, 1.0)
    if not cases:
        return _because(nothing, f"needs more than {method.least} points to be tried")
    made = method.forecast([c.past for c in cases], [c.ahead for c in cases])
    able = [(c, f) for c, f in zip(cases, made, strict=True) if isinstance(f, Forecast)]
    if not able:
        return _because(nothing, next(str(f) for f in made))
    return _scored(kind, method.name, [c for c, _ in able], [f for _, f in able], confidence)


def _because(score: MethodScore, why: str) -> MethodScore:
    return MethodScore(**{**vars(score), "why": why})


def _scored(
    kind: str, name: str, cases: Sequence[_Case], made: Sequence[Forecast], confidence: float
) -> MethodScore:
    wrong = np.concatenate([c.later - f.mean for c, f in zip(cases, made, strict=True)])
    still = np.concatenate([c.later - c.past.value[-1] for c in cases])
    half = np.concatenate([f.half_width(confidence) for f in made])
    outside = np.maximum(np.abs(wrong) - half, 0.0)
    owner = np.concatenate([np.full(len(c.later), c.series) for c in cases])
    return MethodScore(
        kind,
        name,
        len(wrong),
        float(np.sqrt(np.mean(wrong**2))),
        float(np.sqrt(np.mean(still**2))),
        float(np.mean(outside == 0)),
        float(np.mean(2 * half + 2 / (1 - confidence) * outside)),
        _factor(wrong, half, owner, confidence),
    )


def _factor(wrong: Array, half: Array, owner: NDArray[np.int64], confidence: float) -> float:
    """By how much the intervals must be widened to hold what they promise; 1 unless that is beyond doubt.

    Errors of one series depend on each other, so a series counts once, by its share of values inside.
    """
    from scipy.special import bdtr

    inside = np.abs(wrong) <= half
    per = np.array([inside[owner == s].mean() for s in np.unique(owner)])
    n = len(per)
    if bdtr(round(float(per.sum())), n, confidence) >= _DOUBT:
        return 1.0
    return max(1.0, float(np.quantile(np.abs(wrong) / np.maximum(half, 1e-300), confidence)))
