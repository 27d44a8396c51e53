"""One model for a type of unit: random walk, ageing, season and noise, their sizes learned from the whole
fleet.

The spec's storage is the prior of the sizes (`_hyper`); every forecast is a mixture of Gaussians over what
the fleet leaves open of them, with the level, the ageing and the season of the unit itself. Intervals take
the mixture's variance and, for its tails, Student's t of the same kurtosis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.fleet.forecast._hyper import ATOMS, NOISE, WALK, Fleet, Learned, learned
from planner.fleet.forecast._method import Forecast, Past
from planner.fleet.forecast._states import COLUMNS, States
from planner.nouns.array import Array

_SEED = 20240915
NORMAL = 1e6  # degrees of freedom that are as good as infinite


class Hierarchical:
    """The forecast that dates are made of."""

    name = "hierarchical"
    least = 1
    slow = False
    needs = ""

    def forecast(self, series: Sequence[Past], ahead: Sequence[Array]) -> list[Forecast | str]:
        """One per series, ahead (h,) days."""
        found: list[Forecast | str] = [""] * len(series)
        for kind in dict.fromkeys(s.kind for s in series):
            places = [i for i, s in enumerate(series) if s.kind == kind]
            own = [series[i] for i in places]
            answers = _of_kind(own, [np.asarray(ahead[i], dtype=float) for i in places])
            for i, answer in zip(places, answers, strict=True):
                found[i] = answer
        return found


def _of_kind(series: Sequence[Past], ahead: Sequence[Array]) -> list[Forecast | str]:
    unit = unit_of(series)
    if unit is None:
        why = "hierarchical needs a value more, or the spec's storage"
        return [why] * len(series)
    doubted = [i for i, s in enumerate(series) if s.doubtful]
    every = [*series, *(replace(series[i], doubtful=False) for i in doubted)]
    fleet = fleet_of(every, unit)
    states = states_of(every, fleet, learned(fleet), unit)
    for i, other in zip(doubted, states[len(series) :], strict=True):
        states[i] = states[i].or_else(other)
    return [forecast_of(s, h) for s, h in zip(states[: len(series)], ahead, strict=True)]


def unit_of(series: Sequence[Past]) -> float | None:
    """The size that everything is counted in: the spec's storage, else what 60 days do by the data."""
    storage = [s.storage for s in series if np.isfinite(s.storage) and s.storage > 0]
    if storage:
        return float(np.median(storage))
    steps = [np.diff(s.value) / np.sqrt(np.diff(s.day) / 60.0) for s in series if len(s) > 2]
    size = float(np.median(np.abs(np.concatenate(steps)))) if steps else 0.0
    return size or None


def fleet_of(series: Sequence[Past], unit: float) -> Fleet:
    """The series in storages, padded to one length."""
    n = max(len(s) for s in series)
    day, value, weight = np.zeros((len(series), n)), np.zeros((len(series), n)), np.ones((len(series), n))
    used, fresh = np.zeros((len(series), n), dtype=bool), np.zeros((len(series), n), dtype=bool)
    known = [s.sigma[np.isfinite(s.sigma)] for s in series]
    stated = bool(sum(map(len, known)) > 0.5 * sum(map(len, series)))
    usual = float(np.median(np.concatenate(known))) if stated else 0.0
    for u, s in enumerate(series):
        k = len(s)
        day[u], value[u, :k] = s.day[-1], s.value / unit
        day[u, :k] = s.day
        used[u, :k] = True
        fresh[u, :k] = np.isin(s.day, s.fresh)
        if s.doubtful and k > 1:  # the other way to see it is the same series, its last value believed
            used[u, k - 1] = fresh[u, k - 1] = False
        if stated:
            weight[u, :k] = (np.where(np.isfinite(s.sigma), s.sigma, usual) / unit) ** 2
        elif len(known[u]):
            weight[u, :k] = s.weights
    return Fleet(day, value, weight, used, fresh, stated)


def states_of(series: Sequence[Past], fleet: Fleet, found: Learned, unit: float) -> list[States]:
    """What is left open of every series, SI."""
    rng = np.random.default_rng(_SEED)
    place = found.drawn(rng, ATOMS)  # (U, S, 4)
    sizes = np.stack([found.grid.axes[a][place[..., a]] for a in range(4)], axis=-1)
    lane = place[..., WALK] * found.grid.shape[NOISE] + place[..., NOISE]
    who = np.arange(len(series))[:, None]
    gram, level, variance = (getattr(found.left, k)[who, lane] for k in ("gram", "level", "variance"))
    precision = 4.0 ** -sizes[..., [1, 2, 2]]
    M = gram[..., 1:, 1:] + precision[..., None] * np.eye(COLUMNS)
    covariance = np.linalg.inv(M)
    beta = np.einsum("uspq,usq->usp", covariance, gram[..., 1:, 0])
    A = level[..., 1:]
    middle = level[..., 0] - np.einsum("usp,usp->us", A, beta)
    across = -np.einsum("uspq,usq->usp", covariance, A)
    whole = np.zeros((*lane.shape, 1 + COLUMNS, 1 + COLUMNS))
    whole[..., 0, 0] = variance - np.einsum("usp,usp->us", A, across)
    whole[..., 0, 1:] = whole[..., 1:, 0] = across
    whole[..., 1:, 1:] = covariance
    # the level of the walk is not the value: what goes on steadily is added where it stands on the last day
    return [
        _state(one, unit, fleet, u, middle[u], beta[u], whole[u], sizes[u]) for u, one in enumerate(series)
    ]


def _state(
    one: Past, unit: float, fleet: Fleet, u: int, level: Array, beta: Array, covariance: Array, sizes: Array
) -> States:
    last = len(one) - 1
    x = np.concatenate([[1.0], fleet.columns[u, last, 1:]])
    turn = np.eye(1 + COLUMNS)
    turn[0] = x  # value = level + x β
    noise = 4.0 ** sizes[:, NOISE] * np.median(fleet.weight[u, : last + 1])
    return States(
        float(one.day[-1]),
        unit * (level + beta @ x[1:]),
        unit * beta,
        unit**2 * np.einsum("pq,sqr,tr->spt", turn, covariance, turn),
        unit**2 * 4.0 ** sizes[:, WALK] / 60.0,
        unit**2 * noise,
    )


def forecast_of(states: States, ahead: Array) -> Forecast:
    """Mean, scale and tails of the mixture."""
    mean, variance = states.moments(ahead)
    middle = mean.mean(axis=0)
    apart = mean - middle
    second = (variance + apart**2).mean(axis=0)
    fourth = (3 * variance**2 + 6 * variance * apart**2 + apart**4).mean(axis=0)
    excess = np.maximum(fourth / np.maximum(second, 1e-300) ** 2 - 3.0, 6.0 / NORMAL)
    freedom = 4.0 + 6.0 / excess
    scale = np.sqrt(second * (freedom - 2) / freedom)
    noise = float(np.sqrt(states.noise.mean()))
    return Forecast(middle, scale, noise, freedom, states)


METHOD = Hierarchical()
