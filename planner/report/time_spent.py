"""Where the hours of a campaign go: sums over its steps by action, test, temperature or bench."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from planner.nouns.step import ACTIONS, Step

PEOPLE = "waiting for people"  # a pause of no test: until a shift begins
HEADINGS = (*ACTIONS[:-1], PEOPLE, ACTIONS[-1])  # waiting before the last: removing
SHARED = "no test (installing, ramps, soaks)"
NO_TEMPERATURE = "none set"
WAITING = "no step"
OVERLAP = "steps in parallel"


@dataclass(frozen=True)
class Spent:
    """Seconds under one heading, how many steps they were, and their share of the campaign."""

    name: str
    seconds: float
    count: int
    share: float


def by_action(steps: Sequence[Step], time_s: float) -> tuple[Spent, ...]:
    """Seconds of every kind of action in the order in which a bench does them; the sum is `time_s`."""
    return _sums(steps, time_s, action_of, _action_order)


def by_test(steps: Sequence[Step], time_s: float) -> tuple[Spent, ...]:
    """Seconds of every test, then of what no test owns; the sum is `time_s`."""
    return _sums(steps, time_s, _test, None)


def by_bench(steps: Sequence[Step], time_s: float) -> tuple[Spent, ...]:
    """Seconds on every bench; the sum is `time_s`."""
    return _sums(steps, time_s, lambda step: step.bench, None)


def by_temperature(steps: Sequence[Step], time_s: float) -> tuple[Spent, ...]:
    """Seconds at (and on the way to) every temperature, coldest first; the sum is `time_s`."""
    return _sums(steps, time_s, _temperature, _temperature_order)


def action_order(names: Iterable[str]) -> list[str]:
    """Actions in the order in which a bench does them, unknown ones last."""
    return sorted(set(names), key=_action_order)


def _sums(
    steps: Sequence[Step],
    time_s: float,
    heading: Callable[[Step], str],
    order: Callable[[str], tuple[float, str]] | None,
) -> tuple[Spent, ...]:
    durations: dict[str, list[float]] = {}
    for step in steps:
        durations.setdefault(heading(step), []).append(step.end_s - step.start_s)
    names = sorted(durations, key=order) if order else sorted(durations, key=(SHARED, PEOPLE).__contains__)
    rows = [_spent(name, durations[name], time_s) for name in names]
    rest = time_s - math.fsum(row.seconds for row in rows)
    if abs(rest) > 1e-6 * max(time_s, 1.0):  # below that it is the rounding of a hundred thousand sums
        rows.append(Spent(WAITING if rest > 0 else OVERLAP, rest, 0, _share(rest, time_s)))
    return tuple(rows)


def _spent(name: str, durations: list[float], time_s: float) -> Spent:
    seconds = math.fsum(durations)
    return Spent(name, seconds, len(durations), _share(seconds, time_s))


def _share(seconds: float, time_s: float) -> float:
    return seconds / time_s if time_s > 0 else 0.0


def action_of(step: Step) -> str:
    """The action; the pauses in which the plan waits for a shift under a name of their own."""
    return PEOPLE if step.action == "pause" and step.test is None else step.action


def _test(step: Step) -> str:
    return step.test or (PEOPLE if action_of(step) == PEOPLE else SHARED)


def _temperature(step: Step) -> str:
    return NO_TEMPERATURE if step.temperature_degc is None else repr(float(step.temperature_degc))


def _temperature_order(name: str) -> tuple[float, str]:
    return (math.inf, name) if name == NO_TEMPERATURE else (float(name), name)


def _action_order(name: str) -> tuple[float, str]:
    return (float(HEADINGS.index(name)) if name in HEADINGS else math.inf, name)
