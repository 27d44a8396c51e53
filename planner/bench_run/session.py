"""One call of `planner run`: limits, journal, lines, the run itself, and what to say at its end."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress

from planner.bench_run import limits
from planner.bench_run.dry import dry_run
from planner.bench_run.equipment import Equipment, Finished, Status
from planner.bench_run.errors import BenchFault, Interrupted
from planner.bench_run.interrupts import stoppable
from planner.bench_run.job import Job
from planner.bench_run.journal import Journal, open_journal, read_past
from planner.bench_run.resources import Request, dialects_of, equipment_of, resources_of
from planner.bench_run.runner import execute
from planner.bench_run.safety import Left
from planner.errors import InputError, PlannerError
from planner.nouns.plan import Step

__all__ = ["Request", "rehearse", "run", "travel_from"]

Say = Callable[[str], None]
Watch = Callable[[Status], None]


def rehearse(job: Job, request: Request, say: Say) -> None:
    """Check the limits and say what would be sent; nothing is opened or written."""
    for note in limits.check(job):
        say(f"note: {note}")
    dry_run(job, read_past(request.journal, job.plan_sha256, _ids(job)), say, dialects_of(job, request))


def run(
    job: Job,
    request: Request,
    say: Say,
    before: Callable[[Step], None] = lambda step: None,
    watch: Watch = lambda status: None,
) -> Finished:
    """Run the campaign, or what is left of it.

    Raises InputError before anything moves for a plan that the bench cannot do, a journal that does not fit,
    a bench that cannot be reached; BenchFault and Interrupted later, when everything has been made safe.
    """
    say = undisturbed(say)
    for note in limits.check(job):
        say(f"note: {note}")
    dialects = dialects_of(job, request)
    found = resources_of(job, request, say, apart=False)
    with ExitStack() as stack:
        journal = open_journal(
            request.journal,
            job.plan_sha256,
            _ids(job),
            resume=request.resume,
            from_start=request.from_start,
        )
        stack.callback(journal.close)
        if len(journal.past.entries) == len(job.steps):
            say(f"{request.journal} tells of a finished campaign; nothing is left to do")
            return Finished(0, 0, 0.0)
        stop = stack.enter_context(stoppable())
        equipment = equipment_of(request, found, dialects, stack, stop, lambda event, words: None)
        return _reported(job, equipment, journal, say, undisturbed(before), undisturbed(watch))


def undisturbed(tell: Callable[..., None]) -> Callable[..., None]:
    """Telling somebody something, whose ear may be closed or full: that changes nothing of a run."""

    def told(*words: object) -> None:
        with suppress(OSError, ValueError):  # of a closed terminal, a full disk, a closed file
            tell(*words)

    return told


def _reported(
    job: Job,
    equipment: Equipment,
    journal: Journal,
    say: Say,
    before: Callable[[Step], None],
    watch: Watch,
) -> Finished:
    """The run; whatever stops it is reported with where it stopped and how to go on."""
    done, at, how = len(journal.past.entries), "the start", Left()

    def count(step: Step) -> None:
        nonlocal done, at
        done, at = done + (at != "the start"), step.id
        before(step)

    def was_left(left: Left) -> None:
        nonlocal how
        how = left

    try:
        return execute(job, equipment, journal, say, count, was_left, watch)
    except (PlannerError, KeyboardInterrupt) as error:
        kind = Interrupted if isinstance(error, KeyboardInterrupt) else BenchFault
        state = str(how) if how.safe else f"NOT everything was made safe: {how}"
        raise kind(
            f"{str(error) or 'stopped'}. Stopped at {at}, {done} of {len(job.steps)} steps done; {state}. "
            f"Go on with --resume (journal: {journal.path})"
        ) from error


def _ids(job: Job) -> Sequence[str]:
    return [step.id for step in job.steps]


def travel_from(texts: Sequence[str]) -> Mapping[int, tuple[float, float]]:
    """`2=-95..95` → {2: (-95, 95)}, the stops of an axis in deg. Raises InputError."""
    found = {}
    for text in texts:
        match = re.fullmatch(r"([1-6])=(-?[\d.]+)\.\.(-?[\d.]+)", text)
        try:
            stops = (float(match[2]), float(match[3])) if match else (0.0, 0.0)
        except ValueError:
            stops = (0.0, 0.0)
        if match is None or stops[0] >= stops[1]:
            raise InputError(f"no stops {text!r}; write AXIS=LEAST..MOST in deg, such as 2=-95..95")
        found[int(match[1])] = stops
    return found
