"""Axes with stops: attitudes that can be had between them, and turns that would run into them."""

from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InputError
from planner.spec.axis_travel import reduced, same_attitude, travel_faults
from tests.specs import loaded, small


@dataclass(frozen=True)
class Asked:
    action: str
    start_s: float
    end_s: float
    motion: dict | None = None


def campaign(*steps):
    """(action, seconds, motion) one after the other."""
    found, now = [], 0.0
    for action, seconds, motion in steps:
        found.append(Asked(action, now, now + seconds, motion))
        now += seconds
    return found


def faults(steps, stops=(-95.0, 95.0), acceleration=None):
    return [message for _, message in travel_faults(steps, {2: stops}, acceleration)]


AT_MINUS_90 = ("move", 5.0, {"position_2_deg": 270.0})


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        ([AT_MINUS_90], None),
        ([("move", 5.0, {"position_2_deg": 180.0})], "180 deg is outside the stops of axis 2, -95 .. 95 deg"),
        ([("move", 5.0, {"rate_2_dps": 1.0})], "unknown place"),
        ([("move", 5.0, {"rate_2_dps": 0.0})], None),
        ([("move", 5.0, {"position_1_deg": 180.0, "rate_1_dps": 50.0})], None),
        # 5 s of the move and 30 s of the record: from -90 to 85, to 95.5
        ([AT_MINUS_90, ("move", 5.0, {"rate_2_dps": 5.0}), ("record", 30.0, {"rate_2_dps": 5.0})], None),
        ([AT_MINUS_90, ("move", 5.0, {"rate_2_dps": 5.3}), ("record", 30.0, {"rate_2_dps": 5.3})], "to 95.5"),
        # and it turns on through a gap, until something stops it
        (
            [
                AT_MINUS_90,
                ("move", 5.0, {"rate_2_dps": 5.0}),
                ("pause", 32.5, None),
                ("power_off", 0.0, None),
            ],
            "for 37.5 s takes axis 2 from -90 to 97.5 deg",
        ),
        # there and back; where it stopped is where the next turn begins
        (
            [
                AT_MINUS_90,
                ("move", 30.0, {"rate_2_dps": 5.0}),
                ("move", 30.0, {"rate_2_dps": -5.0}),
                ("move", 30.0, {"rate_2_dps": 5.0}),
            ],
            None,
        ),
        (
            [AT_MINUS_90, ("move", 30.0, {"rate_2_dps": 5.0}), ("move", 10.0, {"rate_2_dps": 5.0})],
            "from 60 to 110 deg",
        ),
    ],
)
def test_an_axis_with_stops_is_followed_through_the_campaign(steps, words):
    found = faults(campaign(*steps))
    assert len(found) == (words is not None)
    assert words is None or words in found[0]


def test_braking_takes_way():
    steps = campaign(AT_MINUS_90, ("move", 18.0, {"rate_2_dps": 10.0}))
    assert faults(steps, acceleration=None) == []
    assert "to 95.5556 deg" in faults(steps, acceleration=9.0)[0]  # 10²/(2·9) beyond 90


def test_axes_without_stops_are_nowhere_limited():
    assert list(travel_faults(campaign(("move", 1e6, {"rate_1_dps": 1e6})), {}, None)) == []


@given(st.floats(-1e5, 1e5))
@settings(deadline=None, max_examples=100)
def test_an_axis_without_stops_is_told_one_turn_at_most(angle):
    assert abs(reduced(angle)) <= 360.0
    assert (reduced(angle) - angle) % 360.0 == pytest.approx(0.0, abs=1e-6) or (
        reduced(angle) - angle
    ) % 360.0 == pytest.approx(360.0, abs=1e-6)


def test_the_nearest_stop_counts_as_inside():
    assert same_attitude(265.0, (-95.0, 95.0)) == -95.0
    assert same_attitude(264.9, (-95.0, 95.0)) is None


def spec(travel: dict, motions: object = None) -> dict:
    raw = small()
    bench = raw["benches"]["rate_table"] | {"axes": 2, "limits": {"travel": travel}}
    raw["benches"] = {"rate_table": bench}
    raw["tests"]["gyro_drift"]["motions"] = motions or 1
    return raw


@pytest.mark.parametrize(
    ("raw", "path", "words"),
    [
        (spec({2: ["95 deg", "-95 deg"]}), "benches.rate_table.limits.travel[2]", "not below the second"),
        (spec({3: ["-95 deg", "95 deg"]}), "benches.rate_table.limits.travel[3]", "no axis 3"),
        (spec({7: ["-95 deg", "95 deg"]}), "benches.rate_table.limits.travel[7]", "6"),
        (spec({2: ["-95", "95 deg"]}), "benches.rate_table.limits.travel[2][0]", "deg"),
        (
            spec({2: ["-95 deg", "95 deg"]}, [{"position_2": "180 deg"}]),
            "tests.gyro_drift.motions[0].position_2",
            "outside the stops of axis 2, -95 .. 95 deg",
        ),
        (spec({2: ["-95 deg", "95 deg"]}, 6), "tests.gyro_drift.motions", "list motions that do"),
    ],
)
def test_stops_of_a_spec_are_checked_where_they_stand(raw, path, words):
    with pytest.raises(InputError) as caught:
        loaded(raw)
    assert path in [fault.path for fault in caught.value.faults]
    assert words in str(caught.value)
    assert all(fault.line > 0 for fault in caught.value.faults)


def test_stops_in_any_unit_of_angle_are_known_in_rad():
    found = loaded(spec({2: ["-90 deg", "3.14159265358979 rad"]})).spec.benches["rate_table"].limits.travel
    assert found[2] == pytest.approx((-1.5707963267949, 3.14159265358979))
