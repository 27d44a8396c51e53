"""kill -9 anywhere in campaigns on a bench that lives on, and what must hold in each.

The bench (`other_bench`, with or without faults) is in this process and the runner in another one, which asks
it over a pipe. When the runner dies the table turns on, the chamber goes on, the unit stays powered, as in a
laboratory; what it had sent before still arrives. Then `--resume` has to find out.
"""

from __future__ import annotations

import os
import random
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from planner.bench_run.job import Job
from planner.bench_run.safety import Left
from tests.bench_run.campaigns import (
    MOST_SESSIONS,
    Notebook,
    counted,
    drawn,
    mended,
    session,
    truth,
    voids,
)
from tests.bench_run.other_bench import World
from tests.bench_run.rig import small_job

MESSAGES = 14_000  # of a calm campaign of the small job, so that kills fall anywhere in it
AIMED = 0.25  # of the kills: at the end of a record, before the journal tells of it
LATER_S = 3e-4  # up to which a kill comes after an answer: while the runner writes its journal, or asks on


@dataclass
class Tally:
    """Over all campaigns: kills, records that were made again, ends with ATTENTION, what did not hold."""

    kills: int = 0
    campaigns: int = 0
    void: int = 0
    attention: int = 0
    wrong: tuple[str, ...] = ()


def campaigns_with_kills(folder: Path, kills: int, seed: int) -> Tally:
    """Campaigns, each with some kills and every other one with faults, until so many runners have died."""
    tally = Tally()
    while tally.kills < kills:
        here = folder / f"campaign{tally.campaigns}"
        here.mkdir()
        rng = random.Random(seed * 1_000_003 + tally.campaigns)
        killed_campaign(small_job(), here, rng, tally, most=min(rng.randint(1, 5), kills - tally.kills))
        tally.campaigns += 1
    return tally


def killed_campaign(job: Job, folder: Path, rng: random.Random, tally: Tally, most: int) -> None:
    """One campaign to its end, with at most so many kills on the way."""
    faults = drawn(rng, job.steps[-1].end_s) if rng.random() < 0.5 else []
    world = World(rng.randrange(2**32), faults, terminal_server=rng.random() < 0.2)
    book, path, wrong = Notebook(world, job), folder / "run.jsonl", list[str]()
    for _ in range(MOST_SESSIONS):
        life = one_life(job, world, book, path, rng, _moment(job, rng) if most else None)
        most, tally.kills = most - life.is_killed, tally.kills + life.is_killed
        if life.is_killed:
            world.time.sleep(rng.choice([1.0, 60.0, 7200.0]))  # until somebody sees it
            world.disk_full = False
            continue
        wrong += life.wrong
        tally.attention += life.left is not None and not life.left.safe
        if life.left is not None:
            wrong += truth(world, life.left, life.said)
        if life.is_done:
            break
        mended(world)
    else:
        wrong.append("it never came to an end")
    tally.void += sum(book.void.values()) + voids(path)
    wrong += [*book.wrong, *counted(job, book, path)]
    tally.wrong += tuple(f"campaign {tally.campaigns}: {what}" for what in wrong)


@dataclass(frozen=True)
class Moment:
    """When a runner is killed: at a message by its number, or at the end of a record by its number."""

    number: int
    of_records: bool = False


def _moment(job: Job, rng: random.Random) -> Moment:
    if rng.random() < AIMED:
        return Moment(rng.randint(1, sum(step.action == "record" for step in job.steps) // 3), True)
    return Moment(rng.randint(1, MESSAGES // rng.randint(1, 4)))


@dataclass
class Life:
    """How a runner ended: killed, or with how it left the bench and what it said of it."""

    is_killed: bool = False
    is_done: bool = False
    left: Left | None = None
    said: tuple[str, ...] = ()
    wrong: tuple[str, ...] = ()


def one_life(
    job: Job, world: World, book: Notebook, path: Path, rng: random.Random, kill: Moment | None
) -> Life:
    """A runner in a process of its own, killed at a moment if it lives so long."""
    for wire in (world.table_wire, world.chamber_wire):
        wire.up, wire.waiting, wire.away_until = True, [], -1.0
    here, there = Pipe()
    child = os.fork()
    if child == 0:
        here.close()
        _live(job, there, path)
    there.close()
    life = Life(wrong=("the runner failed instead of being killed",))
    heard = 0
    of = ("book", "stop") if kill is not None and kill.of_records else ()
    while (asked := _received(here)) is not None:
        if asked[0] == "ended":
            life = Life(False, *asked[1:])
            continue
        heard += asked[: len(of)] == of
        is_now = kill is not None and heard == kill.number and asked[: len(of)] == of
        order = rng.choice(["before", "between", "after"]) if is_now else ""
        if order == "before":
            os.kill(child, signal.SIGKILL)
        answer = _answer({"book": book, "world": world}, *asked)
        if order == "between":
            os.kill(child, signal.SIGKILL)
        _sent(here, answer)
        if order == "after":
            time.sleep(rng.random() * LATER_S)
            os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    return Life(is_killed=True) if os.WIFSIGNALED(status) and not life.is_done else life


def _received(line: Connection) -> Any:
    try:
        return line.recv()
    except (EOFError, ConnectionResetError):
        return None


def _sent(line: Connection, answer: object) -> None:
    with suppress(BrokenPipeError, ConnectionResetError):  # dead: what it left in the pipe is still heard
        line.send(answer)


def _answer(known: dict[str, Any], of: str, attribute: str, *arguments: Any) -> tuple[str, Any]:
    """What a method, or a value, of book or world says; what it raises is an answer too."""
    thing: Any = known
    first, *rest = of.split(".")
    thing = known[first]
    for name in rest:
        thing = getattr(thing, name)
    try:
        found = getattr(thing, attribute)
        return "said", found(*arguments) if callable(found) else found
    except OSError as error:
        return "raised", error


# ---------------------------------------------------------------- in the runner's process


def _live(job: Job, line: Connection, path: Path) -> None:
    code = 1
    try:
        ends: list[Left] = []
        said: list[str] = []
        world: Any = _Far(line, "world")
        book: Any = _Far(line, "book")
        is_done = session(job, world, book, path, ends, said, float("inf"))
        line.send(("ended", is_done, ends[-1], tuple(said), ()))
        code = 0
    finally:
        os._exit(code)


class _Far:
    """Something in the other process; its methods are called there, its parts are far too."""

    speed = 1.0
    _PARTS = ("table_wire", "chamber_wire", "time")

    def __init__(self, line: Connection, name: str) -> None:
        self._line, self._name = line, name

    def __getattr__(self, name: str) -> Any:
        if name in self._PARTS:
            return _Far(self._line, f"{self._name}.{name}")
        if name == "disk_full":
            return self._ask(name)
        return self._method(name)

    def _method(self, name: str) -> Callable[..., Any]:
        return lambda *arguments, **named: self._ask(name, *arguments, *named.values())

    def _ask(self, name: str, *arguments: Any) -> Any:
        self._line.send((self._name, name, *arguments))
        kind, what = self._line.recv()
        if kind == "raised":
            raise what
        return what
