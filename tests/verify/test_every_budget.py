"""Whatever effect of the library the unit has a budget of and none is declared for: plan and verify agree."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from planner import catalog
from planner.protocols import SENSORS
from planner.units import unit_factor
from tests.verify.plans import assert_flown_as_foreseen, planned_from
from tests.verify.test_recount_promise import by_hand, faults_in, prediction

FLIGHTS = 600  # a root of a mean square is known to 3 %, one sigma
UNIT = by_hand()["unit"]
EVERY = [
    f"{sensor}.{name}"
    for name, effect in catalog.effects().items()
    for sensor in SENSORS
    if sensor in effect.sensors and not effect.bench_only and name not in UNIT[sensor]
    if not (effect.tabled and effect.temperature_of)  # of the budget of what changes
]
SOME = ["gyro.g_squared_sensitivity", "accelerometer.warm_up"]
SIZES = {"gyro": 1e-4, "accelerometer": 1e-2}  # SI, of a bias; others in proportion
PER = {"g^2": 96.0, "g**2": 96.0, "/g": 9.8, "/day": 86400.0 * 30.0, "K": 20.0}


def sized(error: str) -> tuple[float, str]:
    """A size in the effect's unit that on most flights adds something, and nothing absurd."""
    sensor, _, name = error.partition(".")
    effect = catalog.effects()[name]
    unit = effect.units[sensor]  # type: ignore[index]  # a part of the error's own name
    unit = "%" if unit == "1" else unit
    size = SIZES[sensor] if effect.group == "bias" else 1e-3
    size /= next((by for word, by in PER.items() if word in unit), 1.0)
    return float(f"{size / unit_factor(unit)[0]:.6g}"), unit


def budgeted(error: str) -> dict[str, Any]:
    """Required are roots of mean squares: constants are drawn evenly, quantiles promised as if by Gauss."""
    spec = by_hand()
    sensor, _, name = error.partition(".")
    size, unit = sized(error)
    own = {"systematic": f"{size:.6g} {unit}", "run_to_run": f"{size / 4:.6g} {unit}"}
    wide = [wanted | {"rule": "rss"} for wanted in spec["requirement"]]
    wide = [r | {"limit": limit} for r, limit in zip(wide, ["90 km", "90 deg"], strict=True)]
    unit_ = spec["unit"] | {sensor: spec["unit"][sensor] | {name: own}}
    return spec | {"unit": unit_, "requirement": wide, "trajectory": "small_uav_1"}


@pytest.mark.parametrize("error", SOME)
@pytest.mark.further("error", [e for e in EVERY if e not in SOME])
def test_it_is_counted_again_and_flown_as_foreseen(error):
    one = planned_from(budgeted(error))
    foreseen = prediction(one)
    assert not faults_in(one.document, foreseen)
    assert_flown_as_foreseen(one, foreseen, FLIGHTS, 0.12)


def test_a_constant_that_nothing_tells_counts_once():
    """A table's value at a temperature that no flight has: s²/3 of the constant and σ² of the power-on."""
    error = "accelerometer.drift_curve_over_temperature"
    one = planned_from(budgeted(error))
    size, unit = sized(error)
    terms, matrix = one.document["covariance"]["terms"], np.array(one.document["covariance"]["matrix"])
    own = [i for i, t in enumerate(terms) if t["error"] == error]
    assert {t["unit"] for t in (terms[i] for i in own)} == {unit}
    whole = size**2 / 3.0 + (size / 4.0) ** 2
    np.testing.assert_allclose(np.diagonal(matrix)[own], whole, rtol=1e-6)
