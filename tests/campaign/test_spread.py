"""Variances where the spreads are the spec's, because the data have too few power-ons to tell them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import yaml

from planner.calibrate.dwells_to_fit import fit_sensor
from planner.campaign.design import design
from planner.campaign.model import campaign
from planner.campaign.noise import Component
from planner.campaign.power_ons import of_table
from planner.dwells.table_rows import by_run
from planner.nouns.choices import Campaign, TestVisits
from planner.nouns.sensor import ErrorName
from planner.plan.schedule_to_steps import steps
from planner.protocols import SENSORS
from planner.simulate.campaign import Settings, prepared, simulate
from planner.spec.model import Spec
from tests.simulate.benches import campaign_of
from tests.specs import SHIPPED, loaded

DEGC = (-30.0, 0.0, 30.0)


def spec() -> Spec:
    """Accelerometers that do not drift within a power-on, but scale differently in each."""
    tree: dict[str, Any] = yaml.safe_load((SHIPPED / "helicopter.yaml").read_text())
    for budget in tree["unit"]["accelerometer"].values():
        budget.pop("in_run", None)
    tree["unit"]["accelerometer"]["scale_factor"]["run_to_run"] = "1 %"
    tree["unit"]["noise"] = {"gyro": "0.15 deg/sqrt(h)", "accelerometer": "500 ug/sqrt(Hz)"}
    return loaded(tree).spec


@pytest.mark.parametrize("seed", range(3))
def test_what_power_ons_draw_of_a_scale_factor_is_no_noise_of_the_records(seed: int) -> None:
    """Some ten differences tell it to 25 %; with what differs between power-ons it was ten times that."""
    one = spec()
    visits = tuple(TestVisits(test, DEGC, (1,) * 3) for test in ("static", "rates"))
    made = design(steps(one, Campaign(visits, (), 0.0, 0.0, False)), one)
    noisy = Settings(white={s: one.unit.white(s) for s in SENSORS})
    table, _ = simulate(made, prepared(one), seed, settings=noisy)
    runs = of_table(table)
    for found in fit_sensor(table, "accelerometer", one):
        assert found.noise.known
        wanted = one.unit.white("accelerometer") ** 2 / found.noise.duration
        assert np.sqrt(found.variances.theta[0] / wanted) == pytest.approx(1.0, abs=0.45)
        mine = campaign(one, runs).channels["accelerometer", found.model.channel]
        said = np.sqrt(np.diag(found.fit.covariance))[: found.model.linear]
        np.testing.assert_allclose(said, mine.sigma(), rtol=0.45)


def test_a_spread_that_few_power_ons_show_as_nothing_is_the_specs() -> None:
    """How a scale factor drifts under load only the arm shows, in two power-ons, and often as nothing.

    With nothing in its place 90 to 94 % of scale factors and 85 to 89 % of nonlinearities were within their
    intervals; now 93 to 96 and 90 to 96 (24 and 40 units).
    """
    one, made = campaign_of(4, 2, "high_g.yaml")
    drifts = Component("in_run", ErrorName.of("accelerometer", "scale_factor"))
    held = 0
    for seed in range(16, 20):
        table, _ = by_run(simulate(made, prepared(one), seed)[0])
        for found in fit_sensor(table, "accelerometer", one):
            each = [replace(c, term="") for c in found.noise.components]
            assert drifts in each
            k = each.index(drifts)
            if not found.variances.error[k].any():  # it was not told
                assert np.sqrt(found.variances.theta[k]) == pytest.approx(5e-5)
                held += 1
    assert 4 <= held < 12


def test_a_spread_that_many_power_ons_show_as_nothing_is_nothing() -> None:
    """Units that draw no bias anew, though their spec says so."""
    one, made = campaign_of(4, 6)
    table, _ = by_run(simulate(made, prepared(one), 1, settings=Settings(run_to_run=False, in_run=False))[0])
    drawn = Component("run_to_run", ErrorName.of("gyro", "bias"))
    for found in fit_sensor(table, "gyro", one):
        each = {replace(c, term=""): k for k, c in enumerate(found.noise.components)}
        spread = np.sqrt(found.variances.theta[each[drawn]]) if drawn in each else 0.0
        assert spread < 0.3 * one.unit.gyro["bias"].run_to_run_largest
