"""The bench run that separates two rivals best: possible on the spec's benches, and worth what it says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.diagnosis_to_next_measurement import (
    ENOUGH,
    _columns,
    _priced,
    _problem,
    next_measurements,
    shapes_of,
)
from planner.diagnose.diagnosis_to_residual import unit_fits
from planner.diagnose.update.bench_runs import bench_runs
from planner.nouns.diagnosis import FoundEffect, Rival, UnitDiagnosis
from planner.spec.load import load_spec
from tests.calibrate.world import Layout, campaign
from tests.diagnose.found import found_effect
from tests.specs import SHIPPED

SMALL = load_spec(SHIPPED / "small_uav.yaml").spec
HIGH_G = load_spec(SHIPPED / "high_g.yaml").spec
# ramps begin with the power-on, so warm-up and the rate of temperature look alike where nothing else is long
SHORT = Layout(temperatures=(-40.0, 20.0, 60.0), static_repeats=1, later=(), rate_temperatures=(20.0,))


def rivals(effect: FoundEffect, *names: str) -> FoundEffect:
    return replace(effect, rivals=tuple(Rival(name, 1.0) for name in names))


def fitted(effect: FoundEffect, spec=SMALL, layout: Layout = SHORT):
    table = campaign(3, (), layout)
    return unit_fits(table, spec, UnitDiagnosis("u1", "explained", (effect,), (), (), (), (), ()))


def test_without_rivals_nothing_is_to_be_measured():
    effect = found_effect("warm_up", "gyro_x", 1e-4, 1e-5)
    assert next_measurements((effect,), fitted(effect), SMALL) == ()


def test_a_rival_without_a_name_asks_for_nothing():
    effect = rivals(found_effect("warm_up", "gyro_x", 1e-4, 1e-5), "temperature")
    assert next_measurements((effect,), fitted(effect), SMALL) == ()


@pytest.mark.parametrize(
    ("effect", "value", "rival"),
    [
        ("temperature_rate", 3e-3, "warm_up"),
        ("warm_up", 1e-4, "temperature_rate"),
        ("warm_up", 1e-4, "ageing"),
    ],
)
def test_the_run_is_within_the_limits_and_separates(effect, value, rival):
    found = rivals(found_effect(effect, "gyro_x", value, value / 10), rival)
    (wanted,) = next_measurements((found,), fitted(found), SMALL)
    assert wanted.separates == (effect, rival)
    assert wanted.bench == "rate_table"
    assert wanted.separation >= ENOUGH
    assert wanted.time_s > 0
    low, high = SMALL.benches["rate_table"].chamber.range
    assert low <= wanted.condition["temperature_degc"] <= high
    assert abs(wanted.condition.get("temperature_rate_k_min", 0.0)) <= 4.0


def test_every_run_that_is_considered_is_possible_on_its_bench():
    for spec in (SMALL, HIGH_G):
        for run in bench_runs(spec, [-60.0, 20.0, 60.0], 5.0):
            bench = spec.benches[run.bench]
            chamber = bench.chamber
            t = run.conditions.temperature_degc
            if chamber is None:
                assert np.all(t == spec.plan.temperatures.room)
                assert not run.conditions.temperature_rate.any()
            else:
                assert chamber.range[0] <= t.min() <= t.max() <= chamber.range[1]
            for motion in run.motions:
                for key, value in motion.items():
                    if key.startswith("rate"):
                        assert abs(np.radians(value)) <= bench.limits.rate * (1 + 1e-9)
                    if key.startswith("acceleration"):
                        assert abs(value) * 9.80665 <= bench.limits.acceleration * (1 + 1e-9)
            assert (run.conditions.time_on > 0).all()
            assert run.repeat_s >= run.duration.sum()


def test_the_separation_is_that_of_the_stacked_design():
    """Oracle: old and new rows in one matrix, plain least squares, the rival at its best shape."""
    found = rivals(found_effect("temperature_rate", "gyro_x", 1e-3, 1e-4), "warm_up")
    fits = fitted(found)
    (channel,) = [c for c in fits.channels if c.channel == "gyro_x"]
    problem = _problem(
        channel, found, "warm_up", shapes_of("warm_up", found, fits.table), float(fits.table.duration.mean())
    )
    for run in bench_runs(SMALL, fits.table.temperature_degc.tolist(), 5.0)[::7]:
        priced = _priced([problem], run)
        fit = channel.after.spreads
        white = fit.white**2 * fits.table.duration.mean() / run.duration
        V = np.diag(white + (fit.rate * run.conditions.rate[:, 0]) ** 2) + fit.run**2
        root = np.linalg.cholesky(V)
        left = []
        for shape in problem.shapes:
            old = channel.after.v.whiten(
                _columns(channel, found, "warm_up", shape, channel.before.model.conditions)
            )
            once = np.linalg.solve(root, _columns(channel, found, "warm_up", shape, run.conditions))
            stacked = np.concatenate([old, *[once] * priced.repeats])
            X = stacked[:, :-1] / np.maximum(np.linalg.norm(stacked[:, :-1], axis=0), 1e-300)
            u, s, _ = np.linalg.svd(X, full_matrices=False)
            basis = u[:, s > 1e-9 * s[0]]
            left.append(np.linalg.norm(stacked[:, -1] - basis @ (basis.T @ stacked[:, -1])))
        # the faint prior of the factor and the cut of the singular values differ by their own 1e-6
        assert priced.separation == pytest.approx(float(min(left)), rel=1e-3, abs=1e-3)


def test_more_repeats_never_separate_less():
    found = rivals(found_effect("temperature_rate", "gyro_x", 1e-5, 1e-6), "warm_up")
    fits = fitted(found)
    (channel,) = [c for c in fits.channels if c.channel == "gyro_x"]
    problem = _problem(channel, found, "warm_up", shapes_of("warm_up", found, fits.table), 60.0)
    for run in bench_runs(SMALL, [20.0], 5.0)[:6]:
        assert _priced([problem], run).gain >= -1e-9


def test_an_effect_of_acceleration_asks_for_the_centrifuge_where_there_is_one():
    layout = replace(SHORT, centrifuge=False)
    found = rivals(
        found_effect("scale_factor_acceleration", "gyro_z", 1e-7, 1e-8), "scale_factor_nonlinearity"
    )
    declared = tuple(
        e for e in HIGH_G.effects if e in ("bias", "bias_temperature", "scale_factor", "misalignment")
    )
    spec = HIGH_G.model_copy(update={"effects": declared})
    (wanted,) = next_measurements((found,), fitted(found, spec, layout), spec)
    assert wanted.bench == "centrifuge"


def test_a_later_day_tells_ageing_from_a_step():
    """1e-4 deg/s a day: a step between the days of the data is over; ageing goes on."""
    found = rivals(found_effect("ageing", "gyro_x", 2e-11, 2e-12), "bias_step")
    (wanted,) = next_measurements((found,), fitted(found, layout=replace(SHORT, later=(30.0,))), SMALL)
    assert wanted.condition["days_later"] > 0.0
