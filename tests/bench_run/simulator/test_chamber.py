import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.bench_run.simulator.chamber import Chamber
from tests.bench_run.memory_line import VirtualClock


def running():
    clock = VirtualClock()
    chamber = Chamber(clock)
    assert chamber.receive("POWER,ON") == "OK:POWER,ON"
    assert chamber.receive("MODE,CONSTANT") == "OK:MODE,CONSTANT"
    return clock, chamber


@given(st.floats(-70, 180), st.floats(-70, 180), st.floats(0, 5000))
@settings(deadline=None, max_examples=100)
def test_it_goes_no_faster_than_it_can_never_overshoots_and_settles(first, second, pause):
    clock, chamber = running()
    chamber.receive(f"TEMP,S{first:.1f}")
    clock.sleep(pause)
    start = chamber.at()
    chamber.receive(f"TEMP,S{second:.1f}")
    target = chamber.setpoint_degc
    least, most = sorted((start, target))
    before = start
    for _ in range(50):
        clock.sleep(60.0)
        now = chamber.at()
        assert -2.0 - 1e-9 <= now - before <= 4.0 + 1e-9
        assert least - 1e-9 <= now <= most + 1e-9
        before = now
    clock.sleep(4 * 3600.0)
    assert chamber.at() == pytest.approx(target, abs=1e-6)


@pytest.mark.parametrize(
    "message", ["TEMP,S200.0", "TEMP,S-71.0", "TEMP", "temp?", "TEMP,Sx", "MODE,FAST", ""]
)
def test_nonsense_is_answered_with_na(message):
    _, chamber = running()
    assert chamber.receive(message).startswith("NA:")
    assert chamber.setpoint_degc == 20.0


def test_without_power_nothing_happens():
    clock = VirtualClock()
    chamber = Chamber(clock)
    assert chamber.receive("MODE,CONSTANT").startswith("NA:")
    chamber.receive("TEMP,S-40.0")
    clock.sleep(1e5)
    assert chamber.receive("TEMP?") == "20.0,-40.0,180.0,-70.0"


def test_a_chamber_that_never_settles_stops_short():
    clock, chamber = running()
    chamber.stall()
    chamber.receive("TEMP,S-40.0")
    clock.sleep(1e5)
    assert chamber.at() == pytest.approx(-35.0)
