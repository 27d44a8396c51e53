"""Days off: nobody works on them, in the plan, its recount, its pages, exports and on the bench."""

from __future__ import annotations

from datetime import date, datetime, timedelta
from itertools import pairwise
from typing import Any

import pytest

from planner.bench_run.job import job_from
from planner.bench_run.shifts import Hours
from planner.errors import InputError
from planner.export.formats import ics
from planner.export.json import plan_document
from planner.protocols import ExportOptions
from planner.quantities import FIRST_MONDAY
from planner.report.charts.gantt import campaign_picture
from planner.report.subjects.plan_loads import moment
from planner.report.subjects.plan_schedule import people_hours
from planner.spec.days_off import days_off, days_off_between
from planner.verify.recount import recount
from tests.specs import loaded, planned_exactly, shared, small, with_limit, with_plan

HOUR = 3600.0
WORK = {"days": ["mon", "tue", "wed", "thu", "fri"], "from": "08:00", "to": "12:00"}
START = datetime(2026, 12, 22, 8)  # a Tuesday
OFF = ["DE-BY", "2026-12-24", "2026-12-28..2026-12-31"]


def spec(**shift: Any) -> dict[str, Any]:
    """Twelve attended repeats of two hours: a few days of short shifts."""
    raw = shared()
    raw["tests"]["static"] |= {"attended": True, "power_on": "30 min", "record": "1 h"}
    by_hand = {"static": {"temperatures": 3, "repeats": 4}}
    return with_plan(
        with_limit(raw, "60 m"), fixed=by_hand, shifts=WORK | {"start": f"{START:%Y-%m-%d %H:%M}"} | shift
    )


@pytest.fixture(scope="module")
def made() -> Any:
    return planned_exactly(spec(holidays=OFF))


@pytest.fixture(scope="module")
def document(made: Any) -> dict[str, Any]:
    return plan_document(made)


def at(seconds: float) -> datetime:
    return START + timedelta(seconds=seconds)


def test_nobody_works_on_a_day_off(made):
    plan, off = (
        made,
        {date(2026, 12, d) for d in (24, 25, 28, 29, 30, 31)} | {date(2027, 1, d) for d in (1, 6)},
    )
    days = {at(step.start_s).date() for step in plan.steps if step.attended}
    assert {date(2026, 12, 23), date(2027, 1, 4)} <= days  # before and after them
    assert not days & off
    assert all(day.weekday() < 5 for day in days)
    for step in plan.steps:
        if step.attended:
            assert at(step.start_s).hour >= 8
            assert at(step.end_s) <= at(step.end_s).replace(hour=12, minute=0)
    for before, after in pairwise(plan.steps):
        assert before.end_s <= after.start_s


def test_days_off_lengthen_a_campaign_that_meets_them_and_no_other(made):
    plain = planned_exactly(spec())
    late = planned_exactly(spec(holidays=["2027-02-01..2027-02-05"]))
    assert plain.time_s == late.time_s
    # the fifth day of work is 7 January instead of 28 December
    assert made.time_s - plain.time_s == 10 * 24 * HOUR
    assert [s.id for s in plain.steps if s.action == "record"] == [
        s.id for s in made.steps if s.action == "record"
    ]


def test_the_recount_knows_them_by_itself(document):
    def faults(tree: dict[str, Any]) -> list[str]:
        return list(map(str, recount(tree, loaded(spec(holidays=OFF))).faults))

    assert faults(document) == []
    forgotten = document | {"days_off": document["days_off"][1:]}
    assert any("days_off" in fault for fault in faults(forgotten))
    worked = planned_exactly(spec())  # the same steps at hours at which nobody is there
    assert faults(document | {"steps": plan_document(worked)["steps"]})


@pytest.mark.charts
def test_pages_name_dates_and_days_off(made):
    words = people_hours(made)
    assert "begins tue 08:00, 2026-12-22" in words
    assert "2026-12-24, 2026-12-25 (Christmas Day)" in words
    assert "2027-03-29" not in words  # Easter Monday, long after it
    last = made.steps[-1]
    assert moment(made, last.end_s).startswith(f"{at(last.end_s):%Y-%m-%d} ")
    assert "23.12." in campaign_picture(made).svg


def test_a_calendar_holds_them_and_no_appointment_on_them(document):
    files = ics.FORMAT.files(document, ExportOptions()).files
    text = files["attended.ics"]
    calendar = (text.decode() if isinstance(text, bytes) else text).replace("\r\n ", "")
    assert "SUMMARY:Day off: Christmas Day" in calendar
    assert "DTSTART;VALUE=DATE:20261224" in calendar
    assert "DTSTART;TZID=Europe/Berlin:20261222T080000" in calendar  # the plan's own start
    for day in ("20261224", "20261225", "20261228", "20270101"):
        assert f"Berlin:{day}" not in calendar
    with pytest.raises(InputError, match="the shifts were laid from 2026-12-22 08:00"):
        ics.FORMAT.files(document, ExportOptions(start="2026-12-15T08:00"))


def test_a_run_waits_until_after_them(document):
    job = job_from(document)
    index = next(i for i, step in enumerate(job.steps) if step.action == "power_on")

    def left(now: datetime) -> float:
        seconds = (now - datetime.combine(FIRST_MONDAY, datetime.min.time())).total_seconds()
        return Hours(job, lambda: seconds, 0.0).left(index)

    assert left(datetime(2026, 12, 23, 9)) == 0
    eve = datetime(2026, 12, 24, 9)
    assert left(eve) == (datetime(2027, 1, 4, 8) - eve).total_seconds()


def test_a_country_is_that_of_the_package_and_parts_of_it_differ():
    year = (date(2027, 1, 1), date(2028, 1, 1))
    bavaria, berlin = (
        days_off_between(loaded(spec(holidays=one)).spec, *year) for one in ("DE-BY", ["DE-BE", "2027-05-14"])
    )
    assert bavaria[date(2027, 3, 29)] == "Easter Monday"
    assert date(2027, 1, 6) in bavaria
    assert date(2027, 1, 6) not in berlin
    assert (berlin[date(2027, 5, 14)], berlin[date(2027, 3, 8)]) == ("", "Women's Day")
    assert days_off(loaded(small()).spec) == {}


@pytest.mark.parametrize(
    ("holidays", "words"),
    [
        ("2026-13-01", "no date"),
        ("2026-02-30", "no date"),
        ("2027-01-01..2026-12-24", "write 2026-12-24..2027-01-01"),
        ("2020-01-01..2026-12-24", "longer than a year"),
        ("christmas", "a range 2026-12-24..2027-01-01"),
        ("XX", "'XX' is no country"),
        ("DE-QQ", "DE has no part 'QQ'; expected one of BB"),
        (20261224, "a date 2026-12-24"),
        (["DE", {"from": "2026-12-24"}], "is no day off"),
    ],
)
def test_what_is_no_day_off_is_refused_in_words(holidays, words):
    with pytest.raises(InputError) as caught:
        loaded(spec(holidays=holidays))
    (fault,) = caught.value.faults
    assert fault.path.startswith("plan.shifts.holidays")
    assert fault.code in ("P114", "P115")
    assert words in fault.message


def test_days_off_without_a_date_of_the_start_are_refused():
    with pytest.raises(InputError) as caught:
        loaded(spec(holidays=OFF, start="tue 08:00"))
    (fault,) = caught.value.faults
    assert (fault.path, fault.code) == ("plan.shifts.holidays", "P526")
