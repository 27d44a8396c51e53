"""What a campaign leaves unobservable → what makes it observable: found by trying, not by rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np

from planner.campaign.observability import Unobservable
from planner.nouns.choices import TestVisits
from planner.nouns.sensor import ErrorName
from planner.plan.by_hand import fixed_repeats
from planner.plan.visits_to_observability import (
    ENOUGH,
    Visits,
    asked_errors,
    tests_of_unknown_motions,
    unobservable_in,
)
from planner.spec.model import Spec
from planner.temperature_table import GAP_K


@dataclass(frozen=True)
class Remedy:
    """What makes it observable: tests made at temperatures (degC) where they are not, or effects taken out.

    into: a test that is made there already, which with the motions of the absent one would do as well
    """

    tests: tuple[str, ...] = ()
    temperatures: tuple[float, ...] = ()
    into: str | None = None
    idle: tuple[ErrorName, ...] = ()


def remedy_of(spec: Spec, visits: Visits, u: Unobservable) -> Remedy | None:
    """What makes it observable: an effect taken out, or the fewest tests made at its temperatures too."""
    idle = tuple(p for p in u.partners if p not in asked_errors(spec))
    if idle and not _remains(u, unobservable_in(spec, visits, without=idle)):
        return Remedy(idle=idle)
    everywhere = {t for v in visits for t in v.temperatures_degc}
    nodes = u.nodes_degc or tuple(everywhere)
    there = tuple(sorted(t for t in everywhere if np.abs(np.array(nodes) - t).min() <= GAP_K))
    absent = [
        test for test in _nearest(spec, u) if _may_go(spec, test, there) and not _goes(visits, test, there)
    ]
    for tests in chain.from_iterable(combinations(absent, k) for k in sorted({1, 2, len(absent)} - {0})):
        if not _remains(u, unobservable_in(spec, also_at(spec, visits, tests, there))):
            return Remedy(tests, there, into=_into(spec, visits, tests, there, u))
    return None


def _nearest(spec: Spec, u: Unobservable) -> list[str]:
    """The tests: those first that calibrate the error, then those of what it is mixed up with."""

    def place(test: str) -> int:
        serves = spec.tests[test].calibrates
        return 0 if u.error in serves else 1 if set(serves) & set(u.partners) else 2

    return sorted(spec.tests, key=place)


def _into(
    spec: Spec, visits: Visits, tests: tuple[str, ...], there: Sequence[float], u: Unobservable
) -> str | None:
    """A test made there already which, with the motions of the absent one, makes it observable."""
    if len(tests) > 1:
        return None
    (absent,) = tests
    other = spec.tests[absent]
    for name, test in spec.tests.items():
        if name == absent or test.bench != other.bench or not _goes(visits, name, there):
            continue
        serves = tuple(dict.fromkeys((*test.calibrates, *other.calibrates)))
        merged = test.model_copy(update={"motions": other.motions, "calibrates": serves})
        changed = spec.model_copy(update={"tests": {**spec.tests, name: merged}})
        if not unobservable_in(changed, visits):
            return name
    return None


def _remains(u: Unobservable, found: Sequence[Unobservable]) -> bool:
    """Whether any of it is among what is found."""
    return any((o.error, o.channel) == (u.error, u.channel) and o.term == u.term for o in found)


def _goes(visits: Visits, test: str, there: Sequence[float]) -> bool:
    return any(v.test == test and set(there) <= set(v.temperatures_degc) for v in visits)


def _may_go(spec: Spec, test: str, there: Sequence[float]) -> bool:
    """Whether the test's motions are known and its chamber reaches the temperatures."""
    if test in tests_of_unknown_motions(spec):
        return False
    chamber, room = spec.benches[spec.tests[test].bench].chamber, spec.plan.temperatures.room
    if chamber is None:
        return set(there) <= {room}
    return all(chamber.range[0] <= t <= chamber.range[1] for t in there)


def also_at(spec: Spec, visits: Visits, tests: Sequence[str], there: Sequence[float]) -> Visits:
    """The visits with some tests made at further temperatures, with the fewest repeats."""
    made = {v.test: dict(zip(v.temperatures_degc, v.repeats, strict=True)) for v in visits}
    for test in tests:
        fixed = fixed_repeats(spec, test)
        least = (
            fixed
            if isinstance(fixed, int)
            else min(max(ENOUGH, spec.plan.repeats.least), spec.plan.repeats.most)
        )
        own = made.setdefault(test, {})
        own.update({t: least for t in there if t not in own})
    return tuple(
        TestVisits(test, tuple(sorted(made[test])), tuple(made[test][t] for t in sorted(made[test])))
        for test in spec.tests
        if test in made
    )
