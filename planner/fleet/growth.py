"""How terms grow between visits: by the spec's storage, or as a unit's own forecast knows better.

Without a history a term walks, storage·√((t − s)/60 d). With one it is at first the forecast's |μ(t)| + z
√V(t); a visit on day s measures the residual anew and corrects it, so from then on

    g(s, t) = |E[m(t) − m(s)]| + z √(q (t − s) + Δx' Cov(β | history, visit) Δx)

with what the visit teaches about ageing and season (β of `forecast._states`, Δx = x(t) − x(s)); how well it
measures is taken as one power-on does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.fleet.allowed_region import PARTS, AllowedRegion
from planner.fleet.drift import ChannelForecast
from planner.fleet.forecast._method import Forecast, two_sided
from planner.fleet.forecast._states import States, columns_at
from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.spec.budget import STORAGE_DAYS


@dataclass(frozen=True)
class Growth:
    """How terms move. days: (W,) grid; start: (t,) sizes at days[0]

    between: (t, 1 + W, W) what is added until a day, first from the start on, then from a visit on each day
    """

    days: Array
    start: Array
    between: Array


def growth_of(
    region: AllowedRegion,
    models: Sequence[ErrorModel],
    days: Array,
    confidence: float,
    channels: Sequence[ChannelForecast] = (),
    measured: Array | None = None,
    adds: bool = True,
) -> Growth:
    """What the spec says of storage, and what a unit's forecasts know better.

    measured: (t,) one sigma of what a visit measures of every term, infinite where it sees nothing; adds:
    whether sizes add (else their squares do)
    """
    storage = {m.name: m.storage for m in models}
    start = region.parts[:, PARTS.index("estimate")].copy()
    apart = np.maximum(days[None, :] - days[:, None], 0.0)
    walk = np.sqrt(np.concatenate([apart[:1], apart]) / STORAGE_DAYS)
    between = np.array([storage.get(t.error, 0.0) * walk for t in region.terms])
    for c in channels:
        place = region.index(c.series.error, c.series.term)
        f = c.at(days)
        if place is None or f is None:
            continue
        z = np.broadcast_to(two_sided(confidence, f.freedom), days.shape)
        size = np.abs(f.mean - c.correction) + z * f.scale
        start[place] = size[0]
        between[place, 0] = _added(size, adds)
        sigma = np.inf if measured is None else float(measured[place])
        between[place, 1:] = _after_visits(f, c.series.day[-1], days, z, sigma)
    return Growth(days, start, between)


def _added(size: Array, adds: bool) -> Array:
    """(W,) what must be added to the first size to have each."""
    if adds:
        return np.asarray(size - size[0])
    return np.asarray(np.sqrt(np.maximum(size**2 - size[0] ** 2, 0.0)))


def _after_visits(f: Forecast, last: float, days: Array, z: Array, sigma: float) -> Array:
    """(W, W) g(s, t) of a channel."""
    if f.states is None:
        variance = np.maximum.accumulate(f.scale**2)
        apart = np.maximum(days[None, :] - days[:, None], 0.0)
        # a method that knows no states: what it adds from today on is added after a visit, too
        mean = np.abs(np.interp(apart, days - days[0], f.mean) - f.mean[0])
        return np.asarray(mean + z[0] * np.sqrt(np.interp(apart, days - days[0], variance - variance[0])))
    mean, variance = _taught(f.states, np.maximum(days - last, 0.0), sigma)
    grown = np.abs(mean) + z[None, :] * np.sqrt(variance)
    later = np.triu(np.ones((len(days), len(days))), 1)
    # a later visit never leaves more: with a season it might by chance, and the search relies on it
    return np.asarray(np.maximum.accumulate((grown * later)[::-1], axis=0)[::-1] * later)


def _taught(states: States, ahead: Array, sigma: float) -> tuple[Array, Array]:
    """(W, W) mean and variance of m(t) − m(s) for a visit at s that measures m(s) to sigma."""
    x = columns_at(states.last + ahead)
    moved = x[None, :, :] - x[:, None, :]  # (s, t, p)
    of_value = np.einsum("Sij,sj->Ssi", states.covariance, states.moved(ahead))[..., 1:]  # cov(β, m(s))
    total = states.moments(ahead)[1] + sigma**2
    learned = np.einsum("Ssp,Ssq->spq", of_value / total[..., None], of_value) / len(states.level)
    open_ = states.covariance[:, 1:, 1:].mean(axis=0) + np.cov(states.beta.T, bias=True) - learned
    own = ((moved @ open_) * moved).sum(axis=2)
    apart = np.maximum(ahead[None, :] - ahead[:, None], 0.0)
    walk = float(states.walk.mean()) * apart
    return moved @ states.beta.mean(axis=0), np.maximum(own, 0.0) + walk
