"""Values that cannot be right: readings that stand still, and slips of a unit or of the decimal point.

Looked for before anything is learned from them, by what the spec's storage says of the size of a drift. What
is suspected is set aside and said first: the remedy is at somebody's desk, not on a bench.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.fleet.history import History, Series
from planner.nouns.array import Array
from planner.units import displayed

STILL = 4  # equal values with a stated uncertainty, all there are, are no measurements
CHANCE = 1e-6  # of equal values in a row among others that differ
FAR = 30.0  # storages (and times the other values) from which a slip is likelier than a drift
_PER_DAYS = 60.0
_NEAR = 0.35  # relative: how near a ratio must lie to that of two units
_RATIOS = (10.0, 60.0, 57.29577951308232, 100.0, 1000.0, 3600.0, 9.80665, 101.9716, 1e6)


@dataclass(frozen=True)
class _Found:
    """What is suspected of a series, and the points that are kept of it."""

    keep: NDArray[np.bool_]
    said: str = ""


def without_suspects(history: History, storage: Mapping[str, float]) -> History:
    """The history without values that cannot be right, each unit's said in `suspects`; storage: SI, by
    error."""
    series, by_unit = [], dict[str, list[str]]()
    for one in history.series:
        slip = _slip(one, history, storage.get(one.error, 0.0))
        still = _still(one.only(slip.keep), history)
        said = [f"{one.error} {one.term} {found.said}" for found in (slip, still) if found.said]
        if said:
            by_unit.setdefault(one.unit, []).extend(said)
        series.append(one.only(slip.keep).only(still.keep))
    suspects = [f"{unit}: {'; '.join(texts)}" for unit, texts in sorted(by_unit.items())]
    return replace(history, series=tuple(series), suspects=(*history.suspects, *suspects))


def _slip(one: Series, history: History, storage: float) -> _Found:
    """Values so far from all others that no drift brings them there."""
    keep = np.ones(len(one), dtype=bool)
    if len(one) < 2 or storage <= 0:
        return _Found(keep)
    said = []
    for i in _far(one, storage):
        keep[i] = False
        others = float(np.median(np.abs(np.delete(one.value, i))))
        ratio = abs(float(one.value[i])) / others if others > 0 else np.inf
        said.append(
            f"is {_shown(one, i)} on {history.label(one.day[i])} after {_shown(one, i - 1 if i else 1)}: a "
            f"slip of the unit or decimal point is suspected{_ratio_words(ratio)}; it was set aside. "
            "Correct it, or write `repair` beside it"
        )
    return _Found(keep, "; ".join(said[:2])) if 0 < len(said) < len(one) / 2 + 0.5 else _Found(keep | True)


def _far(one: Series, storage: float) -> list[int]:
    """Places of values that lie alone, far beyond what others and the storage allow."""
    found: list[int] = []
    order = np.argsort(-np.abs(one.value))
    for i in order:
        rest = np.delete(np.arange(len(one)), [*found, i])
        if len(rest) == 0:
            break
        near = rest[np.argmin(np.abs(one.day[rest] - one.day[i]))]
        apart = max(abs(float(one.day[near] - one.day[i])) / _PER_DAYS, 1.0)
        size = max(float(np.abs(one.value[rest]).max()), storage * np.sqrt(apart), _noise(one))
        if abs(float(one.value[i])) <= FAR * size:
            break
        found.append(int(i))
    return found


def _noise(one: Series) -> float:
    known = one.sigma[np.isfinite(one.sigma)]
    return float(np.median(known)) if len(known) else 0.0


def _ratio_words(ratio: float) -> str:
    """`(about 1000 times)` where the ratio is one of two units."""
    for known in _RATIOS:
        if abs(np.log(ratio / known)) < _NEAR:
            return f" (about {known:.4g} times)"
    return ""


def _shown(one: Series, i: int) -> str:
    return f"{displayed(float(one.value[i]), one.display):.4g} {one.display}".replace(" 1", "")


def _still(one: Series, history: History) -> _Found:
    """Runs of equal values that noise of the stated size does not give."""
    keep = np.ones(len(one), dtype=bool)
    stated = np.isfinite(one.sigma)
    if len(one) < STILL or not stated.any():
        return _Found(keep)
    first, length = _longest_run(one.value)
    if length < STILL:
        return _Found(keep)
    apart = np.diff(np.unique(one.value))
    if length < len(one):
        step = float(apart.min()) if len(apart) else 0.0
        each = min(step / (2 * np.sqrt(np.pi) * float(np.median(one.sigma[stated]))), 1.0)
        if len(one) * each ** (length - 1) > CHANCE:
            return _Found(keep)
    keep[first + 1 : first + length] = False
    return _Found(
        keep,
        f"is {_shown(one, first)} {length} times in a row from {history.label(one.day[first])} on, though "
        "its stated uncertainty is not zero: a reading that is stuck, or copied; the first one was used",
    )


def _longest_run(value: Array) -> tuple[int, int]:
    """First place and length of the longest run of equal values."""
    edges = np.flatnonzero(np.concatenate([[True], np.diff(value) != 0, [True]]))
    lengths = np.diff(edges)
    k = int(np.argmax(lengths))
    return int(edges[k]), int(lengths[k])
