"""Campaigns, calibrations and flights: the batched ones are simulate's, calibrate's and the strapdown's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.campaign.channel_model import evaluate, jacobian
from planner.campaign.noise import noise_model, spec_variances
from planner.learn.dwells_to_fit import calibrate
from planner.measured import DwellTable
from planner.physics.strapdown import NavigationState, integrate
from planner.protocols import SENSORS
from planner.simulate.campaign import Settings, prepared, simulate
from planner.simulate.temperature_curves import POINTS, curve_family
from planner.solvers.mixed_model import mixed_fit
from planner.verify.calibrations import calibrated, conditions_of_units, readings, white_noise
from planner.verify.draws import curves_of, drawn_errors, generator
from planner.verify.experiment import _exposed, experiment, run_chunk, units_left
from planner.verify.flights import exact_coefficients, lengths_of, vectors_of
from planner.verify.outcome import share_interval
from tests.verify.plans import plan_of

PLANS = ["flown", "several"]


def prepared_experiment(name, **options):
    plan = plan_of(name)
    return experiment(plan.document, plan.loaded.spec, plan.trajectory, **({"seed": 3} | options))


def measured(e, units, number=0):
    """Conditions, drawn errors and readings of one chunk."""
    key = (e.seed, number)
    conditions = conditions_of_units(e.design, units, e.settings, key)
    temperature = conditions.temperature_degc.reshape(units, -1)
    errors = drawn_errors(e.unit, e.design, temperature, _exposed(e, units, key), e.settings, key)
    y = {
        s: readings(s, conditions, errors, white_noise(s, e.design, units, e.settings, key)) for s in SENSORS
    }
    return conditions, errors, y


def part(values, units, i):
    return values.reshape(units, -1, *values.shape[1:])[i]


@pytest.mark.parametrize("name", PLANS)
def test_the_batched_estimator_is_gauss_newton_on_the_mixed_model(name):
    """Unit by unit with the library's own stages, its noise that of the spec, at the nominal temperatures.

    With the chamber straying the stages would need the variance of that stray, which they take from the data.
    """
    spec, units = plan_of(name).loaded.spec, 3
    e = prepared_experiment(name, settings=Settings(temperature_jitter=0.0))
    conditions, _, y = measured(e, units)
    for sensor in SENSORS:
        for channel, estimator in enumerate(e.estimators[sensor]):
            theta = calibrated(estimator, conditions, y[sensor][:, channel], units)
            for i in range(units):
                own = replace(conditions, **{k: part(v, units, i) for k, v in vars(conditions).items()})
                model = replace(estimator.model, conditions=own)
                beta = model.start()
                for _ in range(4):
                    parts = evaluate(model, beta)
                    J = jacobian(model, beta, parts)
                    noise = noise_model(
                        model, parts, e.design.starts, e.design.duration, spec, np.ones(len(J))
                    )
                    variances = spec_variances(noise, spec, e.settings.white[sensor] ** 2 / noise.duration)
                    left = part(y[sensor], units, i)[:, channel] - parts.predicted
                    beta = beta + mixed_fit(left, J, noise.effects, variances).coefficients
                # five rounds of 0.5 % each leave 1e-11 of a scale factor of half a per cent
                assert np.all(np.abs(theta[i] - beta) <= 1e-8 * estimator.error)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_batched_estimator_agrees_with_planner_calibrate(seed):
    """Whose variances come from each unit's own data: they differ by a fraction of a standard error."""
    plan, units = plan_of("flown"), 3
    e = prepared_experiment("flown", seed=seed)
    conditions, _, y = measured(e, units)
    for i in range(units):
        own = {k: part(v, units, i) for k, v in vars(conditions).items()}
        table = DwellTable(
            unit=np.full(len(e.design), "u"),
            run=e.design.run,
            day=own["day"],
            time_on=own["time_on"],
            duration=e.design.duration,
            temperature_degc=own["temperature_degc"],
            temperature_rate=own["temperature_rate"],
            ref_rate=own["rate"],
            ref_acc=own["specific_force"],
            gyro=part(y["gyro"], units, i),
            acc=part(y["accelerometer"], units, i),
            step=e.design.step,
            bench=e.design.bench,
            source="",
        )
        (found,) = calibrate(table, plan.loaded.spec)
        for sensor in found.sensors:
            for channel, estimator in enumerate(e.estimators[sensor.sensor]):
                theta = calibrated(estimator, conditions, y[sensor.sensor][:, channel], units)[i]
                value = np.array([c.value for c in sensor.coefficients if c.channel == "xyz"[channel]])
                error = np.array(
                    [c.standard_error for c in sensor.coefficients if c.channel == "xyz"[channel]]
                )
                assert np.all(np.abs(theta - value) <= 0.5 * error)


def test_a_unit_without_chance_reads_what_simulate_reads():
    """The same regressors in the same order: without random parts the two simulators are one."""
    e = prepared_experiment("flown")
    quiet = Settings(
        white=dict.fromkeys(SENSORS, 0.0),
        temperature_jitter=0.0,
        case="worst",
        signs="plus",
        run_to_run=False,
        in_run=False,
        storage=False,
    )
    unit = prepared(plan_of("flown").loaded.spec)
    still = replace(unit, families={}, budgets={k: _only_systematic(b) for k, b in unit.budgets.items()})
    table, _ = simulate(e.design, still, 7, settings=quiet)
    quiet_e = replace(e, unit=still, settings=quiet)
    _, _, y = measured(quiet_e, 2)
    for sensor, wanted in zip(SENSORS, (table.gyro, table.acc), strict=True):
        found = part(y[sensor], 2, 1)
        assert np.abs(found - wanted).max() <= 1e-12 * np.abs(wanted).max()


def _only_systematic(budget):
    return budget.model_copy(
        update={"run_to_run": None, "in_run": None, "storage": None, "temperature_residual": None}
    )


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_curves_are_those_of_the_family(seed):
    family = curve_family({1: 0.03, 3: 0.0085, 5: 0.0035}, -40.0, 60.0)
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(family.amplitude))
    (found,) = curves_of(family, phase[None, :])
    assert found.shape == (POINTS,)
    np.testing.assert_allclose(found, family.draw(np.random.default_rng(seed)), atol=1e-12 * 0.03)


def test_the_random_parts_have_the_spreads_of_the_budget():
    """400 units; a standard deviation of 1200 draws is within 7 % (three sigma of 1/√2400)."""
    e = prepared_experiment("flown")
    left = {x.name: x for x in units_left(e, 0, 400)}
    for name, budget in (
        ("gyro.bias", e.unit.budgets["gyro", "bias"]),
        ("accelerometer.bias", e.unit.budgets["accelerometer", "bias"]),
    ):
        sizes = np.sqrt(np.mean(left[name].parts[:, :, 0] ** 2, axis=(1, 2)))
        for i, wanted in enumerate((budget.run_to_run, budget.in_run, budget.storage)):
            assert sizes[i] == pytest.approx(wanted.si, rel=0.07)


@pytest.mark.parametrize("seed", [1, 2])
def test_parts_add_up_to_what_is_left(seed):
    for x in units_left(prepared_experiment("flown", seed=seed, where="range"), 0, 20):
        np.testing.assert_allclose(x.parts.sum(axis=0), x.true - x.estimated, atol=1e-15)


@pytest.mark.parametrize("name", PLANS)
def test_the_flights_are_those_of_the_strapdown(name):
    """Readings corrected sample by sample, û = A u + c, and integrated sample by sample."""
    e = prepared_experiment(name)
    units, t = 3, plan_of(name).trajectory
    coefficients = 10.0 * exact_coefficients(e.flight, units_left(e, 0, units))
    flown = e.flight.navigate(coefficients)
    gyro, accelerometer = e.flight.forcing(0, len(t.angle_increment))
    step = t.time_s[1] - t.time_s[0]
    split = sum(x.shape[2] for x in gyro)
    start = NavigationState(t.latitude[0], t.longitude[0], t.altitude[0], t.velocity[0], t.attitude[0])
    for i in range(units):
        c = coefficients[i]
        dw = np.concatenate(gyro, axis=2) @ c[:split]
        df = np.concatenate(accelerometer, axis=2) @ c[split:]
        end = integrate(start, t.angle_increment + dw * step, t.velocity_increment + df * step, step)
        clean = integrate(start, t.angle_increment, t.velocity_increment, step)
        up = float(end.altitude - clean.altitude)
        size = float(np.linalg.norm(flown.position[-1, :, i]))
        # blocks of a quarter of a second take errors and force as even inside them: 1e-4 of the error
        assert flown.position[-1, 2, i] == pytest.approx(up, abs=3e-4 * size)


def test_lengths_beyond_all_numbers_count_as_outside():
    vectors = np.array([[[1.0, np.nan, np.inf]], [[2.0, 0.0, 0.0]]])
    np.testing.assert_array_equal(lengths_of(vectors), [2.0, np.inf, np.inf])


@pytest.mark.parametrize(
    ("hits", "of", "interval"), [(0, 10, (0.0, 0.3085)), (10, 10, (0.6915, 1.0)), (8, 10, (0.4439, 0.9748))]
)
def test_the_interval_of_a_share_is_clopper_and_pearson_s(hits, of, interval):
    """Tabulated to four digits in any statistics text (95 %)."""
    assert share_interval(hits, of) == pytest.approx(interval, abs=6e-5)


@pytest.mark.parametrize("confidence", [0.9, 0.95])
@pytest.mark.parametrize("p", [0.05, 0.5, 0.97])
def test_the_interval_covers_at_least_what_it_says(confidence, p):
    """Exactly, by summing the binomial distribution."""
    from scipy.stats import binom

    n = 60
    inside = [k for k in range(n + 1) if (i := share_interval(k, n, confidence))[0] <= p <= i[1]]
    assert binom.pmf(inside, n, p).sum() >= confidence


def test_chunks_do_not_depend_on_each_other_or_on_their_order():
    e = prepared_experiment("flown")
    first = run_chunk(e, 0, 10)
    later = run_chunk(e, 5, 10)
    np.testing.assert_array_equal(run_chunk(e, 0, 10).lengths, first.lengths)
    assert not np.array_equal(first.lengths, later.lengths)
    assert generator(1, 0, "a").normal() != generator(1, 1, "a").normal()


@pytest.mark.parametrize("name", PLANS)
def test_small_errors_are_linear(name):
    """The published claim: cross terms are about 1 % of the sum, for errors that a calibration leaves."""
    e = prepared_experiment(name)
    coefficients = exact_coefficients(e.flight, units_left(e, 0, 50))
    flown = e.flight.navigate(coefficients)
    for r in e.requirements:
        exact = vectors_of(flown, e.flight.instants, r)[-1]
        linear = vectors_of(e.flight.linear, e.flight.instants, r)[-1] @ coefficients.T
        assert np.sqrt(np.sum((exact - linear) ** 2) / np.sum(exact**2)) < 0.01
