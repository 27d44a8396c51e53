"""The random parts of a coefficient have the covariances that the spec states, measured over many draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.campaign.design import Design
from planner.simulate.campaign import Settings, prepared, simulate
from planner.simulate.processes import gauss_markov, power_on_draws, walk
from planner.spec.budget import ErrorBudget
from tests.simulate.benches import campaign_of


def one_run(minutes: list[float], repeats: int) -> Design:
    """`repeats` power-ons with records at these minutes; nothing else of them is asked."""
    _, plan = campaign_of(temperatures=1, repeats=1)
    n = len(minutes)
    rows = np.arange(n) % len(plan)
    c = plan.conditions
    conditions = replace(
        c,
        rate=np.tile(c.rate[rows], (repeats, 1)),
        specific_force=np.tile(c.specific_force[rows], (repeats, 1)),
        temperature_degc=np.zeros(n * repeats),
        temperature_rate=np.zeros(n * repeats),
        time_on=np.tile(60.0 * np.array(minutes), repeats),
        day=np.repeat(np.arange(repeats) * 1.0, n),
    )
    return replace(
        plan,
        conditions=conditions,
        run=np.repeat(np.arange(1, repeats + 1), n),
        duration=np.full(n * repeats, 10.0),
        step=np.repeat("s", n * repeats),
        bench=np.repeat("b", n * repeats),
        installation=np.ones(n * repeats, dtype=np.int64),
        asked=tuple(plan.asked[i] for i in np.tile(rows, repeats)),
    )


@pytest.mark.parametrize("tau", [60.0, 600.0, 7200.0])
def test_gauss_markov_has_its_correlation_within_a_run_and_none_between(tau: float) -> None:
    minutes = [1.0, 2.0, 7.0, 30.0]
    runs = 20_000
    drawn = gauss_markov(one_run(minutes, runs), tau, np.random.default_rng(3)).reshape(runs, -1)
    t = 60.0 * np.array(minutes)
    wanted = np.exp(-np.abs(t[:, None] - t[None, :]) / tau)
    # a covariance of 20 000 unit draws has a standard error of at most sqrt(2 / 20 000) = 0.01; 4.5 of them
    np.testing.assert_allclose(drawn.T @ drawn / runs, wanted, atol=0.045)
    np.testing.assert_allclose(drawn[1:, 0] @ drawn[:-1, -1] / runs, 0.0, atol=0.045)


def test_one_draw_of_a_power_on_over_temperature_has_the_stated_covariance() -> None:
    runs, length = 20_000, 40.0
    degc = np.array([-40.0, -40.0, 0.0, 60.0])
    drawn = power_on_draws(
        one_run([1.0, 2.0, 3.0, 4.0], runs), np.tile(degc, runs), length, np.random.default_rng(5)
    ).reshape(runs, -1)
    wanted = np.exp(-((degc[:, None] - degc[None, :]) ** 2) / (2.0 * length**2))
    np.testing.assert_allclose(drawn.T @ drawn / runs, wanted, atol=0.045)  # as above
    np.testing.assert_allclose(drawn[:, 0], drawn[:, 1], atol=1e-7)  # the same temperature, the same draw


@given(
    degc=st.lists(st.floats(-60.0, 80.0), min_size=2, max_size=6),
    length=st.floats(1.0, 500.0),
    seed=st.integers(0, 99),
)
@settings(deadline=None, max_examples=40)
def test_where_the_temperature_is_the_same_so_is_the_draw(
    degc: list[float], length: float, seed: int
) -> None:
    plan = one_run([float(i) for i in range(2 * len(degc))], 2)
    drawn = power_on_draws(plan, np.array([*degc, *degc] * 2), length, np.random.default_rng(seed))
    for run in drawn.reshape(2, -1):
        # the root of a matrix known to 1e-16 is known to 1e-8
        np.testing.assert_allclose(run[: len(degc)], run[len(degc) :], atol=1e-6)


def test_without_a_correlation_over_temperature_a_power_on_draws_once() -> None:
    plan = one_run([1.0, 2.0, 3.0], 4)
    degc = np.linspace(-60.0, 60.0, 12)
    drawn = power_on_draws(plan, degc, None, np.random.default_rng(1)).reshape(4, 3)
    assert (drawn == drawn[:, :1]).all()
    assert len(set(drawn[:, 0])) == 4


def test_storage_walks_from_zero_to_its_spread_in_sixty_days() -> None:
    end = [walk(np.array([0.0, 15.0, 60.0]), np.random.default_rng(seed)) for seed in range(4000)]
    spread = np.std(end, axis=0)
    np.testing.assert_allclose(spread, [0.0, 0.5, 1.0], rtol=0.05)  # 4.5 standard errors of 1.1 %


# ---------------------------------------------------------------- in a campaign


def drift_only(**changes: object) -> Settings:
    return Settings(
        white={"gyro": 0.0, "accelerometer": 0.0},
        temperature_jitter=0.0,
        run_to_run=False,
        storage=False,
        temperature_residual=False,
        **changes,
    )


def budget_of(**parts: object) -> ErrorBudget:
    return ErrorBudget.model_validate({"systematic": "0 deg/s", **parts})


def test_every_error_drifts_with_its_own_correlation_time_and_a_setting_takes_all() -> None:
    """A drift of a year stands still within a power-on; one of a millisecond forgets itself."""
    spec, plan = campaign_of(temperatures=1, repeats=40)
    unit = prepared(spec)

    def bias(time: str, **changes: object) -> np.ndarray:
        slow = budget_of(in_run={"value": "0.01 deg/s", "correlation_time": time})
        only = replace(unit, budgets={("gyro", "bias"): slow}, families={})
        table, _ = simulate(plan, only, 1, settings=drift_only(**changes))
        found = table.gyro[:, 0] - table.ref_rate[:, 0]
        return np.concatenate([np.diff(found[rows]) for rows in plan.runs if len(rows) > 1])

    sigma = np.radians(0.01)
    assert np.abs(bias("365 d")).max() < 0.03 * sigma  # sqrt(2 · 60 s / 1 a) = 0.002 a step
    quick = bias("0.001 s")
    np.testing.assert_allclose(np.std(quick), np.sqrt(2.0) * sigma, rtol=0.1)
    np.testing.assert_array_equal(bias("365 d", in_run_time=0.001), quick)


def test_a_run_to_run_draw_over_temperature_takes_the_spread_of_its_temperature() -> None:
    spec, plan = campaign_of(temperatures=3, repeats=30)
    table = {"-60 degC": "0.001 deg/s", "60 degC": "0.003 deg/s"}
    quiet = replace(drift_only(), run_to_run=True, in_run=False)
    found = {}
    for name, run_to_run in {
        "same": table,
        "changing": {"value": table, "temperature_correlation": "40 K"},
    }.items():
        unit = replace(
            prepared(spec), budgets={("gyro", "bias"): budget_of(run_to_run=run_to_run)}, families={}
        )
        drawn = [simulate(plan, unit, seed, settings=quiet)[0] for seed in range(4)]
        first = plan.starts
        change = np.array([(d.gyro - d.ref_rate)[first] for d in drawn])
        degc = plan.conditions.temperature_degc[first]
        found[name] = [np.degrees(np.std(change[:, degc == t])) for t in (-60.0, 0.0, 60.0)]
    # 4 units x 3 axes x 30 power-ons x 3 tests: each spread is known to 2.2 %
    np.testing.assert_allclose(found["same"], [0.001, 0.002, 0.003], rtol=0.1)
    np.testing.assert_allclose(found["changing"], [0.001, 0.002, 0.003], rtol=0.1)
