"""Rules for the tests: what they calibrate, on which bench, at which temperatures."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from planner import catalog
from planner.spec.model import Bench, Chamber, Motion, Test
from planner.spec.places import did_you_mean
from planner.spec.plan_choice import FixedTest
from planner.spec.review import Review
from planner.spec.rules_benches import kind_of
from planner.spec.rules_requirement import all_errors, unit_of
from planner.spec.slow_rates import slow_rates
from planner.spec.unused_tests import is_unused
from planner.spec.yaml12 import Path

# What shows the four plain errors; for the others `observes` works it out from their regressors, in 70 ms.
PLAIN_NEEDS = {
    "gyro.bias": frozenset[str](),
    "accelerometer.bias": frozenset[str](),
    "gyro.scale_factor": frozenset({"rate"}),
    "accelerometer.scale_factor": frozenset({"gravity"}),
}


def tests(sheet: Review) -> None:
    """All rules for all tests."""
    for name, test in sheet.spec.tests.items():
        if test.bench not in sheet.names("benches") and sheet.readable(("benches",)):
            options = did_you_mean(test.bench, sheet.names("benches"))
            sheet.fault("P411", ("tests", name, "bench"), f"there is no bench '{test.bench[:40]}'{options}")
        _calibrates(sheet, name, test)
        _settled(sheet, name, test)
        _temperatures(sheet, name, test)
        bench = sheet.bench_of(test, "kind", "axes", "limits")
        if bench is not None:
            _observed(sheet, name, test, bench)
            _motions(sheet, name, test, bench)
    _slow(sheet)


def _slow(sheet: Review) -> None:
    """Rates so low that the bias drowns the scale factor there."""
    if all(sheet.whole(part) for part in ("tests", "benches", "unit")):
        for name, said in slow_rates(sheet.spec):
            sheet.warn("P426", ("tests", name, "motions"), said, key=True)


def _calibrates(sheet: Review, name: str, test: Test) -> None:
    for index, error in enumerate(test.calibrates):
        path = sheet.item(("tests", name, "calibrates"), index)
        problem = _not_calibrated(sheet, error)
        if error in test.calibrates[:index]:
            problem = f"{error} stands here twice; keep one"
        if problem:
            sheet.fault("P412", path, problem)


def _not_calibrated(sheet: Review, error: str) -> str | None:
    """Why an error cannot be calibrated, or None."""
    sensor, _, effect = error.partition(".")
    if unit_of(error) is None:
        return f"unknown error '{error[:40]}'{did_you_mean(error, all_errors())}"
    if error not in sheet.budgeted():
        return (
            f"{error} has no budget; add unit.{sensor}.{effect}" if sheet.readable(("unit", sensor)) else None
        )
    if sheet.whole("effects") and effect not in sheet.spec.effects:
        return f"'effects' does not declare {effect}; add it there, or do not calibrate {error}"
    budget = sheet.budget(error)
    bare = budget is not None and not budget.has_run_to_run and sheet.whole("unit", sensor, effect)
    if bare and sheet.published:
        return (
            f"{error} has no run_to_run spread, which its repeats come from; add unit.{error}.run_to_run, "
            f"'0 {unit_of(error)}' where it has none"
        )
    return None


def _settled(sheet: Review, name: str, test: Test) -> None:
    """Nothing can be chosen for a test that calibrates nothing: its temperatures and repeats are given."""
    if test.calibrates or not sheet.whole("plan", "fixed") or not sheet.whole("tests", name):
        return
    fixed = sheet.spec.plan.fixed.get(name, FixedTest())
    if is_unused(test, fixed):
        return
    missing = [
        key
        for key in ("temperatures", "repeats")
        if getattr(test, key) is None and getattr(fixed, key) is None
    ]
    if missing:
        what = " and ".join(missing)
        sheet.fault(
            "P413", ("tests", name), f"calibrates nothing, so nothing tells its {what}; give {what}", key=True
        )


def _temperatures(sheet: Review, name: str, test: Test) -> None:
    fixed = sheet.spec.plan.fixed.get(name, FixedTest()).temperatures
    own = ("tests", name, "temperatures")
    by_hand = ("plan", "fixed", name, "temperatures")
    if test.temperatures is not None and fixed is not None and test.temperatures != fixed:
        sheet.fault("P414", by_hand, f"tests.{name}.temperatures says something else; keep one")
    choices: list[tuple[Path, Any]] = [(own, test.temperatures), (by_hand, fixed)]
    given = [(path, value) for path, value in choices if value is not None]
    if not given and test.calibrates:
        given = [(("tests", name), None)]
    bench = sheet.bench_of(test, "chamber")
    said = all(sheet.whole(*path) for path in (own, by_hand))
    for path, value in given:
        if bench is not None and (said or value is not None):
            check_temperatures(sheet, path, value, test.bench, bench)


def check_temperatures(sheet: Review, path: Path, value: Any, name: str, bench: Bench) -> None:
    """`value` is room, a number, a list, or None when the planner chooses; the bench must reach it."""
    if value in ("room", 0):
        return
    if isinstance(value, tuple) and len(set(value)) < len(value):
        sheet.fault("P415", path, "a temperature stands here twice; keep one")
    if bench.chamber is None:
        if value != (sheet.spec.plan.temperatures.room,):
            sheet.fault(
                "P416",
                path,
                f"bench '{name}' has no chamber; write 'temperatures: room', or give the bench a chamber",
                key=value is None,
            )
        return
    if isinstance(value, tuple):
        _inside(sheet, path, value, name, bench.chamber)
    elif value != 1:
        _range_inside(sheet, name, bench.chamber)


def _inside(sheet: Review, path: Path, temperatures: tuple[float, ...], name: str, chamber: Chamber) -> None:
    low, high = chamber.range
    for index, temperature in enumerate(temperatures):
        if not low <= temperature <= high:
            message = f"{temperature:g} degC is outside the chamber of '{name}', {low:g} .. {high:g} degC"
            sheet.fault("P417", (*path, index), message)


def _range_inside(sheet: Review, name: str, chamber: Chamber) -> None:
    """The range of use, over which points are spread, lies in the chamber; said once for each bench."""
    (low, high), (coldest, hottest) = chamber.range, sheet.spec.plan.temperatures.range
    if not low < high or not sheet.whole("plan", "temperatures") or low <= coldest <= hottest <= high:
        return
    use = f"{coldest:g} .. {hottest:g} degC"
    message = f"{use} reaches outside the chamber of '{name}', {low:g} .. {high:g} degC"
    if not any(fault.message == message for fault in sheet.faults):
        sheet.fault("P418", ("plan", "temperatures", "range"), message)


def _observed(sheet: Review, name: str, test: Test, bench: Bench) -> None:
    """The bench must be able to show what the test calibrates, as its kind says."""
    kind = catalog.benches().get(kind_of(test.bench, bench))
    if kind is None:
        return
    for index, error in enumerate(test.calibrates):
        plain = error in PLAIN_NEEDS and kind.excites >= PLAIN_NEEDS[error]
        if not plain and unit_of(error) is not None and error not in kind.observes:
            path = sheet.item(("tests", name, "calibrates"), index)
            sheet.fault(
                "P419", path, f"a {kind_of(test.bench, bench)} cannot observe {error}; choose another bench"
            )


def _motions(sheet: Review, name: str, test: Test, bench: Bench) -> None:
    if isinstance(test.motions, int):
        return
    for index, motion in enumerate(test.motions):
        path = ("tests", name, "motions", index)
        if sheet.written(path) == {}:
            sheet.fault("P421", path, "an empty motion; write e.g. {position_1: 90 deg}")
        for key, problem in (*_beyond(motion, bench), *_beside(motion, kind_of(test.bench, bench))):
            sheet.fault("P422", (*path, key), f"{problem} of bench '{test.bench}'")


def _beyond(motion: Motion, bench: Bench) -> Iterator[tuple[str, str]]:
    """(key, problem) of everything in a motion that the bench cannot do."""
    for axis in (1, 2):
        for key in (f"position_{axis}", f"rate_{axis}"):
            if getattr(motion, key) is not None and axis > bench.axes:
                yield key, f"there is no axis {axis} among the {bench.axes}"
    limits = bench.limits
    for key in ("rate_1", "rate_2"):
        rate = getattr(motion, key)
        if rate is not None and limits.rate is not None and abs(rate) > limits.rate * (1 + 1e-12):
            yield key, "faster than limits.rate"
    load = motion.acceleration
    if load is not None and limits.acceleration is not None and abs(load) > limits.acceleration * (1 + 1e-12):
        yield "acceleration", "more than limits.acceleration"


def _beside(motion: Motion, kind: str) -> Iterator[tuple[str, str]]:
    """(key, problem) of everything in a motion that this kind of bench does not do at all."""
    excites = getattr(catalog.benches().get(kind), "excites", frozenset({"rate", "acceleration"}))
    for key in ("rate_1", "rate_2"):
        if getattr(motion, key) is not None and "rate" not in excites:
            yield key, "there is no drive, so no rate,"
    if motion.acceleration is not None and "acceleration" not in excites:
        yield "acceleration", "there is no load but gravity, so no acceleration,"
