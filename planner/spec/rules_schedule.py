"""Rules for shifts, batches and what people do: work that fits into no shift, shifts without hours."""

from __future__ import annotations

from planner.solvers.calendar import Calendar
from planner.spec.attendance import attended_spans, calendar_of, install_attended, powered_time
from planner.spec.days_off import first_monday
from planner.spec.model import Bench
from planner.spec.review import Review
from planner.spec.yaml12 import Path

REMEDY = "write longer shifts, or 'attended: false'"


def schedule(sheet: Review) -> None:
    """All rules for the schedule."""
    if _hours_fit(sheet) and sheet.spec.plan.shifts and sheet.whole("plan", "shifts"):
        hours = calendar_of(sheet.spec)
        for name, bench in sheet.spec.benches.items():
            _installing(sheet, hours, name, bench)
        _tests(sheet, hours)


def _hours_fit(sheet: Review) -> bool:
    good, started = True, None
    shifts = [(i, shift) for i, shift in enumerate(sheet.spec.plan.shifts) if shift]  # a draft has gaps
    index = next((i for i, shift in shifts if shift.holidays), None)
    if index is not None and sheet.whole("plan", "shifts") and first_monday(sheet.spec) is None:
        sheet.fault(
            "P526",
            (*sheet.item(("plan", "shifts"), index), "holidays"),
            "need the date of the start; write it beside them, 'start: 2026-12-21 08:00'",
            key=True,
        )
        good = False
    for index, shift in shifts:
        path = sheet.item(("plan", "shifts"), index)
        if shift.opens == shift.closes:
            sheet.fault(
                "P521", (*path, "to"), "ends when it begins; write 'from: 00:00, to: 24:00' for all day"
            )
            good = False
        if shift.start is not None and started not in (None, shift.start):
            sheet.fault(
                "P522", (*path, "start"), "another shift already says when the campaign starts; keep one"
            )
            good = False
        started = shift.start if started is None else started
    return good


def _installing(sheet: Review, hours: Calendar, name: str, bench: Bench) -> None:
    if not install_attended(sheet.spec, name) or not sheet.whole("benches", name, "attended"):
        return
    for key, seconds in (("install", bench.install), ("remove", bench.remove)):
        if seconds > hours.longest:
            sheet.fault("P523", ("benches", name, key), _too_long(f"{key} takes", seconds, hours))


def _tests(sheet: Review, hours: Calendar) -> None:
    for name, test in sheet.spec.tests.items():
        known = sheet.whole("tests", name) and sheet.whole("benches", test.bench)
        bench = sheet.bench_of(test) if known else None
        spans = () if bench is None else attended_spans(test.bench, bench, test)
        if bench is None or not spans:
            continue
        step = max(end - start for start, end in spans)
        if step > hours.longest:
            key = "power_on" if test.power_on == step else "bench"
            sheet.fault("P524", ("tests", name, key), _too_long("one step of people's takes", step, hours))
            continue
        try:
            hours.passage(spans, powered_time(bench, test))
        except ValueError:
            seconds = max(end for _, end in spans)
            what = "one repeat is one power-on that is not interrupted; people are needed over"
            path: Path = ("tests", name, "attended") if test.attended else ("tests", name)
            sheet.fault("P525", path, _too_long(what, seconds, hours), key=not test.attended)


def _too_long(what: str, seconds: float, hours: Calendar) -> str:
    return (
        f"{what} {seconds / 3600:.4g} h, which fits into no shift (the longest is "
        f"{hours.longest / 3600:.4g} h); {REMEDY}"
    )
