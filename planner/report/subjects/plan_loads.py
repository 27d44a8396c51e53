"""Several loads of units: when each is on which bench, which of them the end waits for, each drawn by itself.

The chain that the end waits for is read from the steps: the load that ends last, before it the load whose end
it began at, on the same bench or on another, and so on to the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import timedelta

from planner.nouns.plan import Plan
from planner.nouns.step import Step
from planner.quantities import DAY_S, week_seconds, week_words
from planner.report.blocks import Items, Picture, Section, Table, section, table
from planner.report.charts import gantt
from planner.report.numbers import counted, hours

AT_ONCE_S = 1.0  # ends and starts so near are one moment
DRAWN = 12  # loads that are drawn by themselves; a page of more would be heavy
SHOWN = 24  # rows on a terminal


@dataclass(frozen=True)
class Load:
    """The steps of one load of units on one bench."""

    number: int
    bench: str
    steps: tuple[Step, ...]

    @property
    def start_s(self) -> float:
        """When it is put on the bench."""
        return min(s.start_s for s in self.steps)

    @property
    def end_s(self) -> float:
        """When the bench is free again."""
        return max(s.end_s for s in self.steps)

    @property
    def units(self) -> int:
        """How many units."""
        return max(s.units for s in self.steps)


def loads_of(steps: Sequence[Step]) -> tuple[Load, ...]:
    """Every load in the order in which they begin; none where the plan has a single batch."""
    found: dict[tuple[str, int], list[Step]] = {}
    for step in steps:
        if step.batch is not None:
            found.setdefault((step.bench, step.batch), []).append(step)
    loads = (Load(number, bench, tuple(own)) for (bench, number), own in found.items())
    return tuple(sorted(loads, key=lambda load: (load.start_s, load.bench)))


def critical_path(loads: Sequence[Load]) -> tuple[Load, ...]:
    """The loads that the end waits for, from the first to the last: each begins when the one before ends."""
    if not loads:
        return ()
    chain = [max(loads, key=lambda load: load.end_s)]
    while True:
        here = chain[-1]
        before = [x for x in loads if abs(x.end_s - here.start_s) <= AT_ONCE_S and x.start_s < here.start_s]
        if not before:
            return tuple(reversed(chain))
        chain.append(max(before, key=lambda load: (load.bench == here.bench, load.end_s)))


def loads(plan: Plan) -> Section | None:
    """When which load is on which bench, and the chain that the end waits for."""
    every = loads_of(plan.steps)
    if len(every) < 2:
        return None
    chain = critical_path(every)
    return section(
        "loads",
        "The loads of units",
        _table(plan, every, chain),
        Items(tuple(_said(plan, chain)), "Critical path, what the end waits for:"),
        *(_drawn(plan, load) for load in every[:DRAWN]),
    )


def _table(plan: Plan, every: Sequence[Load], chain: Sequence[Load]) -> Table | None:
    rows = [
        (
            str(load.number),
            load.bench,
            str(load.units),
            moment(plan, load.start_s),
            moment(plan, load.end_s),
            hours(load.end_s - load.start_s),
            "critical" if load in chain else "",
        )
        for load in every
    ]
    columns = "load | bench | units | from | to | h | the end waits for it"
    return table("When each load is on its bench", columns, rows, most=SHOWN)


def _said(plan: Plan, chain: Sequence[Load]) -> list[str]:
    found = []
    if chain[0].start_s > AT_ONCE_S:
        found.append(f"{hours(chain[0].start_s)} h until people, or other units, are there")
    found += [
        f"load {load.number} on {load.bench}, {counted(load.units, 'unit')}: "
        f"{moment(plan, load.start_s)} to {moment(plan, load.end_s)}, {hours(load.end_s - load.start_s)} h"
        for load in chain
    ]
    return found


def _drawn(plan: Plan, load: Load) -> Picture:
    """One load alone, opened on demand."""
    moved = tuple(
        replace(s, start_s=s.start_s - load.start_s, end_s=s.end_s - load.start_s) for s in load.steps
    )
    alone = replace(plan, steps=moved, time_s=load.end_s - load.start_s, start=None)
    picture = gantt.campaign_picture(alone)
    said = f"Load {load.number} on {load.bench}: {moment(plan, load.start_s)} to {moment(plan, load.end_s)}"
    name = f"load-{load.number}-{load.bench}"
    caption = f"{picture.caption} Time counts from the load's own start."
    return replace(picture, name=name, alt=f"{said}. {picture.alt}", caption=caption, folded=said)


def moment(plan: Plan, seconds: float) -> str:
    """`tue 09:30` (`week 2, tue 09:30`) where the plan has shifts and so a weekday, else `25.50 h`."""
    if plan.start is None:
        return f"{hours(seconds)} h"
    at = week_seconds(plan.start) + seconds
    week, rest = divmod(at, 7 * DAY_S)
    text = week_words(rest)
    if plan.first_day is not None:
        date = plan.first_day + timedelta(days=int(at // DAY_S) - plan.first_day.weekday())
        return f"{date.isoformat()} {text}"
    return f"week {int(week) + 1}, {text}" if week else text
