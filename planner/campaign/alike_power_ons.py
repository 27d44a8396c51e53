"""Power-ons that tell the same, as one that is made so many times.

    M = Λ + Σ_k n_k A_kᵀ V_k⁻¹ A_k

A campaign with the most repeats has thousands of power-ons of a few dozen kinds; what tells those of one kind
apart is the day on which they are made, by the walk of errors since. That is known by places (`walk_modes`),
and power-ons of one place are alike.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.campaign.power_ons import PowerOns
from planner.campaign.prior import PLACES, walked_since
from planner.nouns.array import Array
from planner.protocols import SENSORS
from planner.spec.model import Spec

DIGITS = 6  # of what power-ons have in common, SI: times of a plan are sums of 1e7 s


def alike_together(runs: PowerOns, spec: Spec) -> PowerOns:
    """The power-ons with those that are alike counted; as they are where an effect goes by the day itself."""
    if _by_day(spec):
        return runs
    ago, span = walked_since(runs.conditions.day[runs.starts])
    place = np.round(ago / span * PLACES) if span > 0.0 else np.zeros(len(ago))
    groups: dict[object, list[int]] = {}
    for number, name in enumerate(_names(runs, place)):
        groups.setdefault(name, []).append(number)
    if len(groups) == len(place):
        return runs
    kept = np.array([group[0] for group in groups.values()])
    counts = np.array([float(runs.counts[group].sum()) for group in groups.values()])
    later = ago - place * (span / PLACES)  # to the middle of its place
    return _some(runs, kept, counts, later)


def _by_day(spec: Spec) -> bool:
    known = catalog.effects()
    names = {*spec.effects, *(effect for sensor in SENSORS for effect in getattr(spec.unit, sensor))}
    return any("day" in known[name].needs for name in names)


def _names(runs: PowerOns, place: Array) -> Iterator[object]:
    """(g,) equal for power-ons that are alike."""
    c = runs.conditions
    seen = [c.rate, c.specific_force, c.temperature_degc[:, None], c.temperature_rate[:, None]]
    seen += [c.time_on[:, None], runs.duration[:, None]]
    if runs.installation is not None:
        seen.append(runs.installation[:, None].astype(float))
    if runs.misplaced is not None:
        seen.append(runs.misplaced.reshape(len(runs), -1))
    rows = np.round(np.hstack(seen), DIGITS) + 0.0  # no zero of a sign
    bench = np.full(len(runs), "") if runs.bench is None else runs.bench
    for a, n, p in zip(runs.starts, runs.sizes, place, strict=True):
        yield rows[a : a + n].tobytes(), str(bench[a]), float(p)


def _some(runs: PowerOns, kept: NDArray[np.intp], counts: Array, later: Array) -> PowerOns:
    """Some power-ons, made so often, each so many days later."""
    sizes = runs.sizes[kept]
    rows = np.concatenate([np.arange(a, a + n) for a, n in zip(runs.starts[kept], sizes, strict=True)])
    own = runs.conditions.at(rows)
    return replace(
        runs,
        conditions=replace(own, day=own.day + np.repeat(later[kept], sizes)),
        duration=runs.duration[rows],
        starts=np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64),
        counts=counts,
        bench=None if runs.bench is None else runs.bench[rows],
        installation=None if runs.installation is None else runs.installation[rows],
        misplaced=None if runs.misplaced is None else runs.misplaced[rows],
    )
