"""The campaign's covariance and information against dense algebra, and their laws."""

from __future__ import annotations

import numpy as np
import pytest

from planner.campaign.model import ChannelCampaign, campaign
from planner.campaign.power_ons import PowerOns
from planner.campaign.triad import fit_triad
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import SENSORS, Sensor
from planner.spec.model import Spec
from planner.spec.references import BenchAccuracy
from tests import oracle
from tests.campaign.campaigns import EFFECTS, counted, drifting, known, power_ons


def dense(
    spec: Spec, runs: PowerOns, sensor: Sensor, channel: int
) -> tuple[tuple[oracle.Unknown, ...], Array, Array, Array, Array]:
    """Unknowns that act on the channel, A, V, T, precision."""
    budgets = getattr(spec.unit, sensor)
    names = [e for e in EFFECTS if sensor == "gyro" or e != "g_sensitivity"]
    sizes = {e: oracle.size_of(budgets[e]) if e in budgets else oracle.Size() for e in names}
    unknowns, A = oracle.columns(sensor, runs.conditions, sizes)
    run = np.repeat(np.arange(len(runs.starts)), runs.sizes)
    V = oracle.covariance(
        sensor, runs.conditions, run, sizes, spec.unit.white(sensor) / np.sqrt(runs.duration)
    )
    A, V = A[channel::3], V[channel::3, channel::3]
    acts = np.any(A != 0.0, axis=0)
    kept = tuple(u for u, a in zip(unknowns, acts, strict=True) if a)
    T, precision = oracle.prior(kept, sizes)
    return kept, A[:, acts], V, T, precision


def of(spec: Spec, runs: PowerOns, sensor: Sensor, channel: int) -> ChannelCampaign:
    return campaign(spec, runs).channels[sensor, channel]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("sensor", SENSORS)
def test_what_a_campaign_tells_is_what_dense_algebra_tells(seed: int, sensor: Sensor) -> None:
    spec, runs = drifting(), power_ons(seed)
    for channel in range(3):
        unknowns, A, V, T, precision = dense(spec, runs, sensor, channel)
        wanted = oracle.posterior(A, V, T, precision)
        found = known(of(spec, runs, sensor, channel))
        names = {(u.effect, u.term): i for i, u in enumerate(unknowns)}
        order = [names[c.effect, c.term] for c in found.columns]
        np.testing.assert_allclose(found.covariance, wanted[np.ix_(order, order)], rtol=1e-6, atol=1e-18)
        np.testing.assert_allclose(found.sigma**2, np.diag(found.covariance), rtol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_coefficients_are_those_of_the_last_day_within_two_per_cent(seed: int) -> None:
    """Sixty days of storage as large as the run-to-run, over a campaign of eight days; c + w(D_end) of x."""
    spec, runs = drifting("0.003 deg/s"), power_ons(seed, runs=14, days=8.0)
    unknowns, A, V, T, precision = dense(spec, runs, "gyro", 0)
    wanted = oracle.posterior(A, V, T, precision)
    still = known(of(drifting(), runs, "gyro", 0))
    found = known(of(spec, runs, "gyro", 0))
    for i, c in enumerate(found.columns):
        own = [(u.part, u.at, k) for k, u in enumerate(unknowns) if (u.effect, u.term) == (c.effect, c.term)]
        constant = [k for part, _, k in own if part == "constant"]
        at_the_end = [k for _, _, k in sorted(x for x in own if x[0] == "walk")[-1:]]
        flown = np.isin(np.arange(len(unknowns)), [*constant, *at_the_end]).astype(float)
        assert len(constant) == 1
        assert found.sigma[i] == pytest.approx(np.sqrt(flown @ wanted @ flown), rel=0.02)
    assert found.sigma[0] > 1.1 * still.sigma[0]  # else the test would say nothing


def test_information_adds_and_counts_are_copies() -> None:
    spec, runs = drifting(), power_ons(5)
    rng = np.random.default_rng(0)
    n, m = rng.integers(0, 4, (2, len(runs.starts))).astype(float)
    both, first, second = (of(spec, counted(runs, x), "gyro", 1).rows() for x in (n + m, n, m))
    told = first.T @ first + second.T @ second
    np.testing.assert_allclose(both.T @ both, told, rtol=1e-12, atol=1e-12 * np.abs(told).max())
    twice = PowerOns(
        Conditions(*(np.concatenate([v, v]) for v in vars(runs.conditions).values())),
        np.concatenate([runs.duration] * 2),
        np.concatenate([runs.starts, runs.starts + len(runs)]),
        np.ones(2 * len(runs.starts)),
        np.full(2 * len(runs), "rate_table"),
    )
    copied = of(spec, twice, "gyro", 1)
    counts = of(spec, counted(runs, 2.0 * runs.counts), "gyro", 1)
    np.testing.assert_allclose(known(counts).sigma, known(copied).sigma, rtol=1e-9)


def test_more_power_ons_never_tell_less() -> None:
    spec, runs = drifting(), power_ons(6)
    counts = runs.counts.copy()
    before = known(of(spec, counted(runs, counts), "gyro", 2)).sigma
    for k in range(len(counts)):
        counts[k] += 1.0
        after = known(of(spec, counted(runs, counts), "gyro", 2)).sigma
        assert np.all(after <= before * (1 + 1e-12))
        before = after


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_thousand_repeats_do_not_learn_more_than_the_bench_knows(sensor: Sensor) -> None:
    accuracy = BenchAccuracy.model_validate({"rate": "50 ppm", "mounting": "0.02 deg", "level": "0.01 deg"})
    spec, runs = drifting(), power_ons(8)
    bench = spec.benches["rate_table"].model_copy(update={"accuracy": accuracy})
    stated = spec.model_copy(update={"benches": {**spec.benches, "rate_table": bench}})
    many = counted(runs, 1e6 * runs.counts)
    perfect, real = (known(of(s, many, sensor, 0)) for s in (spec, stated))
    sigma = {(c.effect, c.term): s for c, s in zip(real.columns, real.sigma, strict=True)}
    assert perfect.sigma.max() < 1e-5
    floor = accuracy.mounting
    assert sigma["misalignment", "xy"] == pytest.approx(floor, rel=0.1)
    if sensor == "gyro":
        assert sigma["scale_factor", "x"] == pytest.approx(accuracy.rate, rel=0.1)


def test_the_estimator_with_given_variances_is_dense_least_squares() -> None:
    """θ̂ = (AᵀV⁻¹A)⁻¹AᵀV⁻¹(y − u) to first order: errors of 1e-7 have no products."""
    from planner.campaign.estimate import estimate

    spec, runs = drifting(), power_ons(9)
    c = of(spec, runs, "gyro", 0)
    unknowns, A, V, _, _ = dense(spec, runs, "gyro", 0)
    rng = np.random.default_rng(3)
    y = c.model.u + 1e-7 * rng.normal(size=len(runs))
    found = estimate(c.model, y, runs, spec, given=(c.noise, c.variances))
    solved = np.linalg.solve(V, np.column_stack([A, y - c.model.u]))
    wanted = np.linalg.solve(A.T @ solved[:, :-1], A.T @ solved[:, -1])
    names = {(u.effect, u.term): i for i, u in enumerate(unknowns)}
    order = [names[x.effect, x.term] for x in c.model.columns()]
    np.testing.assert_allclose(found.theta, wanted[order], rtol=1e-4, atol=1e-12)


def test_channels_that_share_a_coefficient_are_fitted_together() -> None:
    """The Earth's rate left out of the reference: one estimate from the three gyros."""
    spec, runs = drifting(), power_ons(10, runs=20)
    names = ("bias", "scale_factor", "earth_rate")
    rng = np.random.default_rng(4)
    effect = oracle.catalog.effects()["earth_rate"]
    up = effect.regressors("gyro", runs.conditions)[:, :, 0]
    y = runs.conditions.rate + 5e-5 * up + 1e-5 * rng.normal(size=(len(runs), 3))
    found = fit_triad("gyro", y, runs, spec, names)
    places = [next(i for i, c in enumerate(e.model.columns()) if c.term == "up") for e in found]
    values = [e.theta[i] for e, i in zip(found, places, strict=True)]
    errors = [np.sqrt(e.fit.covariance[i, i]) for e, i in zip(found, places, strict=True)]
    assert np.ptp(values) == 0.0
    assert np.ptp(errors) == 0.0
    assert abs(values[0] - 5e-5) < 4.0 * errors[0]
    alone = [e.theta for e in fit_triad("gyro", y, runs, spec, ("bias", "scale_factor"))]
    assert len(alone[0]) == 2
