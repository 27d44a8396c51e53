"""What records have in common beside references: each a column of one sigma, an unknown with a prior.

Steps of walks in store, constants of what is budgeted and not declared, slopes of curves about soaked nodes.
"""

from __future__ import annotations

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.spec.budget import STORAGE_DAYS
from planner.verify.declared import Declared
from planner.verify.draws import Unit
from planner.verify.nodes import APART_K
from planner.verify.records import Records

_STEPS = 16  # of the campaign's days, at most, by which errors walk
_NOTHING = 1e-3  # share of the variance of the mean power-on, below which a walk is nothing


def walked(model: Declared, records: Records, unit: Unit) -> list[Array]:
    """(n c,) what the records see of every step of every error's walk; none where power-ons scatter far more.

    A record sees the steps after it, with their sign turned: what is estimated is the value of the last day.
    """
    ago = np.max(records.on_day) - records.on_day
    span = float(ago.max())
    if span <= 0.0:
        return []
    bins, at = np.unique(ago, return_inverse=True)
    if len(bins) > _STEPS:
        bins, at = np.unique(np.round(ago / span * _STEPS), return_inverse=True)
    middle = np.bincount(at, ago) / np.bincount(at)
    before = at[:, None] >= np.arange(len(bins))
    width = np.diff(middle, prepend=0.0) / STORAGE_DAYS
    found = []
    for (sensor, effect), b in unit.budgets.items():
        walked = b.storage_sigma**2 * span / STORAGE_DAYS
        if sensor != model.sensor or walked <= _NOTHING * b.run_to_run_largest**2 / len(records.runs):
            continue
        x = catalog.effects()[effect].regressors(sensor, records.conditions)[:, list(model.channels)]
        steps = b.storage_sigma * before * np.sqrt(width)
        found += [*np.einsum("nct,ns->tsnc", x, steps).reshape(-1, x.shape[0] * x.shape[1])]
    return found


def undeclared(model: Declared, records: Records, unit: Unit) -> list[Array]:
    """(n c,) one sigma of every constant that is budgeted and that no declared effect has."""
    fitted = {c.effect for c in model.columns}
    found = []
    for (sensor, name), b in unit.budgets.items():
        effect = catalog.effects()[name]
        known = name in fitted or (effect.tabled and effect.temperature_of in fitted)
        if sensor == model.sensor and not known and b.whole_variation > 0.0:
            x = effect.regressors(sensor, records.conditions)[:, list(model.channels)]
            sigma = b.whole_variation / float(np.sqrt(3.0))  # anywhere within the budget
            found += [*(sigma * np.moveaxis(x, 2, 0).reshape(x.shape[2], -1))]
    return found


def slopes_of(model: Declared, records: Records, unit: Unit, span: tuple[float, float]) -> list[Array]:
    """(n c,) one sigma of the slope of every curve about every node that the chamber was soaked at."""
    degc, found = records.conditions.temperature_degc, []
    for effect, index in dict.fromkeys((c.effect, c.index) for c in model.columns):
        nodes = np.array([c.node_degc for c in model.columns if (c.effect, c.index) == (effect, index)])
        budget = unit.budgets.get((model.sensor, effect))
        if budget is None or np.isnan(nodes).any() or len(nodes) < 2:
            continue
        steep = 2.0 * np.pi * budget.curve_size / max(span[1] - span[0], 1.0)
        x = catalog.effects()[effect].regressors(model.sensor, records.conditions)[:, model.channels, index]
        at = np.argmin(np.abs(degc[:, None] - nodes), axis=1)
        for k, node in enumerate(nodes):
            off = np.where(at == k, degc - node, 0.0)
            if np.abs(off).max() <= APART_K:
                found.append((steep * off[:, None] * x).ravel())
    return found
