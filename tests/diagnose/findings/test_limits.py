"""Six faces that lean by a thousandth of a degree: the products of two axes are roundings, and no limit."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.within_input import most_of_terms
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.few_power_ons import G, few_power_ons
from tests.specs import shipped

SPEC = shipped("small_uav").spec
LEAN = 2e-5  # rad


def leaning(seed: int, product: float = 0.0, lean: float = LEAN) -> DwellTable:
    """Faces that lean by as much, which the table says. product: of the axes, on accelerometer z, g/g²."""
    return few_power_ons(10, seed, lean=lean, hidden={"acc_z": lambda f, t: product * f[:, 0] * f[:, 1]})


@pytest.mark.parametrize("seed", [1, 2])
def test_a_regressor_that_hardly_acts_has_no_limit(seed: int) -> None:
    """As "no larger than 1160 and 1470 mg/g²" of records whose whole input was 1 g; what acts has one."""
    found = diagnose(leaning(seed), SPEC)
    limits = {(n.effect, n.sensor): n.upper_limit for n in found.not_found}
    why = {(u.effect, u.sensor): u.why for u in found.untestable}
    assert "hardly drive it" in why["cross_coupling", "accelerometer"]
    assert limits["g_sensitivity", "gyro"] < np.radians(0.01) / G
    wide = diagnose(leaning(seed, lean=0.1), SPEC)
    assert {n.effect for n in wide.not_found if n.sensor == "accelerometer"} >= {"cross_coupling"}


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_named_that_would_be_more_than_its_input(seed: int) -> None:
    """40 g/g² explains what it was made of, by some 100 sigma; on an edge a unit would read 20 g beside 1."""
    found = diagnose(leaning(seed, product=40.0), SPEC)
    assert "cross_coupling" not in {e.effect for e in found.effects}


@pytest.mark.parametrize(
    ("name", "sensor", "most"),
    [
        ("g_sensitivity", "gyro", np.radians(100.0) / G),
        ("cross_coupling", "accelerometer", 1.0 / G),
        ("drift", "gyro", np.radians(100.0) / 3600.0),
        ("misalignment_temperature", "accelerometer", 1.0 / 80.0),
    ],
)
def test_the_most_of_a_coefficient_is_its_input_over_its_column(name: str, sensor: str, most: float) -> None:
    """By hand, at rest: the least of inputs counts, 100 deg/s and a gravity; cold is 80 K from the room."""
    records = few_power_ons(1, 0).conditions()
    rests = records.at(np.linalg.norm(records.rate, axis=1) < np.radians(1.0))
    found = most_of_terms(Block(name, sensor, {}, ()), rests)
    assert min(found.values()) == pytest.approx(most)
