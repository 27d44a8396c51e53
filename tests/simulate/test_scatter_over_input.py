"""A unit whose scale factor scatters by its rate: its readings scatter as the spec's table says."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
import yaml

import planner
from planner.campaign.design import design
from planner.nouns.choices import Campaign, TestVisits
from planner.plan.schedule_to_steps import steps
from planner.simulate.campaign import prepared, simulate
from tests.simulate.benches import noiseless
from tests.specs import SHIPPED

TABLE = {"10 deg/s": "0.4 %", "100 deg/s": "0.2 %", "500 deg/s": "0.1 %"}
POWER_ONS = 400


def spec_with(run_to_run: object) -> planner.Spec:
    tree = copy.deepcopy(yaml.safe_load((SHIPPED / "helicopter.yaml").read_text(encoding="utf-8")))
    tree["unit"]["gyro"] = {"scale_factor": {"systematic": "0.5 %", "run_to_run": run_to_run}}
    tree["tests"] = {"rates": tree["tests"]["rates"] | {"calibrates": ["gyro.scale_factor"]}}
    del tree["unit"]["accelerometer"]
    tree["tests"]["rates"]["motions"] = [{"rate_1": f"{rate} deg/s"} for rate in (10, 100, -100, 500, 800)]
    tree["benches"]["rate_table"]["limits"]["rate"] = "900 deg/s"
    return planner.load(tree)


def test_power_ons_scatter_at_every_rate_as_the_table_says() -> None:
    spec = spec_with(TABLE).spec
    visits = (TestVisits("rates", (20.0,), (POWER_ONS,)),)
    made = design(steps(spec, Campaign(visits, (), 0.0, 0.0, False)), spec)
    table, _ = simulate(made, prepared(spec), 5, settings=replace(noiseless(), run_to_run=True))
    rate = table.ref_rate[:, 2].reshape(POWER_ONS, 5)
    kappa = table.gyro[:, 2].reshape(POWER_ONS, 5) / rate - 1.0
    said = 0.01 * np.array([0.4, 0.2, 0.2, 0.1, 0.1])
    np.testing.assert_allclose(kappa.std(axis=0), said, rtol=3.0 / np.sqrt(2 * POWER_ONS))
    np.testing.assert_allclose(kappa[:, 1], kappa[:, 2], atol=1e-6)  # one draw for both directions
    # what is common to all rates is what the fastest have: slow ones draw beside it, not instead of it
    common = np.corrcoef(kappa[:, 0], kappa[:, 3])[0, 1]
    assert common == pytest.approx(0.1 / 0.4, abs=3.0 / np.sqrt(POWER_ONS))


def test_where_all_rates_scatter_alike_nothing_stands_beside() -> None:
    unit = spec_with(dict.fromkeys(TABLE, "0.2 %")).spec.unit
    assert [*unit.gyro] == ["scale_factor"]
    assert unit.gyro["scale_factor"].run_to_run_largest == pytest.approx(0.002)


def test_where_one_figure_stands_for_all_inputs_it_is_of_those_that_can_be_told() -> None:
    slow = {"0.005 deg/s": "13.2 %", "10 deg/s": "0.107 %", "500 deg/s": "0.122 %"}
    spec = spec_with(slow).spec
    estimated = spec_with({"value": slow, "power_ons": 20}).spec.unit.gyro
    assert [budget.power_ons for budget in estimated.values()] == [20, 20]
    tree = yaml.safe_load((SHIPPED / "helicopter.yaml").read_text(encoding="utf-8"))
    tree["unit"]["gyro"]["scale_factor"]["run_to_run"] = slow
    tree["plan"]["method"] = "published"
    budget = planner.load(tree).spec.unit.gyro["scale_factor"]
    assert budget.run_to_run_largest == pytest.approx(0.00122)
    assert len(spec.unit.gyro) == 2
