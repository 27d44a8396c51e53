"""Everything a campaign will ask of its benches, checked before anything moves."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator

from planner.bench_run.job import BenchFacts, Job
from planner.bench_run.motion import AxisOrder, MotionError, orders
from planner.errors import Fault, InputError
from planner.nouns.plan import Step
from planner.spec.axis_travel import travel_faults

ACTIONS = frozenset(
    {
        "install",
        "ramp",
        "soak",
        "power_on",
        "move",
        "record",
        "power_off",
        "cool_down",
        "pause",
        "remove",
    }
)
MOST_FAULTS = 20
_BATCH = re.compile(r"b\d+/")


def check(job: Job) -> tuple[str, ...]:
    """Notes on what is unusual. Raises InputError with every step that a bench could not do, each once."""
    faults = list(dict.fromkeys(_faults(job)))
    if faults:
        more = f" (the first {MOST_FAULTS} of {len(faults)})" if len(faults) > MOST_FAULTS else ""
        listed = [Fault("plan", 0, 0, path, why) for path, why in faults[:MOST_FAULTS]]
        raise InputError(f"nothing was moved: the bench cannot do this plan{more}", listed)
    return tuple(_notes(job))


def _faults(job: Job) -> Iterator[tuple[str, str]]:
    if not job.steps:
        yield "steps", "the plan has no steps"
    yield from _interleaved(job)
    for name, count in Counter(step.id for step in job.steps).items():
        if count > 1:
            yield name, "two steps have this id"
    said: set[tuple[str, str]] = set()
    for step in job.steps:
        for why in _step_faults(step, job):
            if (step.bench, why) not in said:  # one line a reason: a plan has thousands of steps
                said.add((step.bench, why))
                yield step.id, why
    yield from _travel(job)


def _step_faults(step: Step, job: Job) -> Iterator[str]:
    bench = job.benches.get(step.bench)
    if bench is None:
        yield f"the bench '{step.bench}' is missing from the plan's benches"
        return
    if step.action not in ACTIONS:
        yield f"unknown action '{step.action}'"
    if not (math.isfinite(step.start_s) and 0 <= step.end_s - step.start_s < math.inf):
        yield "it ends before it starts"
    yield from _temperature(step, bench)
    if bench.driven:
        yield from _motion(step, bench)


def _temperature(step: Step, bench: BenchFacts) -> Iterator[str]:
    t, chamber = step.temperature_degc, bench.chamber
    if t is None:
        return
    if chamber is None:
        if t != bench.room_degc:
            yield f"{t:g} degC on a bench without a chamber"
    elif not chamber.coldest_degc <= t <= chamber.hottest_degc:
        yield f"{t:g} degC is outside the chamber's {chamber.coldest_degc:g} … {chamber.hottest_degc:g} degC"


def _motion(step: Step, bench: BenchFacts) -> Iterator[str]:
    try:
        orders(step.motion, bench)
    except MotionError as error:
        yield str(error)


def _interleaved(job: Job) -> Iterator[tuple[str, str]]:
    """One run goes to another bench only when a batch has left the one before: to leave a bench in the middle
    of a visit would warm its chamber, and the unit on it would not be soaked when the run came back.
    """
    left: set[tuple[str, str]] = set()
    now: tuple[str, str] | None = None
    for step in job.steps:
        visit = (step.bench, _batch(step))
        if visit == now:
            continue
        if visit in left:
            benches = " and ".join(f"--bench {name}" for name in job.used_benches)
            yield step.id, f"the benches work at the same time in this plan; start a run for each: {benches}"
            return
        if now is not None:
            left.add(now)
        now = visit


def _batch(step: Step) -> str:
    match = _BATCH.match(step.id)
    return match[0] if match else ""


def _travel(job: Job) -> Iterator[tuple[str, str]]:
    """Axes with stops, followed through the campaign from where they stand to where they turn."""
    for name, bench in job.benches.items():
        steps = [step for step in job.steps if step.bench == name]
        said: set[str] = set()
        for step, why in travel_faults(steps, bench.travel, bench.angular_acceleration_dps2):
            if why not in said:
                said.add(why)
                yield step.id, why


def _notes(job: Job) -> Iterator[str]:
    for name in job.used_benches:
        bench = job.benches[name]
        yield from _rounded(bench, (step for step in job.steps if step.bench == name))
        if not bench.driven:
            yield f"{name} has no drive: the operator puts the unit on every face"
            continue
        missing = [
            what
            for what, limit in (
                ("rate", bench.rate_dps),
                ("angular_acceleration", bench.angular_acceleration_dps2),
            )
            if limit is None
        ]
        if missing:
            yield (
                f"{name}: the plan knows no limit of {' and '.join(missing)}, so the table's own holds; "
                "to be checked beforehand they must stand under limits in the spec"
            )
        yield from _long_moves(bench, (step for step in job.steps if step.bench == name))


def _rounded(bench: BenchFacts, steps: Iterable[Step]) -> Iterator[str]:
    """Temperatures with finer digits than the chamber takes."""
    wanted = {step.temperature_degc for step in steps} - {None} if bench.chamber else set()
    finer = sorted(t for t in wanted if t is not None and abs(t - float(f"{t:.1f}")) > 1e-6)
    if finer:
        yield (
            f"{bench.name}: the chamber takes tenths of a degree, so {len(finer)} of the plan's temperatures "
            f"are rounded, e.g. {finer[0]:g} degC to {finer[0]:.1f}"
        )


def _long_moves(bench: BenchFacts, steps: Iterable[Step]) -> Iterator[str]:
    """Moves that the plan gives less time than the limits ask for: the campaign will take longer."""
    acceleration = bench.angular_acceleration_dps2
    if acceleration is None:
        return
    late, before = 0.0, dict.fromkeys(range(1, bench.axes + 1), AxisOrder(1, "position", 0.0))
    for step in steps:
        if step.action != "move":
            continue
        wanted = orders(step.motion, bench)
        needed = max((_seconds(before[o.axis], o, bench, acceleration) for o in wanted), default=0.0)
        late += max(needed - (step.end_s - step.start_s), 0.0)
        before |= {o.axis: o for o in wanted}
    if late > 0:
        yield f"{bench.name}: moves take {late:.0f} s more than planned at the limits of the table"


def _seconds(old: AxisOrder, new: AxisOrder, bench: BenchFacts, acceleration: float) -> float:
    fastest = bench.rate_dps or math.inf
    start = old.value if old.mode == "rate" else 0.0
    if new.mode == "rate":
        return abs(new.value - start) / acceleration
    way = 180.0 if old.mode == "rate" else abs(math.remainder(new.value - old.value, 360.0))
    if new.axis in bench.travel:
        least, most = bench.travel[new.axis]
        way = most - least if old.mode == "rate" else abs(new.value - old.value)
    peak = min(fastest, math.sqrt(way * acceleration))
    return abs(start) / acceleration + (way / peak + peak / acceleration if peak else 0.0)
