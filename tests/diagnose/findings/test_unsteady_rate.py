"""Gyros that all scatter with the rate were turned by another rate than is written; one alone was not."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.findings import unsteady_rate
from planner.nouns.dwell_table import DwellTable
from planner.pipelines.data import simulate
from planner.simulate.settings import settings_of
from tests.diagnose.hall import days, hidden, read
from tests.diagnose.worlds import whole
from tests.specs import SHIPPED, loaded

SHARE = 5e-4


def _scattered(seed: int, axes: tuple[int, ...], size: float = SHARE) -> DwellTable:
    """Every turn by another share of its rate, on some gyros."""
    hall, rng = days(seed, 12), np.random.default_rng([seed, 71])
    share = size * rng.normal(size=len(hall.run))
    table = read(hall, seed)
    for axis in axes:
        table = hidden(table, "gyro", axis, share * hall.turn[:, axis])
    return table


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_a_table_that_does_not_hold_its_rate(seed: int) -> None:
    """Nothing was said of it: the noise had taken it up."""
    found = whole(_scattered(seed, (0, 1, 2)))
    assert not found.effects
    (rate,) = found.reference_suspects
    assert rate.hypothesis == "table_rate"
    assert rate.low < SHARE < rate.high
    assert found.verdict == "explained"


@pytest.mark.parametrize(("axes", "size"), [((), SHARE), ((1,), SHARE), ((0, 1, 2), 1e-4)])
def test_gyros_that_do_not_all_scatter_or_by_as_much_as_drives_do(axes: tuple[int, ...], size: float) -> None:
    assert not whole(_scattered(4, axes, size)).reference_suspects


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [4, 5])
def test_what_the_spec_lets_scale_factors_wander_by_is_no_table(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Scale factors that wander by 0.1 % were a "table rate, 0.039 %" beside the budget that says so."""
    tree = yaml.safe_load((SHIPPED / "tactical_leg.yaml").read_text(encoding="utf-8"))
    tree["unit"]["gyro"]["scale_factor"]["in_run"] = "0.1 %"
    unit = loaded(tree)
    table, _ = simulate(unit, None, (), seed, settings_of(unit.spec))
    assert not diagnose(table, unit.spec).reference_suspects
    monkeypatch.setattr(unsteady_rate, "_budgeted", lambda spec: 0.0)
    assert {s.hypothesis for s in diagnose(table, unit.spec).reference_suspects} == {"table_rate"}
