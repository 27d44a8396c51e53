"""Campaigns of other kinds than the usual one: what hides is named, and nothing else is claimed.

Each stands for a way in which the search once failed on campaigns of its kind; the comment says how.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from tests.calibrate.other_campaigns import Bench, Campaign, G, Hidden, campaign
from tests.diagnose.worlds import spec

ALPHA = 0.01  # family-wise, of a claim
FEW = Bench(temperatures=(-55, -25, 5, 35, 65), rate_temperatures=(-55, 5, 65), static_runs=4)


def diagnosed(
    seed: int, bench: Bench, *hidden: Hidden, sensor: str = "gyro", without: str = ""
) -> UnitDiagnosis:
    """The diagnosis of one sensor's readings; without: a reference that the table does not have."""
    return diagnose(table(campaign(seed, bench, hidden), sensor, without), spec())


def table(c: Campaign, sensor: str, without: str = "") -> DwellTable:
    """A dwell table in SI of both sensors, or of one."""
    r = c.rows
    return DwellTable(
        unit=np.full(len(r.run), "u1"),
        run=r.run,
        day=r.day,
        time_on=r.time_s,
        duration=r.duration_s,
        temperature_degc=r.degc,
        temperature_rate=r.degc_min / 60.0,
        ref_rate=np.radians(r.rate),
        ref_acc=None if without == "ref_acc" else r.force * G,
        gyro=np.radians(c.gyro) if sensor in ("gyro", "both") else None,
        acc=c.acc * G if sensor in ("acc", "both") else None,
    )


def claims(d: UnitDiagnosis) -> set[tuple[str, tuple[str, ...]]]:
    """What is claimed, on which channels: effects and unknowns."""
    return {(e.effect, e.channels) for e in d.effects} | {(u.varies_with, u.channels) for u in d.unknown}


def test_noise_of_whichever_axis_turns_is_no_effect() -> None:
    # noise of the own rate only gave five claims on a clean unit: the table shakes all three
    d = diagnosed(1, Bench(turning_noise=1e-5))
    assert claims(d) == set()


def test_a_step_between_any_two_of_sixty_days_is_named_with_its_day() -> None:
    # sixteen days were tried, and an unknown of the day followed a step between two of them better
    d = diagnosed(11, Bench(static_runs=5), Hidden("bias_step", "gyro_z", 25.0, at=1.85))
    assert claims(d) == {("bias_step", ("gyro_z",))}
    assert d.effects[0].nonlinear["day"] == pytest.approx(1.85, abs=0.1)  # power-ons are 0.05 days apart


@pytest.mark.parametrize("strength", [12.0])
@pytest.mark.further("strength", [25.0])
def test_a_cubic_seen_by_a_centrifuge_is_no_unknown(strength: float) -> None:
    # the freedom of a noise that is nearly zero made F's tail so long that 27 sigma were not significant
    d = diagnosed(3, FEW, Hidden("scale_factor_nonlinearity", "gyro_z", strength))
    assert d.unknown == ()
    (e,) = d.effects
    assert e.channels == ("gyro_z",)
    assert "scale_factor_nonlinearity" in {e.effect, *(r.effect for r in e.rivals)}


def test_an_offset_of_each_face_is_an_unknown_of_the_orientation() -> None:
    # with loaded rows six bins do not add up to one: the first face's went to a warm-up
    d = diagnosed(4, Bench(static_runs=3, rate_temperatures=(0,)), Hidden("per face", "gyro_x", 25.0))
    assert claims(d) == {("orientation", ("gyro_x",))}


def test_nothing_is_reported_that_is_not_significant() -> None:
    # a curve that no exponential follows kept the search busy until its last round, whose guesses stood
    d = diagnosed(5, FEW, Hidden("log of time", "gyro_x", 300.0))
    assert all(x.p_value <= ALPHA for x in (*d.effects, *d.unknown))
    assert {channels for _, channels in claims(d)} == {("gyro_x",)}


def test_outliers_of_40_sigma_change_no_verdict() -> None:
    d = diagnosed(6, Bench(outliers=0.004), Hidden("g_squared_sensitivity", "gyro_y", 15.0))
    assert claims(d) == {("g_squared_sensitivity", ("gyro_y",))}


def test_a_scale_factor_anew_each_power_on_is_no_asymmetry() -> None:
    # six runs a channel on the centrifuge said that there was none, and 50 g times it looked like 8 sigma
    bench = Bench(rate_temperatures=(0,), run_scale={"gyro": 2.5e-5, "acc": 2.5e-5})
    assert claims(diagnosed(13, bench, sensor="acc")) == set()


def test_rows_of_normal_noise_are_no_outliers() -> None:
    # power-ons far apart made neighbours in one of them look far off
    d = diagnosed(11, FEW, sensor="acc")
    assert not [n for n in d.notes if "far off" in n]
