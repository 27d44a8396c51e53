"""Rules for the benches: kinds that exist, chambers that have a range, accuracies that can be."""

from __future__ import annotations

from planner import catalog
from planner.spec.copies import copies
from planner.spec.model import Bench
from planner.spec.motions import motions_of
from planner.spec.places import did_you_mean
from planner.spec.review import Review
from planner.spec.yaml12 import Path

MOST_COPIES = 50  # of a bench
COARSEST = {  # accuracies beyond which it is no reference: rad, relative, K; and in words
    "level": (0.08726646259971647, "5 deg"),
    "mounting": (0.08726646259971647, "5 deg"),
    "rate": (0.1, "10 %"),
    "temperature": (30.0, "30 K"),
}


def benches(sheet: Review) -> None:
    """All rules for all benches."""
    for name, bench in sheet.spec.benches.items():
        _kind(sheet, name, bench)
        _count(sheet, name, bench)
        _chamber(sheet, name, bench)
        _accuracy(sheet, name, bench)


def kind_of(name: str, bench: Bench) -> str:
    """The kind of a bench: said, or its own name."""
    return bench.kind or name


def _kind(sheet: Review, name: str, bench: Bench) -> None:
    known = catalog.benches()
    if kind_of(name, bench) in known or not sheet.whole("benches", name, "kind"):
        return
    if bench.kind is not None:
        sheet.fault(
            "P401", ("benches", name, "kind"), f"unknown kind of bench{did_you_mean(bench.kind, known)}"
        )
    else:
        options = ", ".join(known)
        sheet.warn(
            "P402",
            ("benches", name),
            f"'{name}' is no kind of bench, so what it can observe is not checked and its motions are only "
            f"counted; add 'kind:', one of {options}",
            key=True,
        )


def _count(sheet: Review, name: str, bench: Bench) -> None:
    path: Path = ("benches", name, "count")
    taken = [own for own in copies(name, bench.count)[1:] if own in sheet.spec.benches]
    for own in taken:
        sheet.fault(
            "P406", path, f"names a further bench {own}, which stands in the spec by itself; rename that"
        )
    if bench.count > MOST_COPIES:
        sheet.fault("P407", path, f"must be at most {MOST_COPIES}")
    elif bench.count > 1 and sheet.whole("plan") and sheet.spec.plan.units is None:
        sheet.warn(
            "P408", path, "acts with plan.units only: one load of units is on one bench at a time", key=True
        )


def _chamber(sheet: Review, name: str, bench: Bench) -> None:
    if bench.chamber is None:
        return
    low, high = bench.chamber.range
    if low >= high:
        path = ("benches", name, "chamber", "range")
        sheet.fault("P403", path, f"{low:g} degC is not below {high:g} degC; write [coldest, hottest]")


def _accuracy(sheet: Review, name: str, bench: Bench) -> None:
    path: Path = ("benches", name, "accuracy")
    for key, (most, words) in COARSEST.items():
        if getattr(bench.accuracy, key) > most:
            sheet.fault("P404", (*path, key), f"is more than {words}; such a bench is no reference")
    if bench.accuracy.rate > 0 and sheet.whole("tests") and not _turns(sheet, name, bench):
        sheet.warn("P405", (*path, "rate"), f"nothing on {name} turns, so its rate adds nothing", key=True)


def _turns(sheet: Review, name: str, bench: Bench) -> bool:
    """Whether a test on the bench turns the unit; of a bench whose motions are not known it may."""
    tests = [test for test in sheet.spec.tests.values() if test.bench == name]
    motions = [motion for test in tests for motion in motions_of(name, bench, test)]
    return any(
        motion is None
        or any(value and key.startswith(("rate", "acceleration")) for key, value in motion.items())
        for motion in motions
    )
