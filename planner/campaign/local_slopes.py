"""Curves around the temperatures at which a chamber was soaked: a table's chords do not have their slope.

    y = … + x (T − T_k) s_k,   s_k ~ N(0, σ²),   σ = 2π A / (T_max − T_min)

A chamber strays by some 0.05 K from record to record, a unit warms up by more, and the records of one
power-on tell the slope there by their own noise. The fit takes it for that of the chords, which tell what the
nodes differ by: where power-ons scatter far more than records, as of the cheapest sensors, nodes 40 K apart
were 7 mg off that one power-on tells to 2, and 68 % of intervals held the truth. So each soaked node has a
slope of its own, an unknown with a prior as steep as one wave of the curve's size A over the temperatures of
use.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planner.campaign.noise import budget_of, columns_of_errors
from planner.campaign.prior import Prior, Shared, Unknown, of_unknowns
from planner.measurement import ChannelModel, Parts
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.spec.model import Spec
from planner.temperature_table import from_soaked


def local_slopes(model: ChannelModel, parts: Parts, spec: Spec) -> Prior:
    """s_k, SI/K, of a channel's tables whose error has a curve in the spec; none where nothing strays."""
    return of_unknowns(_slopes(model, parts, spec), len(model.conditions.time_on))


def steepest(curve_size: float, spec: Spec) -> float:
    """σ, SI/K: the slope of one wave of that size over the temperatures of use."""
    low, high = spec.plan.temperatures.range
    return 2.0 * np.pi * curve_size / max(high - low, 1.0)


def _slopes(model: ChannelModel, parts: Parts, spec: Spec) -> Iterator[Unknown]:
    columns: dict[ErrorName, list[Array]] = {}
    for (error, _), x in columns_of_errors(model, parts).items():
        columns.setdefault(error, []).append(x)
    for carried in model.carried:
        error = ErrorName.of(model.sensor, carried.effect.name)
        budget = budget_of(spec.unit, error)
        if carried.nodes is None or len(carried.nodes) < 2 or budget is None or budget.curve_size <= 0.0:
            continue
        nearest, apart = from_soaked(model.conditions.temperature_degc, carried.nodes)
        for x in columns[error]:
            for k, node in enumerate(carried.nodes.tolist()):
                unknown = Shared(f"slope of {error} at {node:.3g} degC", "slope")
                yield unknown, x * np.where(nearest == k, apart, 0.0), steepest(budget.curve_size, spec)
