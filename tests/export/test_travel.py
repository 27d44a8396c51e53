"""What leaves for axes with stops, for whole turns, and for temperatures finer than a controller takes."""

from __future__ import annotations

import re

import pytest

from planner.catalog import exports
from planner.errors import InputError
from planner.protocols import ExportOptions
from tests.export.samples import bench, shipped, small, turning

LIMITS = {"rate_dps": 600, "angular_acceleration_dps2": 500, "acceleration_g": None}


def made(document: dict, form: str = "acutrol"):
    return exports()[form].files(document, ExportOptions("host"))


def demands(document: dict) -> list[str]:
    return re.findall(r":Demand:Position \d,[^|]+", str(made(document).files["table.table.txt"]))


def stopped(motion: dict, stops: tuple[float, float], move: float = 5.0) -> dict:
    return turning(motion, move=move, limits=LIMITS | {"travel_deg": {"2": list(stops)}})


def test_an_axis_with_stops_is_sent_the_same_attitude_between_them():
    assert demands(stopped({"position_2_deg": 270.0}, (-95.0, 95.0))) == [":Demand:Position 2,-90"]
    assert demands(stopped({"position_2_deg": 270.0}, (0.0, 300.0))) == [":Demand:Position 2,270"]


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        ({"position_2_deg": 180.0}, "180 deg is outside the stops of axis 2, -95 .. 95 deg"),
        ({"rate_2_dps": 10.0}, "turns from an unknown place"),
    ],
)
@pytest.mark.parametrize("form", ["acutrol", "chamber", "ics"])
def test_what_would_run_into_a_stop_is_refused(motion, message, form):
    with pytest.raises(InputError, match=message):
        made(stopped(motion, (-95.0, 95.0)), form)


def test_the_way_between_stops_is_straight():
    """From 90 to 270 deg is 180 deg at 500 deg/s²: 1.2 s; from 10 to 350 deg it is 340 deg, not 20."""
    steps = []
    for angle in (10.0, 350.0):
        motion = {"position_2_deg": angle}
        steps += [("move", 1.5, {"motion": motion}), ("record", 20.0, {"motion": motion})]
    steps = [("install", 600.0, {}), *steps[:1], *steps[1:]]
    continuous = small(steps)
    made(continuous)
    with pytest.raises(InputError, match=r"needs 1\.6\d s to move, the plan leaves 1\.50 s"):
        made(small(steps, table=bench(limits=LIMITS | {"travel_deg": {"2": [0, 360]}})))


def test_whole_turns_are_sent_as_what_they_are_and_said():
    document = turning({"position_1_deg": 810.0})
    assert demands(document) == [":Demand:Position 1,90"]
    (note,) = made(document).notes
    assert "810 deg is sent as 90 deg" in note
    assert made(turning({"position_1_deg": -360.0})).notes == ()


def test_a_temperature_finer_than_tenths_is_rounded_aloud():
    steps = [
        ("ramp", 600.0, {"temperature_degc": -42.857142}),
        ("soak", 600.0, {"temperature_degc": -42.857142}),
    ]
    exported = made(small(steps), "chamber")
    assert "TEMP,S-42.9|" in str(exported.files["table.chamber.txt"])
    assert "-42.857142" in str(exported.files["table.setpoints.csv"])
    (note,) = exported.notes
    assert "tenths of a degree" in note
    assert "-42.8571 degC, sent as -42.9" in note


@pytest.mark.parametrize("degc", [-0.04, 0.0, 20.0, -40.5])
def test_tenths_are_sent_without_a_word_and_zero_has_no_sign(degc):
    exported = made(small([("ramp", 600.0, {"temperature_degc": degc})]), "chamber")
    assert "-0.0" not in str(exported.files["table.chamber.txt"])
    assert bool(exported.notes) == (degc == -0.04)


def test_shipped_plans_name_the_stops_they_have():
    assert all(facts["limits"]["travel_deg"] == {} for facts in shipped("high_g")["benches"].values())
