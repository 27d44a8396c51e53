"""Whole campaigns on the second simulator with faults drawn at random, and what must hold in each.

Each record is complete exactly once, or void and made again; what is complete was made at the angles, rates
and temperature of the plan for its time; and whenever a run ends, table and chamber were seen safe and are,
or ATTENTION was said.
"""

from __future__ import annotations

import json
import math
import random
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from planner.bench_run.equipment import BenchLines, Equipment
from planner.bench_run.errors import BenchFault
from planner.bench_run.job import Job
from planner.bench_run.runner import execute
from planner.bench_run.safety import Left
from planner.control.orders import orders
from planner.nouns.step import Step
from tests.bench_run.other_bench import Fault, World
from tests.bench_run.rig import opened_journal

KINDS = {  # kind: seconds or sizes to draw from
    "late": (0.5, 9.0),
    "lose": (0.0, 0.0),
    "double": (0.0, 0.0),
    "garble": (0.0, 0.0),
    "freeze": (0.0, 0.0),
    "nan": (0.0, 0.0),
    "jump": (-90.0, 90.0),
    "deaf": (0.0, 0.0),
    "drop": (0.0, 900.0),
    "cut": (0.0, 900.0),
    "suspend": (30.0, 4000.0),
    "disk": (0.0, 0.0),
}
MOST_SESSIONS = 40


@dataclass
class Notebook:
    """A recorder that looks at the true bench: complete records, and those said to be void afterwards."""

    world: World
    job: Job
    complete: Counter[str] = field(default_factory=Counter)
    void: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    powered: bool = False
    began: float = 0.0

    def power(self, on: bool, step: Step, number: int) -> None:
        self.powered = on

    def start(self, step: Step, number: int) -> None:
        assert self.powered, "a record without power"
        self.began = self.world.time.now()

    def stop(self, step: Step, complete: bool) -> None:
        if not complete:
            self.void[step.id] += self.complete[step.id] > self.void[step.id]
            return
        self.complete[step.id] += 1
        self.wrong += [f"{step.id}: {why}" for why in self.judged(step)]

    def lost(self, step: Step, number: int) -> None:
        self.void[step.id] += self.complete[step.id] > self.void[step.id]

    def judged(self, step: Step) -> list[str]:
        """What was not as planned, by the true state of the bench."""
        end, found = self.world.time.now(), []
        if not -1e-6 <= end - self.began - step.seconds <= 10.0 + 0.02 * step.seconds:
            found.append(f"{end - self.began:.1f} s")
        for t in (self.began + share * (end - self.began) for share in (0.0, 0.3, 0.6, 1.0)):
            air = self.world.oven.at(t)
            if abs(air - (step.temperature_degc or 20.0)) > 2.1:
                found.append(f"{air:.1f} degC at {t:.0f} s")
            for order in orders(step.motion, self.job.benches[step.bench]):
                angle, rate = self.world.table.axles[str(order.axis)].at(t)
                off = (
                    math.remainder(angle - order.value, 360.0)
                    if order.mode == "position"
                    else rate - order.value
                )
                if abs(off) > 0.05:
                    found.append(f"axis {order.axis} off by {off:.3g} at {t:.0f} s")
        return found


@dataclass(frozen=True)
class Outcome:
    """One campaign: sessions it took, records void, ends with ATTENTION, and what was wrong with it."""

    sessions: int
    void: int
    attention: int
    wrong: tuple[str, ...]


def drawn(rng: random.Random, lasts_s: float) -> list[Fault]:
    """One to six faults, each for one message, a while, or (of a deaf or silent device) for long."""
    found = []
    for _ in range(rng.randint(1, 6)):
        kind = rng.choice(list(KINDS))
        begin = rng.random() * lasts_s
        long = rng.random() < 0.25 and kind not in ("drop", "cut", "suspend")
        lasts = rng.choice([600.0, 3600.0]) if long else 0.0
        size = rng.uniform(*KINDS[kind])
        chance = rng.choice([0.05, 0.3, 1.0]) if long else 1.0
        found.append(Fault(rng.choice(["table", "chamber"]), kind, begin, begin + lasts, chance, size))
    return found


def campaign(job: Job, folder: Path, seed: int, faults: list[Fault] | None = None) -> Outcome:
    """Run one to its end, session after session; everything that does not hold stands in `wrong`."""
    rng = random.Random(seed)
    found = drawn(rng, job.steps[-1].end_s) if faults is None else faults
    world = World(seed, found, terminal_server=rng.random() < 0.2)
    book, path, wrong, attentions = Notebook(world, job), folder / "run.jsonl", [], 0
    stop_at = rng.random() * job.steps[-1].end_s * 2
    sessions = 0
    while sessions < MOST_SESSIONS:
        sessions += 1
        ends: list[Left] = []
        said: list[str] = []
        done = session(job, world, book, path, ends, said, stop_at)
        attentions += not ends[-1].safe
        wrong += truth(world, ends[-1], said)
        stop_at = math.inf
        if done:
            break
        mended(world)
    else:
        wrong.append("it never came to an end")
    return Outcome(
        sessions,
        sum(book.void.values()) + voids(path),
        attentions,
        (*wrong, *book.wrong, *counted(job, book, path)),
    )


def mended(world: World) -> None:
    """Half an hour later somebody has mended what has to be mended."""
    world.disk_full = False
    world.time.sleep(1800.0)
    world.faults = [f for f in world.faults if f.begin > world.time.now()]


def session(
    job: Job, world: World, book: Notebook, path: Path, ends: list[Left], said: list[str], stop_at: float
) -> bool:
    """One run from where the journal stands; whether it came to the campaign's end."""
    lines = BenchLines(world.table_wire, world.chamber_wire)
    equipment = Equipment(dict.fromkeys(job.used_benches, lines), world.time, recorder=book, patience_s=900.0)
    for wire in (world.table_wire, world.chamber_wire):
        wire.up, wire.waiting, wire.away_until = True, [], -1.0
    journal = opened_journal(job, path, resume=path.exists())
    append = journal.append

    def appended(line: dict) -> None:
        if world.disk_full:
            raise BenchFault("the disk is full")
        append(line)

    def before(step: Step) -> None:
        if world.time.now() > stop_at:
            raise KeyboardInterrupt("somebody pressed Ctrl-C")

    journal.append = appended
    try:
        execute(job, equipment, journal, said.append, before, ends.append)
    except (BenchFault, KeyboardInterrupt):
        return False
    finally:
        journal.close()
    return True


def truth(world: World, left: Left, said: list[str]) -> list[str]:
    """Whether what was said of the end is true."""
    found = []
    rates = {axis: axle.at(world.time.now())[1] for axis, axle in world.table.axles.items()}
    still = all(abs(rate) < 0.05 for rate in rates.values())
    if left.safe and not still:
        found.append(f"said to be at zero rate, but {rates}")
    if left.safe and world.oven.setpoint != world.oven.room:
        found.append(f"said to be going to room, but the setpoint is {world.oven.setpoint}")
    if not left.safe and not any(text.startswith("ATTENTION") for text in said):
        found.append("not safe, and nobody was told")
    return found


def voids(path: Path) -> int:
    return sum('"void"' in line for line in path.read_text().splitlines())


def counted(job: Job, book: Notebook, path: Path) -> list[str]:
    """Every step once in the journal, in order; every record complete once more than it was void."""
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    made = [line["step"] for line in lines if "step" in line]
    found = [] if made == [step.id for step in job.steps] else ["the journal does not tell every step once"]
    records = [step.id for step in job.steps if step.action == "record"]
    return found + [
        f"{id} was complete {book.complete[id]} times and void {book.void[id]} times of these"
        for id in records
        if book.complete[id] - book.void[id] != 1
    ]
