"""Rules for axes with stops: stops that make sense, and motions that stay between them."""

from __future__ import annotations

from planner.spec.axis_travel import outside, quantity_and_axis, same_attitude
from planner.spec.model import Bench, Test
from planner.spec.motions import motions_of
from planner.spec.review import Review
from planner.units import from_si


def travel(sheet: Review) -> None:
    """All rules for stops."""
    for name, bench in sheet.spec.benches.items():
        for axis, (least, most) in bench.limits.travel.items():
            path = ("benches", name, "limits", "travel", axis)
            if axis > bench.axes and sheet.whole("benches", name, "axes"):
                sheet.fault("P431", path, f"there is no axis {axis} among the {bench.axes}", key=True)
            if least >= most:
                sheet.fault("P432", path, "the first stop is not below the second; write [-95 deg, 95 deg]")
    for name, test in sheet.spec.tests.items():
        bench_of_test = sheet.bench_of(test, "kind", "axes", "limits")
        if bench_of_test is not None and bench_of_test.limits.travel:
            _motions(sheet, name, test, bench_of_test)


def _motions(sheet: Review, name: str, test: Test, bench: Bench) -> None:
    stops = {axis: (from_si(a, "deg"), from_si(b, "deg")) for axis, (a, b) in bench.limits.travel.items()}
    said: set[str] = set()
    for index, motion in enumerate(motions_of(test.bench, bench, test)):
        for key, value in (motion or {}).items():
            problem = _problem(key, value, stops)
            if problem is None or problem in said:
                continue
            said.add(problem)
            if isinstance(test.motions, int):
                sheet.fault(
                    "P433",
                    ("tests", name, "motions"),
                    f"the standard motions of bench '{test.bench}' do not stay between its stops: {problem}; "
                    "list motions that do",
                )
            else:
                place = index * test.different_motions // test.motion_count
                sheet.fault("P434", ("tests", name, "motions", place, key.rpartition("_")[0]), problem)


def _problem(key: str, value: float, stops: dict[int, tuple[float, float]]) -> str | None:
    quantity, axis = quantity_and_axis(key)
    if axis not in stops or stops[axis][0] >= stops[axis][1]:
        return None
    wrong = quantity == "position" and same_attitude(value, stops[axis]) is None
    return outside(value, axis, stops[axis]) if wrong else None
