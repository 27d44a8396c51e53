"""The loads of each bench as the plan's steps tell them: every unit once, no more at once than fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from planner.spec.copies import copies
from planner.spec.model import Spec
from planner.verify.findings import Document, Findings
from planner.verify.records import batch_of

CLOCK = 1e-5  # s; times are rounded to the microsecond, several times over


def used_benches(document: Document, spec: Spec) -> list[str]:
    """Benches of the plan's tests, in the order of the spec."""
    used = {test["bench"] for test in document["tests"]}
    return [name for name in spec.benches if name in used]


def loads_by_number(steps: Sequence[Document]) -> dict[int, list[Document]]:
    """Number of a load -> its steps, on one bench."""
    found: dict[int, list[Document]] = {}
    for step in steps:
        found.setdefault(batch_of(step["id"]), []).append(step)
    return found


def steps_on(document: Document, spec: Spec, bench: str) -> list[Document]:
    """The steps on a bench and on the others of its kind."""
    kind = copies(bench, spec.benches[bench].count)
    return [step for step in document["steps"] if step["bench"] in kind]


def loads_of(document: Document, spec: Spec) -> dict[str, list[int]]:
    """Bench -> units of each of its loads as the plan has them; all that fit where it is for no number."""
    found = {}
    for bench in used_benches(document, spec):
        loads = loads_by_number(steps_on(document, spec, bench))
        each = [int(loads[number][0]["units"]) for number in sorted(loads)]
        found[bench] = each if spec.plan.units is not None else [spec.benches[bench].units]
    return found


def taken_by(order: Findings, steps: Sequence[Document], bench: str, free: Mapping[str, float]) -> str:
    """The bench that a load is on, one for all of its steps and free as early as any of its kind."""
    named = dict.fromkeys(str(step["bench"]) for step in steps) or {bench: None}
    on = next(iter(named))
    order.same(f"benches of a load of {bench}", list(named), [on])
    if free[on] > min(free.values()) + CLOCK:
        order.fault(f"a load of {bench}", f"waits for {on}, where another one is free before")
    return on


def check_sizes(order: Findings, spec: Spec, bench: str, sizes: Sequence[int]) -> None:
    """Every unit is on the bench once, no more at once than it takes."""
    if spec.plan.units is not None:
        order.same(f"units on {bench}", sum(sizes), spec.plan.units)
    for number, units in enumerate(sizes, start=1):
        order.at_most(f"load {number} of {bench}, units", units, spec.benches[bench].units)
