"""Rules for tests whose records are made on ramps: what their chamber can do, and what is planned of them."""

from __future__ import annotations

from collections.abc import Iterator

from planner import catalog
from planner.spec.model import Chamber, Spec, Test
from planner.spec.plan_choice import FixedTest
from planner.spec.ramp import Ramp, half_way
from planner.spec.review import Review

ROUNDING = 1e-9


def ramps(sheet: Review) -> None:
    """All rules for all tests on ramps."""
    for name, test in sheet.spec.tests.items():
        path = ("tests", name, "temperature")
        if test.ramp is None or not sheet.whole(*path):
            continue
        bench = sheet.bench_of(test, "chamber")
        if bench is not None:
            for problem in _of_the_chamber(sheet, name, test, test.ramp, bench.chamber):
                sheet.fault("P424", path, problem)
        for problem in _not_planned(sheet, test):
            sheet.fault("P425", path, problem)


def _of_the_chamber(
    sheet: Review, name: str, test: Test, ramp: Ramp, chamber: Chamber | None
) -> Iterator[str]:
    if chamber is None:
        yield f"bench '{test.bench}' has no chamber to ramp; give it one, or soak the test"
        return
    for word, speed in (("heating", chamber.heating), ("cooling", chamber.cooling)):
        if speed is None:
            yield f"how fast the chamber of '{test.bench}' goes is not said; give its '{word}'"
        elif ramp.ramp > speed * (1.0 + ROUNDING):
            yield (
                f"{60.0 * ramp.ramp:g} K/min is faster than the chamber of '{test.bench}', "
                f"{word} {60.0 * speed:g} K/min"
            )
    if not sheet.whole("tests", name) or not sheet.whole("plan"):
        return
    coldest, hottest = _reached(sheet.spec, name, test)
    low, high = chamber.range
    if coldest < low - ROUNDING or hottest > high + ROUNDING:
        yield (
            f"its ramps go {half_way(test):g} K to either side of a temperature, to {coldest:g} .. "
            f"{hottest:g} degC, outside the chamber of '{test.bench}', {low:g} .. {high:g} degC"
        )


def _reached(spec: Spec, name: str, test: Test) -> tuple[float, float]:
    """Coldest and hottest where the ramps of a test may turn, degC."""
    fixed = spec.plan.fixed.get(name, FixedTest()).temperatures
    chosen = fixed if fixed is not None else test.temperatures
    given = chosen if isinstance(chosen, tuple) else spec.plan.temperatures.range
    if chosen == "room":
        given = (spec.plan.temperatures.room,)
    return min(given) - half_way(test), max(given) + half_way(test)


def _not_planned(sheet: Review, test: Test) -> Iterator[str]:
    spec = sheet.spec
    if test.temperatures == "room":
        yield "'temperatures: room' is outside the chamber; give temperatures in degC, or soak the test"
    if sheet.published:
        yield (
            "the published method (that of worst_case and of given sensitivities too) knows soaked tests "
            "only; plan by information, with rule rss or percentile"
        )
    if sheet.whole("plan", "overlap") and "cool_down" in spec.plan.overlap:
        yield "its chamber ramps while it cools down, so nothing overlaps; leave plan.overlap out"
    if sheet.whole("effects"):
        known = catalog.effects()
        asking = [e for e in spec.effects if e in known and getattr(known[e], "history", False)]
        if asking:
            yield (
                f"how {asking[0]} goes on from one ramp to the next is not planned; declare "
                "temperature_rate_table instead, or soak the test"
            )
