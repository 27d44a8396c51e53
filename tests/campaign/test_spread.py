"""Variances where the spreads are the spec's, because the data have too few power-ons to tell them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

from planner.calibrate.dwells_to_fit import fit_sensor
from planner.campaign.design import design
from planner.campaign.model import campaign
from planner.campaign.power_ons import of_table
from planner.nouns.choices import Campaign, TestVisits
from planner.plan.schedule_to_steps import steps
from planner.protocols import SENSORS
from planner.simulate.campaign import Settings, prepared, simulate
from planner.spec.model import Spec
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
