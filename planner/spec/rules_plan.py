"""Rules for `plan`: ranges, candidates, repeats, hand-made choices, the genetic algorithm."""

from __future__ import annotations

from collections.abc import Mapping

from planner.spec.model import Test
from planner.spec.narrow_range import narrow_range
from planner.spec.places import did_you_mean
from planner.spec.plan_choice import FixedTest, Objective
from planner.spec.review import Review
from planner.spec.unused_tests import is_unused
from planner.spec.yaml12 import Path

MOST_TEMPERATURES = 240  # to choose from: half a kelvin over the widest range of a chamber

MOST_CANDIDATES = 100  # numbers of points: the published tables have eight


def plan(sheet: Review) -> None:
    """All rules for `plan`."""
    _range(sheet)
    _narrow(sheet)
    _step(sheet)
    _candidates(sheet)
    _repeats(sheet)
    for name, fixed in sheet.spec.plan.fixed.items():
        _fixed(sheet, name, fixed)
    _some_test(sheet)
    _student(sheet)
    genetic = sheet.spec.plan.genetic
    if genetic.best >= genetic.individuals and sheet.whole("plan", "genetic"):  # the children need a place
        message = f"selects {genetic.best} of {genetic.individuals} individuals; write fewer than there are"
        sheet.fault("P501", ("plan", "genetic", "best"), message)
    weights = sheet.spec.plan.minimise
    if isinstance(weights, Objective) and weights.time == weights.power_on == 0:
        sheet.fault(
            "P502", ("plan", "minimise"), "both weights are zero, so every plan would be best; give one"
        )


def _range(sheet: Review) -> None:
    low, high = sheet.spec.plan.temperatures.range
    if low >= high:
        path = ("plan", "temperatures", "range")
        sheet.fault("P503", path, f"{low:g} degC is not below {high:g} degC; write [coldest, hottest]")


def _narrow(sheet: Review) -> None:
    """A residual table belongs to the range of use: over a kelvin or two it was hardly measured."""
    if not sheet.whole("plan", "temperatures") or not sheet.whole("unit"):
        return
    said = narrow_range(sheet.spec)
    if said is not None:
        sheet.warn("P504", ("plan", "temperatures", "range"), said, key=True)


def _step(sheet: Review) -> None:
    choice = sheet.spec.plan.temperatures
    low, high = choice.range
    if not sheet.whole("plan", "temperatures", "range"):
        return
    if (high - low) / choice.step > MOST_TEMPERATURES:
        least = (high - low) / MOST_TEMPERATURES
        sheet.fault(
            "P505",
            ("plan", "temperatures", "step"),
            f"makes {(high - low) / choice.step:.0f} steps of the range, more than {MOST_TEMPERATURES}; "
            f"write {least:.2g} K or more",
        )


def _candidates(sheet: Review) -> None:
    choice = sheet.spec.plan.temperatures
    path: Path = ("plan", "temperatures", "candidates")
    if len(choice.candidates) > MOST_CANDIDATES:
        sheet.fault(
            "P506",
            path,
            f"{len(choice.candidates)} numbers to choose from, more than {MOST_CANDIDATES}; name fewer",
        )
        return
    for index, number in enumerate(choice.candidates):
        if number in choice.candidates[:index]:
            sheet.fault("P507", (*path, index), f"{number} stands here twice; keep one")
    if not sheet.whole("plan", "temperatures") or not sheet.published:
        return
    calibrated = sheet.calibrated()
    for sensor, effect, where, budget in sheet.budgets():
        table = budget.residual_table
        if table is not None and f"{sensor}.{effect}" in calibrated and sheet.whole("unit", sensor, effect):
            given = sheet.written(path) is not None
            _against_table(
                sheet, path if given else (*where, "temperature_residual"), f"{sensor}.{effect}", table
            )


def _against_table(sheet: Review, path: Path, error: str, table: Mapping[int, object]) -> None:
    choice = sheet.spec.plan.temperatures
    if choice.interpolate:
        left = [n for n in choice.candidates if min(table) <= n <= max(table)]
    else:
        left = [n for n in choice.candidates if n in table]
    outside = [str(n) for n in choice.candidates if n not in left]
    numbers = ", ".join(str(n) for n in sorted(table))
    if not left:
        sheet.fault(
            "P508",
            path,
            f"no candidate is in the residual table of {error} ({numbers}); add one of these numbers",
        )
    elif outside:
        between = any(min(table) < n < max(table) and n not in table for n in choice.candidates)
        remedy = (
            "; 'interpolate: true' reads between its numbers" if between and not choice.interpolate else ""
        )
        sheet.warn(
            "P509",
            path,
            f"{', '.join(outside)}: not in the residual table of {error}, so not considered{remedy}",
        )


def _repeats(sheet: Review) -> None:
    repeats = sheet.spec.plan.repeats
    if repeats.least > repeats.most and sheet.whole("plan", "repeats"):
        key = "least" if sheet.written(("plan", "repeats", "least")) is not None else "most"
        sheet.fault(
            "P511", ("plan", "repeats", key), f"least {repeats.least} is more than most {repeats.most}"
        )
    if _student_counts(sheet) and repeats.least < 2:
        sheet.fault(
            "P512",
            ("plan", "repeats", "least"),
            "one repeat has no spread, so Student's t has no quantile; write 2, or 'quantile: normal'",
        )


def _student_counts(sheet: Review) -> bool:
    """Whether repeats are counted by Student's t, which needs two."""
    return sheet.published and sheet.spec.plan.quantile == "student" and sheet.whole("plan", "quantile")


def _fixed(sheet: Review, name: str, fixed: FixedTest) -> None:
    path = ("plan", "fixed", name)
    if name not in sheet.names("tests"):
        if sheet.readable(("tests",)):
            sheet.fault(
                "P513",
                path,
                f"there is no test '{name[:40]}'{did_you_mean(name, sheet.names('tests'))}",
                key=True,
            )
        return
    test = sheet.spec.tests.get(name)
    if test is None:
        return
    if test.repeats is not None and fixed.repeats is not None and fixed.repeats != test.repeats:
        sheet.fault("P514", (*path, "repeats"), f"tests.{name}.repeats says {test.repeats}; keep one")
    _nowhere(sheet, path, test, fixed)
    _repeat_list(sheet, (*path, "repeats"), test, fixed)


def _nowhere(sheet: Review, path: Path, test: Test, fixed: FixedTest) -> None:
    """No temperature and some repeats contradict each other."""
    repeats = fixed.repeats if fixed.repeats is not None else test.repeats
    temperatures = fixed.temperatures if fixed.temperatures is not None else test.temperatures
    some = any(repeats) if isinstance(repeats, tuple) else bool(repeats)
    if temperatures == 0 and some and sheet.whole(*path):
        said = "0 temperatures and some repeats; 'repeats: 0' alone says that the test is not used"
        sheet.fault("P517", path, said, key=True)


def _repeat_list(sheet: Review, path: tuple[str, ...], test: Test, fixed: FixedTest) -> None:
    if not isinstance(fixed.repeats, tuple) or not any(fixed.repeats):
        return
    temperatures = fixed.temperatures if fixed.temperatures is not None else test.temperatures
    if not sheet.whole(*path[:-1], "temperatures") or not sheet.whole("tests", path[2], "temperatures"):
        return
    if temperatures == 0:
        return
    if temperatures is None:
        sheet.fault("P515", path, "repeats for each temperature need 'temperatures' fixed as well")
        return
    count = (
        1 if temperatures == "room" else temperatures if isinstance(temperatures, int) else len(temperatures)
    )
    if len(fixed.repeats) != count:
        sheet.fault(
            "P516",
            path,
            f"{len(fixed.repeats)} repeats for {count} temperatures; give one for each, or one for all",
        )


def _some_test(sheet: Review) -> None:
    """One test at least is used."""
    tests, fixed = sheet.spec.tests, sheet.spec.plan.fixed
    if tests and sheet.whole("tests") and all(is_unused(t, fixed.get(name)) for name, t in tests.items()):
        path: Path = ("plan", "fixed") if fixed else ("tests",)
        sheet.fault(
            "P518",
            path,
            "no test is used: all have 0 repeats, so nothing is measured; give one of them repeats",
            key=True,
        )


def _student(sheet: Review) -> None:
    """A fixed single repeat has no spread either."""
    if not _student_counts(sheet):
        return
    for name, test in sheet.spec.tests.items():
        fixed = sheet.spec.plan.fixed.get(name, FixedTest())
        several = fixed.repeats if isinstance(fixed.repeats, tuple) else (fixed.repeats,)
        places = [
            (("plan", "fixed", name, "repeats"), several),
            (("tests", name, "repeats"), (test.repeats,)),
        ]
        for path, repeats in places:
            if test.calibrates and 1 in repeats:
                message = (
                    "one repeat has no spread, so Student's t has no quantile; give 2, or 'quantile: normal'"
                )
                sheet.fault("P512", path, message)
