"""What a spec fixes by hand: temperatures and repeats of tests, in the test itself or under `plan.fixed`."""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Placement
from planner.nouns.choices import TestVisits
from planner.spec.even_points import even_points
from planner.spec.model import Spec
from planner.spec.plan_choice import FixedTest

Temperatures = str | int | tuple[float, ...] | None


def temperatures_of(spec: Spec, chosen: Temperatures) -> tuple[tuple[float, ...], Placement]:
    """The temperatures that a spec fixes by a word, a number or a list; evenly spread for a number."""
    if chosen is None or isinstance(chosen, str):
        return (spec.plan.temperatures.room,), "room"
    if isinstance(chosen, int):
        return even_points(*spec.plan.temperatures.range, chosen), "fixed"
    return tuple(chosen), "fixed"


def chosen_by_hand(spec: Spec, test: str) -> Temperatures:
    """What the spec fixes about the temperatures of a test: `room`, a number, a list, or nothing."""
    fixed = spec.plan.fixed.get(test, FixedTest()).temperatures
    chosen = fixed if fixed is not None else spec.tests[test].temperatures
    if chosen is None and spec.benches[spec.tests[test].bench].chamber is None:
        return "room"
    return chosen


def fixed_repeats(spec: Spec, test: str) -> int | tuple[int, ...] | None:
    """The repeats that the spec fixes for a test, or None."""
    fixed = spec.plan.fixed.get(test, FixedTest()).repeats
    return fixed if fixed is not None else spec.tests[test].repeats


def is_hand_made(spec: Spec) -> bool:
    """Whether the spec fixes temperatures and repeats of every test, so that there is nothing to choose."""
    return all(_fixed_altogether(spec, test) for test in spec.tests)


def hand_made_visits(spec: Spec) -> tuple[TestVisits, ...]:
    """The tests whose temperatures and repeats the spec fixes."""
    found = []
    for test in spec.tests:
        if _fixed_altogether(spec, test):
            temperatures, _ = temperatures_of(spec, chosen_by_hand(spec, test))
            repeats = np.broadcast_to(np.asarray(fixed_repeats(spec, test)), (len(temperatures),))
            visits = sorted(zip(temperatures, (int(n) for n in repeats), strict=True))
            found.append(TestVisits(test, tuple(t for t, _ in visits), tuple(n for _, n in visits)))
    return tuple(found)


def in_room(spec: Spec, test: str) -> bool:
    """Whether a test is made at room temperature, outside the chamber's cycle."""
    return isinstance(chosen_by_hand(spec, test), str)


def _fixed_altogether(spec: Spec, test: str) -> bool:
    return chosen_by_hand(spec, test) is not None and fixed_repeats(spec, test) is not None
