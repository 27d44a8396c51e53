"""Rules for the benches: kinds that exist, chambers that have a range."""

from __future__ import annotations

from planner import catalog
from planner.spec.model import Bench
from planner.spec.places import did_you_mean
from planner.spec.review import Review


def benches(sheet: Review) -> None:
    """All rules for all benches."""
    for name, bench in sheet.spec.benches.items():
        _kind(sheet, name, bench)
        _chamber(sheet, name, bench)


def kind_of(name: str, bench: Bench) -> str:
    """The kind of a bench: said, or its own name."""
    return bench.kind or name


def _kind(sheet: Review, name: str, bench: Bench) -> None:
    known = catalog.benches()
    if kind_of(name, bench) in known:
        return
    if bench.kind is not None:
        sheet.fault(("benches", name, "kind"), f"unknown kind of bench{did_you_mean(bench.kind, known)}")
    else:
        options = ", ".join(known)
        sheet.warn(
            ("benches", name),
            f"'{name}' is no kind of bench, so what it can observe is not checked and its motions are only "
            f"counted; add 'kind:', one of {options}",
            key=True,
        )


def _chamber(sheet: Review, name: str, bench: Bench) -> None:
    if bench.chamber is None:
        return
    low, high = bench.chamber.range
    if low >= high:
        path = ("benches", name, "chamber", "range")
        sheet.fault(path, f"{low:g} degC is not below {high:g} degC; write [coldest, hottest]")
