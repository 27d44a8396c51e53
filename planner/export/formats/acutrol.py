"""Scripts for a rate table with an Acutrol controller, and the setpoints of its chamber.

The controller's language: `:Header argument,argument`, a blank (never a comma) after the header, `ALL` in
commands only, positions absolute, so that a line may be sent twice. Two dialects:

- `host`: the script of a host program (K 3.1): every line with `|delay_ms`; `Power ON`, `Power OFF` switch
  the unit, `Pusk` starts the recording of the step's length.
- `macro`: the controller's own macros: the same commands with `Delay n` in seconds between them; the host
  powers the unit and records by itself. Each file is one message, at most 32 KB, so a long campaign is
  several numbered files.

A wait in the plan is `:Mode:Off ALL`: the axes servoed to zero rate. A move to which the plan gives no time
of its own is sent at the end of the wait before it, ten seconds before the record or what it needs.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from planner.control import words
from planner.control.kinematics import change
from planner.control.limits import by_bench
from planner.control.orders import AxisOrder, orders
from planner.control.words import figure
from planner.errors import InputError
from planner.export._attended import MOVE, PUT, SWITCH, TURN, hand_tasks
from planner.export._checked import checked_plan
from planner.export._scripts import (
    PACE_MS,
    Block,
    Command,
    file_name,
    host_lines,
    macro_lines,
    milliseconds,
)
from planner.export._setpoints import setpoint_text
from planner.export._shifts import start_notes
from planner.export.header import comment_lines
from planner.nouns.bench import BenchFacts
from planner.nouns.plan_file import PlanDocument
from planner.nouns.step import Step
from planner.protocols import Exported, ExportOptions
from planner.spec.axis_travel import reduced

LONGEST_MESSAGE = 32_000  # bytes; the controller takes 32 KB
LEAD_MS = 10_000
UNKNOWN_STOP_MS = 1000  # for an axis to stop when the spec gives no angular acceleration
OFF = Command(words.OFF)
_HOST_WORDS = {"power_on": "Power ON", "power_off": "Power OFF", "record": "Pusk"}


class Acutrol:
    """Table scripts, one a bench, and the chamber's setpoints beside each."""

    name = "acutrol"
    suffix = ".txt"
    dialects = ("host", "macro")

    def files(self, document: Mapping[str, Any], options: ExportOptions) -> Exported:
        """`<bench>.table.txt` (or `<bench>.macro.txt`, numbered when long), `<bench>.setpoints.csv`."""
        plan = checked_plan(document)
        steps = by_bench(plan.steps)
        reasons = {bench: _why_not(plan.benches[bench], steps[bench]) for bench in steps}
        driven = {bench: plan.benches[bench] for bench, reason in reasons.items() if reason is None}
        if not driven:
            raise InputError("\n".join(["no bench of this plan can have a table script", *_missing(reasons)]))
        files: dict[str, str | bytes] = {}
        for bench, facts in driven.items():
            head = list(comment_lines(document, *_about(bench, facts, steps[bench])))
            files |= _script(bench, head, blocks(facts, steps[bench]), options.dialect or self.dialects[0])
        for bench, facts in driven.items():
            if facts.chamber is not None:
                files[f"{file_name(bench)}.setpoints.csv"] = setpoint_text(document, facts, steps[bench])
        return Exported(files, (*_missing(reasons), *_notes(plan, driven, steps)))


def _missing(reasons: Mapping[str, str | None]) -> Iterator[str]:
    return (f"no script for {bench}: {reason}" for bench, reason in reasons.items() if reason)


def _notes(
    plan: PlanDocument, driven: Mapping[str, BenchFacts], steps: Mapping[str, Sequence[Step]]
) -> Iterator[str]:
    yield from _hands(plan, driven)
    yield from _whole_turns(driven, steps)
    yield from start_notes(plan)


def _hands(plan: PlanDocument, benches: Iterable[str]) -> Iterator[str]:
    """Benches where a person must act while the script runs."""
    tasks = hand_tasks(plan)
    turns = Counter(task.bench for task in tasks if task.what in (TURN, PUT))
    others = Counter(task.bench for task in tasks if task.what in (MOVE, SWITCH))
    for bench in benches:
        if turns[bench]:
            yield f"{bench}: a person turns the unit {turns[bench]} times meanwhile; see the operator sheet"
        if others[bench]:
            yield f"{bench}: people attend {others[bench]} power-ons and moves; see the operator sheet"


def _whole_turns(benches: Mapping[str, BenchFacts], steps: Mapping[str, Sequence[Step]]) -> Iterator[str]:
    """Positions beyond one turn: an axis without stops makes no whole turns on its way."""
    for bench, facts in benches.items():
        motions = (motion for step in steps[bench] if (motion := step.motion))
        angles = (v for m in motions for k, v in m.items() if _beyond_one_turn(k, v, facts))
        beyond = next(angles, None)
        if beyond is not None:
            yield (
                f"{bench}: {beyond:g} deg is sent as {figure(reduced(beyond))} deg, the same attitude: a "
                "continuous axis goes the shortest way and makes no whole turns"
            )


def _beyond_one_turn(key: str, value: float, facts: BenchFacts) -> bool:
    return key.startswith("position") and abs(value) > 360.0 and int(key.split("_")[1]) not in facts.travel


def _why_not(bench: BenchFacts, steps: Sequence[Step]) -> str | None:
    """Why a bench gets no script, or None."""
    if not bench.driven:
        return "it has no drive; the operator sheet (--format ics) says what to do by hand"
    if bench.arm_m is None and any("acceleration_g" in (step.motion or {}) for step in steps):
        return "its loads need its arm's length; give 'arm: 1.5 m' in the spec and plan again"
    return None


def _about(bench: str, facts: BenchFacts, steps: Sequence[Step]) -> Iterator[str]:
    yield f"bench: {file_name(bench)}"
    yield f"start_s: {figure(steps[0].start_s)}"
    yield "units: positions deg, rates deg/s, accelerations deg/s^2"
    if facts.rate_dps is None:
        yield "limits: none given in the spec; those of the controller stand"


def _script(bench: str, head: list[str], script: Iterable[Block], dialect: str) -> dict[str, str]:
    name = file_name(bench)
    if dialect == "host":
        return {f"{name}.table.txt": _text([*head, *host_lines(script)])}
    parts = list(_messages(head, macro_lines(script)))
    if len(parts) == 1:
        return {f"{name}.macro.txt": parts[0]}
    return {f"{name}.macro.{i:04d}.txt": part for i, part in enumerate(parts, start=1)}


def _text(lines: Iterable[str]) -> str:
    return "\n".join(lines) + "\n"


def _messages(head: list[str], lines: Iterable[str]) -> Iterator[str]:
    """The lines in as few files as the longest message allows, each with the head. Lines are ASCII."""
    part, size = list(head), sum(len(line) + 1 for line in head)
    first = size
    for line in lines:
        if size + len(line) + 1 > LONGEST_MESSAGE:
            yield _text(part)
            part, size = list(head), first
        part.append(line)
        size += len(line) + 1
    yield _text(part)


def blocks(bench: BenchFacts, steps: Sequence[Step]) -> Iterator[Block]:
    """The bench's steps as blocks: interlocks and limits first, zero rate and `:Mode:Off ALL` last."""
    table = _Table(bench)
    early = list(_moves_after(steps))
    first = Block(tuple(_prologue(bench)), 0)
    now = milliseconds(steps[0].start_s)
    for step, move in zip(steps, early, strict=True):
        for block in (*table.wait(milliseconds(step.start_s) - now), *table.step(step, move)):
            if first.commands and block.host is None:
                block = Block(first.commands + block.commands, block.ms)
            elif first.commands:
                yield first
            first = Block((), 0)
            yield block
        now = milliseconds(step.end_s)
    yield Block((*first.commands, *table.stop(), OFF), 0)


def _prologue(bench: BenchFacts) -> Iterator[Command]:
    return map(Command, (*words.INTERLOCKS, *words.limits(bench)))


def _moves_after(steps: Sequence[Step]) -> Iterator[Mapping[str, float] | None]:
    """For every step the motion of the move that follows it with no time between and none of its own."""
    found: list[Mapping[str, float] | None] = []
    coming: Mapping[str, float] | None = None
    for step in reversed(steps):
        found.append(coming)
        if step.action == "move" and step.end_s == step.start_s:
            coming = dict(step.motion or {}) or None
        elif step.end_s > step.start_s:
            coming = None
    return iter(reversed(found))


class _Table:
    """What the script has made of the table so far: which axes turn, and whether a move was sent early."""

    def __init__(self, bench: BenchFacts) -> None:
        self.bench = bench
        self.turning: dict[int, float] = {}
        self.sent: Mapping[str, float] | None = None

    def step(self, step: Step, move: Mapping[str, float] | None) -> Iterator[Block]:
        """The blocks of one step; `move` is the timeless move that follows it."""
        ms = milliseconds(step.end_s) - milliseconds(step.start_s)
        if step.action == "record":
            if step.motion is None and self.turning:
                yield Block(tuple(self.stop()), 0)
            yield Block((), ms, "Pusk")
        elif step.action == "move":
            yield from self._own_move(dict(step.motion or {}), ms)
        elif step.action not in _HOST_WORDS:
            yield from self.wait(ms, move)
        elif move and ms:
            yield Block((), 0, _HOST_WORDS[step.action])
            yield from self.wait(ms, move)
        else:  # in no time nothing can be stopped: the wait or the move that follows does it
            yield Block(tuple(self.stop()) if ms else (), ms, _HOST_WORDS[step.action])

    def wait(self, ms: int, move: Mapping[str, float] | None = None) -> Iterator[Block]:
        """Zero rate for `ms`, its end given to a move that has no time of its own."""
        lead = min(ms, self._lead(move)) if move else 0
        if ms > lead:
            yield Block((*self.stop(), OFF), ms - lead)
        if move and lead:
            yield self._move(move, lead)
            self.sent = move

    def stop(self) -> list[Command]:
        """Every turning axis back to zero rate, with the time that takes."""
        found = [Command(f":Demand:Rate {axis},0", self._settle(rate)) for axis, rate in self.turning.items()]
        self.turning = {}
        return found

    def _settle(self, rate: float) -> int:
        limit = self.bench.angular_acceleration_dps2
        if limit is None:
            return UNKNOWN_STOP_MS
        return math.ceil(change(rate, 0.0, limit)[0] * 1000) + PACE_MS

    def _own_move(self, motion: Mapping[str, float], ms: int) -> Iterator[Block]:
        """A move where the plan has it, unless it was sent at the end of the wait before.

        An arm stands until it must speed up: somebody may be turning the unit round at its end.
        """
        sent, self.sent = self.sent, None
        if ms and "acceleration_g" in motion:
            yield from self.wait(ms, motion)
            self.sent = None
        elif ms or sent != motion:
            yield self._move(motion, ms)

    def _lead(self, motion: Mapping[str, float]) -> int:
        """How long before a record its motion is sent: ten seconds, or what stopping and speeding up take."""
        rates = [order.value for order in orders(motion, self.bench) if order.mode == "rate"]
        change = [self._settle(rate) for rate in (*self.turning.values(), *rates)]
        return max(LEAD_MS, sum(change) + PACE_MS * 4)

    def _move(self, motion: Mapping[str, float], ms: int) -> Block:
        commands = (*self.stop(), *self._demands(motion))
        return Block(commands or (OFF,), ms)

    def _demands(self, motion: Mapping[str, float]) -> Iterator[Command]:
        """Positions before rates: an axis is tilted first, then another turns."""
        for order in sorted(orders(motion, self.bench), key=_tilting_first):
            if order.mode == "rate":
                self.turning[order.axis] = order.value
            yield from map(Command, words.demand(order))


def _tilting_first(order: AxisOrder) -> tuple[bool, int]:
    return order.mode == "rate", order.axis


FORMAT = Acutrol()
