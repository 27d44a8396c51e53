"""The appointments and the sheet for people."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from html.parser import HTMLParser
from zoneinfo import ZoneInfo

import icalendar
import pytest

from planner.catalog import exports
from planner.errors import InputError
from planner.protocols import ExportOptions
from tests.export.samples import resealed, shipped, small, turning
from tests.shipped_plans import LONG, SAMPLE

OPTIONS = ExportOptions(start="2026-12-01T08:00", timezone="Europe/Berlin")


def made(document: dict, options: ExportOptions = OPTIONS) -> dict:
    return dict(exports()["ics"].files(document, options).files)


def events(document: dict, options: ExportOptions = OPTIONS) -> list[icalendar.Event]:
    return list(icalendar.Calendar.from_ical(made(document, options)["attended.ics"]).walk("VEVENT"))


@pytest.mark.parametrize("name", SAMPLE)
@pytest.mark.further("name", LONG)
def test_every_installing_and_removing_is_an_appointment_at_its_time(name):
    document = shipped(name)
    every = events(document)
    found = {str(e["UID"]).split("@")[0]: e for e in every}
    assert len(found) == len(every)
    start = datetime(2026, 12, 1, 8, tzinfo=ZoneInfo("Europe/Berlin")).astimezone(UTC)
    for step in document["steps"]:
        if step["action"] in ("install", "remove"):
            event = found.pop(step["id"])
            for key, time in (("DTSTART", step["start_s"]), ("DTEND", step["end_s"])):
                assert event[key].dt.astimezone(UTC) == start + timedelta(seconds=round(time))
                assert event[key].params["TZID"] == "Europe/Berlin"
    assert all(str(e["SUMMARY"]).startswith("Turn round") for e in found.values())


def test_the_time_zone_is_defined_with_both_changes_of_the_clocks():
    text = made(shipped("published_one_bench"))["attended.ics"].decode()
    calendar = icalendar.Calendar.from_ical(text)
    (zone,) = calendar.walk("VTIMEZONE")
    assert zone["TZID"] == "Europe/Berlin"
    offsets = {part["TZOFFSETTO"].td for part in zone.walk("STANDARD") + zone.walk("DAYLIGHT")}
    assert offsets == {timedelta(hours=1), timedelta(hours=2)}
    assert max(len(line) for line in text.encode().split(b"\r\n")) <= 75  # RFC 5545, 3.1


def test_elapsed_time_runs_through_the_change_to_summer_time():
    document = small([("install", 600.0, {}), ("soak", 7200.0, {}), ("remove", 600.0, {})])
    (_, remove) = events(document, ExportOptions(start="2027-03-28T01:00", timezone="Europe/Berlin"))
    assert remove["DTSTART"].dt.strftime("%H:%M") == "04:10"  # 2 h 10 min later, and an hour was skipped


def test_turning_the_unit_round_on_an_arm_is_one_appointment_a_repeat():
    document = shipped("high_g")
    turns = [e for e in events(document) if str(e["SUMMARY"]).startswith("Turn round")]
    loads = next(test for test in document["tests"] if test["test"] == "loads")
    assert len(turns) == sum(loads["repeats"])
    # 24 loads, + and − in turns: the unit starts outwards, so 23 turns in the first repeat
    assert "23 times" in str(turns[0]["DESCRIPTION"])


def test_faces_of_a_levelled_plate_are_put_on_by_hand():
    document = turning({"position_1_deg": 90}, kind="levelled_plate")
    assert [str(e["SUMMARY"]).split(":")[0] for e in events(document)] == [
        "Install",
        "Put on its face",
        "Remove",
    ]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (ExportOptions(timezone="Europe/Berln"), "did you mean 'Europe/Berlin'"),
        (ExportOptions(timezone="../../etc/passwd"), "unknown time zone"),
        (ExportOptions(start="soon"), "is no time; write it like"),
        (ExportOptions(start="0001-01-01T00:00"), "no year"),
        (ExportOptions(start="2027-03-28T02:30"), "clocks are put forward"),
    ],
)
def test_unknown_zones_and_times_are_refused_kindly(options, message):
    with pytest.raises(InputError, match=message):
        made(shipped("published_one_bench"), options)


def test_without_options_a_start_is_assumed_and_said():
    exported = exports()["ics"].files(shipped("published_one_bench"), ExportOptions())
    assert "2027-01-04T08:00, Europe/Berlin" in exported.notes[0]
    assert exports()["ics"].files(shipped("published_one_bench"), OPTIONS).notes == ()


class Sheet(HTMLParser):
    """Rows of the sheet, and whatever it would load from elsewhere."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.boxes, self.outside, self.hands = 0, [], 0
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.boxes += tag == "input" and found.get("type") == "checkbox"
        self.hands += tag == "tr" and found.get("class") == "hand"
        self.outside += [v for k, v in attrs if k in ("src", "href") and v]


@pytest.mark.parametrize("name", ["high_g", "published_two_benches"])
def test_the_operator_sheet_has_a_box_for_every_line_and_loads_nothing(name):
    document = shipped(name)
    text = made(document)["operator.html"]
    sheet = Sheet(text)
    assert sheet.outside == []
    assert "url(" not in text
    assert sheet.hands >= sum(s["action"] in ("install", "remove") for s in document["steps"])
    records = sum(s["action"] == "record" for s in document["steps"])
    assert sum(int(n) for n in re.findall(r"(\d+) records? of", text)) == records
    assert sheet.boxes == text.count('<tr class="hand"') + text.count('<tr class="alone"')


def test_names_from_the_spec_are_escaped_in_the_sheet_and_folded_in_the_calendar():
    document = turning({"position_1_deg": 90})
    document["spec"]["name"] = "<script>alert(1)</script>\nBEGIN:VEVENT"
    files = made(resealed(document))
    assert "<script>" not in files["operator.html"]
    assert files["attended.ics"].count(b"\r\nBEGIN:VEVENT") == 2
