import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.bench_run import limits
from planner.control.dialect_files import chamber_dialect
from planner.control.orders import MotionError, orders
from planner.errors import InputError
from planner.nouns.bench import BenchFacts
from tests.bench_run.rig import Rig, small_job

BENCH = BenchFacts("rate_table", "rate_table", 2, 20.0, rate_dps=600.0, angular_acceleration_dps2=500.0)


def changed(index=-1, bench=None, **step):
    """The small campaign with one record (or the bench) changed."""
    job = small_job()
    records = [i for i, s in enumerate(job.steps) if s.action == "record"]
    steps = list(job.steps)
    steps[records[index]] = replace(steps[records[index]], **step)
    benches = {"rate_table": replace(job.benches["rate_table"], **(bench or {}))}
    return replace(job, steps=tuple(steps), benches=benches)


@pytest.mark.parametrize(
    ("job", "message"),
    [
        (changed(motion={"rate_1_dps": 601.0}), "over the limit of axis 1, 600 deg/s"),
        (changed(motion={"rate_1_dps": math.nan}), "nan"),
        (changed(motion={"rate_3_dps": 1.0}), "axis 3 is named, but the bench has 2"),
        (changed(motion={"position_1_dps": 1.0}), "unknown motion"),
        (changed(motion={"rate_1_dps": 1.0, "position_1_deg": 1.0}), "both held and turned"),
        (changed(motion={"acceleration_g": 5.0}), "add 'arm: 1.5 m'"),
        (
            changed(motion={"acceleration_g": 5.0}, bench={"arm_m": 1.5, "acceleration_g": 4.0}),
            "the load, 4 g",
        ),
        (changed(motion={"acceleration_g": 50.0}, bench={"arm_m": 1.5}), "the arm, 600 deg/s"),
        (changed(temperature_degc=90.0), "outside the chamber's -65 .. 85"),
        (changed(temperature_degc=math.nan), "outside the chamber's"),
        (changed(bench={"chamber": None}), "rate_table has no chamber"),
        (changed(bench={"travel": {2: (-95.0, 95.0)}}), "180 deg is outside the stops of axis 2"),
        (changed(bench={"travel": {1: (-400.0, 400.0)}}), "takes axis 1 from 270 to .* beyond its stops"),
    ],
)
def test_what_the_bench_cannot_do_is_refused_before_anything_moves(job, message):
    with pytest.raises(InputError, match=message) as caught:
        limits.check(job)
    assert caught.value.exit_code == 2


def test_steps_that_make_no_sense_are_refused():
    for change, message in (
        ({"bench": "moon"}, "no bench 'moon' in the plan"),
        ({"action": "dance"}, "unknown action"),
        ({"end_s": -1.0}, "ends before"),
        ({"id": "rate_table/install"}, "two steps"),
    ):
        job = small_job()
        steps = (*job.steps[:-1], replace(job.steps[-1], **change))
        with pytest.raises(InputError, match=message):
            limits.check(replace(job, steps=steps))


def test_all_kinds_of_fault_are_told_at_once():
    job = changed(motion={"rate_1_dps": 900.0})
    steps = [replace(s, temperature_degc=99.0) if s.action == "soak" else s for s in job.steps]
    with pytest.raises(InputError) as caught:
        limits.check(replace(job, steps=tuple(steps)))
    assert len(caught.value.faults) == 2


def test_the_small_campaign_is_within_its_limits():
    assert limits.check(small_job()) == ()


def test_digits_that_the_chamber_does_not_take_are_told_by_what_it_speaks():
    job = changed(temperature_degc=20.25)
    (tenths,) = limits.check(job)
    assert "takes tenths of a degree" in tenths
    assert "sent as 20.2" in tenths
    assert limits.check(job, {"rate_table": chamber_dialect("scpi_chamber")}) == ()
    kelvin = chamber_dialect("scpi_chamber").model_copy(update={"units": "K", "decimals": 0})
    (steps,) = limits.check(job, {"rate_table": kelvin})
    assert "takes steps of 1 K" in steps
    assert "most 20.25 degC, sent as 293" in steps  # 293.4 K


def test_stops_are_kept_by_going_the_same_attitude_another_way(tmp_path):
    job = small_job()
    bench = replace(job.benches["rate_table"], travel={2: (-10.0, 190.0)})
    job = replace(job, benches={"rate_table": bench})
    limits.check(job)
    rig = Rig(travel=[None, (-10.0, 190.0)])
    rig.run(job, tmp_path / "run.jsonl")
    assert rig.table.refusals == []


@given(st.floats(-1e4, 1e4), st.floats(-400, 0), st.floats(1, 400))
@settings(deadline=None, max_examples=200)
def test_an_angle_within_the_stops_is_the_same_attitude_or_refused(angle, least, span):
    most = least + span
    bench = replace(BENCH, travel={1: (least, most)})
    try:
        (order,) = orders({"position_1_deg": angle}, bench)
    except MotionError:
        assert span < 360.0
        return
    assert least - 1e-9 <= order.value <= most + 1e-9
    assert abs(math.remainder(order.value - angle, 360.0)) < 1e-6


@given(st.floats(-100, 100), st.floats(0.2, 10))
@settings(deadline=None, max_examples=100)
def test_the_arm_turns_so_that_its_end_feels_the_load(load, arm):
    (order,) = orders({"acceleration_g": load}, replace(BENCH, arm_m=arm, rate_dps=None))
    assert order.axis == 1
    assert order.value >= 0
    assert arm * math.radians(order.value) ** 2 == pytest.approx(abs(load) * 9.80665)
