"""Everything a campaign will ask of its benches, checked before anything moves."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from planner.bench_run.job import Job
from planner.control import limits
from planner.control.dialect import ChamberDialect
from planner.control.kinematics import move_s
from planner.control.orders import AxisOrder, orders
from planner.control.words import rounding_note
from planner.errors import Fault, InputError
from planner.nouns.bench import BenchFacts
from planner.nouns.plan_file import MOST_FAULTS
from planner.nouns.step import ACTIONS, Step


def check(job: Job, chambers: Mapping[str, ChamberDialect] | None = None) -> tuple[str, ...]:
    """Notes on what is unusual. Raises InputError with every step that a bench could not do, each once.

    chambers: bench -> what its chamber speaks; left out: it takes tenths of a degree
    """
    faults = list(dict.fromkeys(_faults(job)))
    if faults:
        more = f" (the first {MOST_FAULTS} of {len(faults)})" if len(faults) > MOST_FAULTS else ""
        listed = [Fault("plan", 0, 0, path, why, "P903") for path, why in faults[:MOST_FAULTS]]
        raise InputError(f"nothing was moved: the bench cannot do this plan{more}", listed)
    return tuple(_notes(job, chambers or {}))


def _faults(job: Job) -> Iterator[tuple[str, str]]:
    if not job.steps:
        yield "steps", "the plan has no steps"
    for name, count in Counter(step.id for step in job.steps).items():
        if count > 1:
            yield name, "two steps have this id"
    said: set[tuple[str, str]] = set()
    for step, why in [*_senseless(job.steps), *limits.faults(job.benches, job.steps, arms_known=True)]:
        if (step.bench, why) not in said:  # one line a reason: a plan has thousands of steps
            said.add((step.bench, why))
            yield step.id, why


def _senseless(steps: Iterable[Step]) -> Iterator[limits.Wrong]:
    for step in steps:
        if step.action not in ACTIONS:
            yield step, f"unknown action '{step.action}'"
        if not (math.isfinite(step.start_s) and 0 <= step.seconds < math.inf):
            yield step, "it ends before it starts"


def side_by_side(job: Job) -> bool:
    """Whether benches work at the same time: the plan comes back to a visit that it has left.

    Others are run one after the other; to leave one in the middle of a visit would warm its chamber, and the
    unit on it would not be soaked when the run came back.
    """
    left: set[tuple[str, int | None]] = set()
    now: tuple[str, int | None] | None = None
    for step in job.steps:
        visit = (step.bench, step.batch)
        if visit == now:
            continue
        if visit in left:
            return True
        if now is not None:
            left.add(now)
        now = visit
    return False


def _notes(job: Job, chambers: Mapping[str, ChamberDialect]) -> Iterator[str]:
    for name, steps in limits.by_bench(job.steps).items():
        bench = job.benches[name]
        given = (step.temperature_degc for step in steps if bench.chamber is not None)
        rounded = rounding_note(name, given, chambers.get(name))
        if rounded:
            yield rounded
        if not bench.driven:
            yield f"{name} has no drive: the operator puts the unit on every face"
            continue
        yield from _unlimited(bench)
        yield from _long_moves(bench, steps)


def _unlimited(bench: BenchFacts) -> Iterator[str]:
    given = {"rate": bench.rate_dps, "angular_acceleration": bench.angular_acceleration_dps2}
    missing = [what for what, limit in given.items() if limit is None]
    if missing:
        yield (
            f"{bench.name}: the plan knows no limit of {' and '.join(missing)}, so the table's own holds; "
            "to be checked beforehand they must stand under limits in the spec"
        )


def _long_moves(bench: BenchFacts, steps: Iterable[Step]) -> Iterator[str]:
    """Moves that the plan gives less time than the limits ask for: the campaign will take longer."""
    acceleration = bench.angular_acceleration_dps2
    if acceleration is None:
        return
    late, before = 0.0, {axis: AxisOrder(axis, "position", 0.0) for axis in range(1, bench.axes + 1)}
    for step in steps:
        if step.action != "move":
            continue
        wanted = orders(step.motion, bench)
        needed = max((move_s(before[o.axis], o, bench, acceleration) for o in wanted), default=0.0)
        late += max(needed - step.seconds, 0.0)
        before |= {o.axis: o for o in wanted}
    if late > 0:
        yield f"{bench.name}: moves take {late:.0f} s more than planned at the limits of the table"
