"""What a unit has by its budget and nobody declares: estimates are made as if it were there, and it is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom

from planner.calibrate.dwells_to_fit import fit_sensor
from planner.calibrate.fit_to_calibration import coefficients_of
from planner.campaign.model import campaign
from planner.dwells.table_rows import by_run
from planner.simulate.campaign import prepared, simulate
from tests import oracle
from tests.campaign.campaigns import known, power_ons, spec_with
from tests.simulate.benches import campaign_of

DECLARED = ("bias", "scale_factor", "misalignment")
CAMPAIGNS = 12
BY_CHANCE = 1e-3


def undeclared() -> dict[str, Any]:
    """A g-sensitivity that differs between power-ons, too."""
    return {
        "bias": {"run_to_run": "0.003 deg/s", "systematic": "1 deg/s"},
        "scale_factor": {"run_to_run": "0.02 %"},
        "misalignment": {"run_to_run": "0.003 deg"},
        "g_sensitivity": {"systematic": "0.05 deg/s/g", "run_to_run": "0.0003 deg/s/g"},
    }


@pytest.mark.parametrize("seed", range(3))
def test_it_is_an_unknown_of_the_size_of_its_budget(seed: int) -> None:
    """cov = (Λ + AᵀV⁻¹A)⁻¹ with λ = 3 / size² of its constants, which are columns like the others."""
    spec, runs = spec_with(undeclared(), {}, effects=DECLARED), power_ons(seed, runs=2, records=4)
    budgets = spec.unit.gyro
    sizes = {e: oracle.size_of(b) for e, b in budgets.items()}
    largest = budgets["g_sensitivity"].systematic_size
    sizes["g_sensitivity"] = replace(sizes["g_sensitivity"], constant=largest / np.sqrt(3.0))
    unknowns, A = oracle.columns("gyro", runs.conditions, sizes)
    run = np.repeat(np.arange(len(runs.starts)), runs.sizes)
    V = oracle.covariance(
        "gyro", runs.conditions, run, sizes, spec.unit.white("gyro") / np.sqrt(runs.duration)
    )
    for channel in range(3):
        acts = np.any(A[channel::3] != 0.0, axis=0)
        kept = tuple(u for u, a in zip(unknowns, acts, strict=True) if a)
        wanted = oracle.posterior(A[channel::3, acts], V[channel::3, channel::3], *oracle.prior(kept, sizes))
        found = known(campaign(spec, runs).channels["gyro", channel])
        names = {(u.effect, u.term): i for i, u in enumerate(kept)}
        order = [names[c.effect, c.term] for c in found.columns]
        np.testing.assert_allclose(found.covariance, wanted[np.ix_(order, order)], rtol=1e-6, atol=1e-18)
        without = known(campaign(_only(spec, DECLARED), runs).channels["gyro", channel])
        assert found.sigma[0] > 1.2 * without.sigma[0]  # else the test would say nothing


def _only(spec: Any, effects: tuple[str, ...]) -> Any:
    budgets = {e: b for e, b in spec.unit.gyro.items() if e in effects}
    return spec.model_copy(update={"unit": spec.unit.model_copy(update={"gyro": budgets})})


@pytest.mark.parametrize("name", ["consumer"])
@pytest.mark.further("name", ["industrial", "tactical"])
def test_estimates_hold_the_truth_beside_it(name: str) -> None:
    """A nonlinearity of 3 % and 0.1 deg/s/g beside 0.001 deg/s of noise, which calibrate does not fit.

    Taken as noise it had scale factors off by twice their sigma: a half of them held the truth.
    """
    spec, plan = campaign_of(4, 2, f"from_datasheets/{name}.yaml")
    unit, held, errors = prepared(spec), [], []
    for seed in range(CAMPAIGNS):
        table, truth = simulate(plan, unit, seed)
        ordered, _ = by_run(table)
        for fit in fit_sensor(ordered, "gyro", spec):
            for c in coefficients_of(fit, spec):
                if c.error != "gyro.scale_factor":
                    continue
                true = truth.at(c.error, c.term, 20.0 if c.temperature_degc is None else c.temperature_degc)
                held.append(c.low <= true <= c.high)
                errors.append((c.value - true) / spec.unit.gyro["scale_factor"].run_to_run_largest)
    assert len(held) >= 3 * CAMPAIGNS
    assert sum(held) >= binom.ppf(BY_CHANCE, len(held), 0.93)
    assert np.sqrt(np.mean(np.square(errors))) < 1.0  # of what one power-on draws; four are made
