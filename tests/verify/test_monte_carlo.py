"""Campaigns, calibrations and flights: the batched ones are what dense algebra, calibrate, strapdown say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import catalog
from planner.calibrate.dwells_to_fit import calibrate
from planner.campaign.design import design
from planner.nouns.dwell_table import DwellTable
from planner.nouns.plan_file import steps_of
from planner.physics.strapdown import NavigationState, integrate
from planner.protocols import SENSORS
from planner.simulate.campaign import Settings, prepared, simulate
from planner.verify import calibrations, shared_unknowns
from planner.verify.calibrations import calibrated
from planner.verify.chance import Chance
from planner.verify.draws import generator
from planner.verify.experiment import experiment, run_chunk, units_left, units_measured
from planner.verify.flights import exact_coefficients, lengths_of, vectors_of
from planner.verify.outcome import share_interval
from planner.verify.smooth import prior_of
from planner.verify.starts import anywhere
from planner.verify.strays import strays_of
from planner.verify.through_files import SIGMAS, WORSE
from tests import oracle
from tests.verify.plans import plan_of

PLANS = ["flown", "several"]


def prepared_experiment(name, **options):
    plan = plan_of(name)
    return experiment(plan.document, plan.loaded.spec, plan.trajectory, **({"seed": 3} | options))


def part(values, units, i):
    return values.reshape(units, -1, *values.shape[1:])[i]


@pytest.mark.parametrize("name", PLANS)
def test_the_estimator_is_generalised_least_squares_of_the_dense_covariance(name, monkeypatch):
    """P = (XᵀV⁻¹X)⁻¹XᵀV⁻¹ with the oracle's V, which knows neither runs nor kinds of power-ons.

    V has the walk back from the last day, too: what is estimated is the value that flies. With a step of the
    walk for every day of a power-on; the few that are taken of many change a standard error by 1e-4.
    """
    e = prepared_experiment(name)
    monkeypatch.setattr(shared_unknowns, "_STEPS", 1000)
    strays = strays_of(e.records, e.chance, prior_of(e.spec))
    exact = calibrations.estimators(e.records, e.unit, e.spec.effects, e.chance, strays=strays)
    for sensor in SENSORS:
        sizes = {
            effect: oracle.size_of(budget) for (s, effect), budget in e.unit.budgets.items() if s == sensor
        }
        slopes = {effect: sigma / 0.05 for (s, effect), sigma in strays.items() if s == sensor}
        strayed = oracle.strayed(sensor, e.records.conditions, slopes)
        white = np.hypot(e.chance.white[sensor] / np.sqrt(e.records.duration)[:, None], strayed)
        V = oracle.covariance(sensor, e.records.conditions, e.records.run, sizes, white)
        ago = np.repeat(e.records.on_day.max() - e.records.on_day, 3)
        for (_, effect), b in ((k, b) for k, b in e.unit.budgets.items() if k[0] == sensor):
            z = catalog.effects()[effect].regressors(sensor, e.records.conditions).reshape(len(ago), -1)
            V = V + b.storage_sigma**2 / 60.0 * (z @ z.T) * np.minimum.outer(ago, ago)
        for estimator, used in zip(exact[sensor], e.estimators[sensor], strict=True):
            np.testing.assert_allclose(used.error, estimator.error, rtol=1e-4)
            (channel,) = estimator.model.channels
            model, c = estimator.model, e.records.conditions
            u = getattr(c, "rate" if sensor == "gyro" else "specific_force")[:, [channel]]
            parts = model.matrix(model.bias, c), model.scaled(c, u), model.matrix(model.misalignment, c)
            X = np.concatenate(parts, axis=2)[:, 0]
            weighed = np.linalg.solve(V[channel::3, channel::3], X)
            information = X.T @ weighed
            error = np.sqrt(np.diag(np.linalg.inv(information)))
            # rounding: the condition of the information, 1e8 here, times 1e-16, in standard errors
            np.testing.assert_allclose(estimator.error, error, rtol=1e-6)
            assert np.all(
                np.abs(estimator.inverse @ X - np.eye(len(error))) <= 1e-6 * np.outer(error, 1 / error)
            )
            wanted = np.linalg.solve(information, weighed.T)
            assert np.abs((estimator.inverse - wanted) / error[:, None]).max() < 1e-6 / white.min()


@pytest.mark.parametrize("name", PLANS)
def test_what_the_estimator_leaves_is_seen_by_no_weight(name):
    """At its fixed point P (y − ŷ(θ)) = 0, ŷ the product model; five rounds leave 1e-8 of an error."""
    units = 3
    e = prepared_experiment(name)
    made = units_measured(e, 0, units)
    for sensor in SENSORS:
        for estimator in e.estimators[sensor]:
            (channel,) = estimator.model.channels
            theta = calibrated(estimator, made.met.shown, made.readings[sensor], units)
            model = estimator.model
            for i in range(units):
                c = replace(made.met.shown, **{k: part(v, units, i) for k, v in vars(made.met.shown).items()})
                u = getattr(c, "rate" if sensor == "gyro" else "specific_force")[:, [channel]]
                b, k, m = np.split(theta[i], np.cumsum([len(model.bias), len(model.scale)]))
                v = u + model.matrix(model.misalignment, c) @ m
                y = v + model.scaled(c, v) @ k + model.matrix(model.bias, c) @ b
                left = part(made.readings[sensor], units, i)[:, channel] - y[:, 0]
                assert np.all(np.abs(estimator.inverse @ left) <= 1e-8 * estimator.error)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2])
def test_the_batched_estimator_agrees_with_planner_calibrate(seed):
    """Whose variances come from each unit's own data: they differ by a fraction of a standard error.

    An estimator of standard errors WORSE times the least differs by √(WORSE² − 1) = 0.32 of one (Gauss,
    Markov); the mean square of 108 differences is within a fifth of that.
    """
    plan, units = plan_of("flown"), 3
    apart = []
    e = prepared_experiment("flown", seed=seed)
    made = units_measured(e, 0, units)
    for i in range(units):
        own = {k: part(v, units, i) for k, v in vars(made.met.shown).items()}
        table = DwellTable(
            unit=np.full(len(e.records), "u"),
            run=e.records.run,
            day=own["day"],
            time_on=own["time_on"],
            duration=e.records.duration,
            temperature_degc=own["temperature_degc"],
            temperature_rate=own["temperature_rate"],
            ref_rate=own["rate"],
            ref_acc=own["specific_force"],
            gyro=part(made.readings["gyro"], units, i),
            acc=part(made.readings["accelerometer"], units, i),
            step=e.records.step,
            bench=e.records.bench,
            source="",
        )
        (found,) = calibrate(table, plan.loaded.spec)
        for sensor in found.sensors:
            for estimator in e.estimators[sensor.sensor]:
                (channel,) = estimator.model.channels
                theta = calibrated(estimator, made.met.shown, made.readings[sensor.sensor], units)[i]
                value = np.array([c.value for c in sensor.coefficients if c.channel == "xyz"[channel]])
                error = np.array(
                    [c.standard_error for c in sensor.coefficients if c.channel == "xyz"[channel]]
                )
                apart += ((theta - value) / error).tolist()
    assert np.sqrt(np.mean(np.square(apart))) < np.sqrt(WORSE**2 - 1.0)
    assert np.abs(apart).max() < SIGMAS * np.sqrt(WORSE**2 - 1.0)


def test_a_unit_without_chance_reads_what_simulate_reads():
    """Two codes, one world: without random parts the readings are the same to rounding."""
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
    plan = plan_of("flown")
    unit = prepared(plan.loaded.spec)
    still = replace(unit, families={}, budgets={k: _only_systematic(b) for k, b in unit.budgets.items()})
    table, _ = simulate(design(steps_of(plan.document), plan.loaded.spec), still, 7, settings=quiet)
    own = replace(
        e,
        unit=replace(e.unit, curves={}, budgets={k: _only_systematic(b) for k, b in e.unit.budgets.items()}),
        chance=Chance(white=dict.fromkeys(SENSORS, 0.0), temperature_jitter=0.0, case="worst", signs="plus"),
    )
    made = units_measured(own, 0, 2)
    for sensor, wanted in zip(SENSORS, (table.gyro, table.acc), strict=True):
        found = part(made.readings[sensor], 2, 1)
        assert np.abs(found - wanted).max() <= 1e-12 * np.abs(wanted).max()


def _only_systematic(budget):
    return budget.model_copy(
        update={"run_to_run": None, "in_run": None, "storage": None, "temperature_residual": None}
    )


def test_the_random_parts_have_the_spreads_of_the_budget():
    """400 units; a standard deviation of 1200 draws is within 7 % (three sigma of 1/√2400)."""
    e = prepared_experiment("flown")
    left = {x.name: x for x in units_left(e, 0, 400)}
    for name, budget in (
        ("gyro.bias", e.unit.budgets["gyro", "bias"]),
        ("accelerometer.bias", e.unit.budgets["accelerometer", "bias"]),
    ):
        sizes = np.sqrt(np.mean(left[name].parts[:, :, 0] ** 2, axis=(1, 2)))
        stored = budget.storage_sigma * np.sqrt(e.day / 60.0)
        for i, wanted in enumerate((budget.run_to_run_largest, budget.in_run_sigma, stored)):
            assert sizes[i] == pytest.approx(wanted, rel=0.07)


@pytest.mark.parametrize("seed", [1, 2])
def test_parts_add_up_to_what_is_left(seed):
    for x in units_left(
        prepared_experiment("flown", seed=seed, starts=anywhere(plan_of("flown").loaded.spec)), 0, 20
    ):
        np.testing.assert_allclose(x.parts.sum(axis=0), x.true - x.estimated, atol=1e-15)


@pytest.mark.parametrize("name", PLANS)
def test_the_flights_are_those_of_the_strapdown(name):
    """Readings corrected sample by sample, û = A u + c, and integrated sample by sample."""
    e = prepared_experiment(name)
    units, t = 3, plan_of(name).trajectory
    coefficients = 10.0 * exact_coefficients(e.flight, units_left(e, 0, units))
    flown = e.flight.navigate(coefficients)
    gyro, accelerometer = e.flight.columns.forcing(0, len(t.angle_increment))
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
