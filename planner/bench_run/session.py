"""One call of `planner run`: limits, journal, lines, the run itself, and what to say at its end."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace

from planner.bench_run import limits
from planner.bench_run.dry import dry_run
from planner.bench_run.equipment import Dialects, Equipment, Finished, Say
from planner.bench_run.errors import BenchFault, Interrupted
from planner.bench_run.interrupts import stoppable
from planner.bench_run.job import Job
from planner.bench_run.journal import Journal, open_journal, read_past
from planner.bench_run.resources import Request, dialects_of, equipment_of, resources_of
from planner.bench_run.runner import execute
from planner.bench_run.safety import Left
from planner.bench_run.side_by_side import execute_side_by_side
from planner.bench_run.watching import Notifier, Page, Watching
from planner.errors import InputError, PlannerError
from planner.nouns.step import Step

__all__ = ["Request", "rehearse", "run", "travel_from"]


def rehearse(job: Job, request: Request, say: Say) -> None:
    """Check the limits and say what would be sent; nothing is opened or written."""
    dialects = _checked(job, request, say)
    past = read_past(request.journal, job.plan_sha256, _ids(job), _lanes(job))
    for part in [job.on(name) for name in job.used_benches] if limits.side_by_side(job) else [job]:
        own = set(_ids(part))
        entries = tuple(entry for entry in past.entries if entry.step in own)
        dry_run(part, replace(past, entries=entries, begun=()), say, dialects)


def run(
    job: Job,
    request: Request,
    say: Say,
    before: Callable[[Step], None] = lambda step: None,
    line: Callable[[str], None] = lambda text: None,
) -> Finished:
    """Run the campaign, or what is left of it; benches that work at the same time each in a thread.

    line: shows how far the run is, in one line that replaces itself
    Raises InputError before anything moves for a plan that the bench cannot do, a journal that does not fit,
    a bench that cannot be reached; BenchFault and Interrupted later, when everything has been made safe.
    """
    say = undisturbed(say)
    dialects = _checked(job, request, say)
    found = resources_of(job, request, say, apart=limits.side_by_side(job))
    with ExitStack() as stack:
        journal = _journal(job, request)
        stack.callback(journal.close)
        if len(journal.past.entries) == len(job.steps):
            say(f"{request.journal} tells of a finished campaign; nothing is left to do")
            return Finished(0, 0, 0.0)
        stop = stack.enter_context(stoppable())
        watching = _watching(request, line, say)
        equipment = equipment_of(request, found, dialects, stack, stop, watching.event)
        return _reported(job, equipment, journal, say, undisturbed(before), watching)


def _checked(job: Job, request: Request, say: Say) -> Dialects:
    """What the benches speak, when all of them can do the plan; notes are said."""
    dialects = dialects_of(job, request)
    for note in limits.check(job, {name: chamber for name, (_, chamber) in dialects.items()}):
        say(f"note: {note}")
    return dialects


def _journal(job: Job, request: Request) -> Journal:
    return open_journal(
        request.journal,
        job.plan_sha256,
        _ids(job),
        resume=request.resume,
        from_start=request.from_start,
        lanes=_lanes(job),
    )


def _lanes(job: Job) -> Sequence[Sequence[str]]:
    """Steps whose order is their own: those of each bench, where benches work side by side."""
    if not limits.side_by_side(job):
        return [_ids(job)]
    return [_ids(job.on(name)) for name in job.used_benches]


def _watching(request: Request, line: Callable[[str], None], say: Say) -> Watching:
    try:
        command = shlex.split(request.notify or "")
    except ValueError as error:
        raise InputError(f"--notify {request.notify!r} is no command: {error}") from error
    page = None if request.page is None else Page(request.page, f"planner run, {request.journal.parent.name}")
    if page is not None:
        page.write()  # a folder that cannot be written is said before anything moves
    return Watching(page, Notifier(command, say) if command else None, undisturbed(line), say)


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
    watching: Watching,
) -> Finished:
    """The run; whatever stops it is reported with where it stopped and how to go on."""
    at, how = "the start", Left()

    def begins(step: Step) -> None:
        nonlocal at
        at = step.id
        before(step)

    def was_left(left: Left) -> None:
        nonlocal how
        how = left

    run_all = execute_side_by_side if limits.side_by_side(job) else execute
    try:
        done = run_all(job, equipment, journal, say, begins, was_left, watching.watch)
    except (PlannerError, KeyboardInterrupt) as error:
        kind = Interrupted if isinstance(error, KeyboardInterrupt) else BenchFault
        state = str(how) if how.safe else f"NOT everything was made safe: {how}"
        words = (
            f"{str(error) or 'stopped'}. Stopped at {at}, {journal.told} of {len(job.steps)} steps done; "
            f"{state}. Go on with --resume (journal: {journal.path})"
        )
        watching.end("stopped", words)
        raise kind(words) from error
    watching.end("finished", f"all {len(job.steps)} steps are done; {how}")
    return done


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
