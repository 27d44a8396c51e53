"""The published network: 14 weekly values in, two hidden layers of 14, 7 values out, sigmoid (K 3.5).

All windows of 14 + 7 weeks of all series of a kind teach one network (scikit-learn's MLPRegressor, logistic
units, L-BFGS). Every window is taken relative to its last value, in units of the steps of its kind; further
than 7 weeks the network is fed with its own output, K's second forecast. Its intervals are those of its
errors on windows that it had not seen: with 28 weeks or more of the last quarter of each history, which a
second network was taught without; with fewer, K's own 21 among them, of the histories left out of up to five
networks. One of 21 to 27 weeks leaves nothing unseen: its intervals are those of a walk by its steps.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planner.fleet.forecast._method import DAYS_A_WEEK, Forecast, Past, too_short
from planner.nouns.array import Array

WEEKS_IN, WEEKS_OUT, HIDDEN = 14, 7, (14, 14)
_LONGEST_GAP_DAYS = 15.0  # a missed week is read between its neighbours, two are not
_MOST_WINDOWS = 4000
_MOST_FOLDS = 5
_SEED = 7


@dataclass(frozen=True)
class _Taught:
    """A network with the size of its kind's steps and its errors (7,) on windows that it had not seen."""

    network: Any
    size: float
    error: Array
    freedom: float


class Neural:
    """Krylov's network."""

    name = "neural"
    least = WEEKS_IN + WEEKS_OUT
    slow = True
    needs = "sklearn"

    def forecast(self, series: Sequence[Past], ahead: Sequence[Array]) -> list[Forecast | str]:
        """One per series, ahead (h,) days."""
        weekly = [too_short(self, s) or _weekly(s) for s in series]
        taught: dict[str, _Taught] = {}
        for kind in dict.fromkeys(s.kind for s in series):
            able = [
                w for w, s in zip(weekly, series, strict=True) if s.kind == kind and not isinstance(w, str)
            ]
            if able:
                taught[kind] = _teach(able)
        return [
            w if isinstance(w, str) else _one(taught[s.kind], w, np.asarray(h, dtype=float))
            for w, s, h in zip(weekly, series, ahead, strict=True)
        ]


def _weekly(one: Past) -> Array | str:
    if np.diff(one.day).max() > _LONGEST_GAP_DAYS:
        return "neural needs weekly values; the history has a gap of more than two weeks"
    weeks = np.arange(one.day[-1], one.day[0] - 1e-9, -DAYS_A_WEEK)[::-1]
    if len(weeks) < Neural.least:
        return f"neural needs {Neural.least} weeks of values, there are {len(weeks)}"
    return np.asarray(np.interp(weeks, one.day, one.value))


def _windows(values: Array, size: float) -> tuple[Array, Array]:
    every = np.lib.stride_tricks.sliding_window_view(values, WEEKS_IN + WEEKS_OUT)
    base = every[:, WEEKS_IN - 1 : WEEKS_IN]
    return (every[:, :WEEKS_IN] - base) / size, (every[:, WEEKS_IN:] - base) / size


def _teach(weekly: Sequence[Array]) -> _Taught:
    size = float(np.sqrt(np.mean(np.concatenate([np.diff(w) for w in weekly]) ** 2))) or 1.0
    long = [w for w in weekly if len(w) >= WEEKS_IN + 2 * WEEKS_OUT]
    if long:
        wrong, count = _unseen_weeks(long, size), len(long)
    elif len(weekly) > 1:
        wrong, count = _unseen_series(weekly, size), len(weekly)
    else:
        wrong, count = np.sqrt(np.arange(1.0, WEEKS_OUT + 1.0))[None], 1
    error = np.maximum.accumulate(np.sqrt(np.mean(wrong**2, axis=0)))
    # windows of one series overlap: as many independent errors as there are series, at least three
    return _Taught(_network([_windows(w, size) for w in weekly]), size, error, max(3.0, float(count)))


def _unseen_weeks(weekly: Sequence[Array], size: float) -> Array:
    """(w, 7) errors on the windows of the last quarter of each history, of a network taught without them."""
    cuts = [len(w) - max(WEEKS_OUT, len(w) // 4) for w in weekly]
    early = [_windows(w[:c], size) for w, c in zip(weekly, cuts, strict=True)]
    late = [_windows(w[c - WEEKS_IN :], size) for w, c in zip(weekly, cuts, strict=True)]
    return _errors(_network(early), late)


def _unseen_series(weekly: Sequence[Array], size: float) -> Array:
    """(w, 7) errors on all windows of each history, of networks taught by the others."""
    every = [_windows(w, size) for w in weekly]
    folds = min(_MOST_FOLDS, len(every))
    return np.concatenate(
        [
            _errors(_network([w for i, w in enumerate(every) if i % folds != k]), every[k::folds])
            for k in range(folds)
        ]
    )


def _errors(network: Any, windows: Sequence[tuple[Array, Array]]) -> Array:
    return np.concatenate([y - network.predict(x).reshape(y.shape) for x, y in windows])


def _network(windows: Sequence[tuple[Array, Array]]) -> Any:
    from sklearn.neural_network import MLPRegressor

    x, y = (np.concatenate([w[i] for w in windows]) for i in (0, 1))
    every = -(-len(x) // _MOST_WINDOWS)
    network = MLPRegressor(
        hidden_layer_sizes=HIDDEN, activation="logistic", solver="lbfgs", max_iter=200, random_state=_SEED
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # 200 steps are enough: further ones learn the noise
        network.fit(x[::every], y[::every])
    return network


def _one(taught: _Taught, weekly: Array, ahead: Array) -> Forecast:
    known, rounds = list(weekly), int(np.ceil(max(float(ahead.max()), 1.0) / (DAYS_A_WEEK * WEEKS_OUT)))
    for _ in range(rounds):
        last = np.array(known[-WEEKS_IN:])
        out = taught.network.predict(((last - last[-1]) / taught.size)[None])[0]
        known += list(last[-1] + taught.size * out)
    values = np.array(known[len(weekly) - 1 :])
    weeks = np.arange(len(values)) * DAYS_A_WEEK
    # errors of rounds that build on each other add up
    error = np.concatenate(
        [[0.0], *(np.hypot(taught.error, np.sqrt(k) * taught.error[-1]) for k in range(rounds))]
    )
    mean, scale = np.interp(ahead, weeks, values), np.interp(ahead, weeks, error) * taught.size
    return Forecast(mean, scale, 0.0, taught.freedom)


METHOD = Neural()
