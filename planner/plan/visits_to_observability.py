"""Temperatures and repeats of all tests → does the campaign as a whole tell the errors that it calibrates?

The steps of the campaign are asked (planner.campaign.observability), not the tests one by one: what one test
leaves open another may close, if it is made at the same temperatures. Where the planner chose the visits, the
tests that would close it are made there too; where that does not help, or hands chose, the plan is refused,
with the remedy.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np

from planner.campaign.design import design
from planner.campaign.model import Campaign, campaign
from planner.campaign.observability import Untold, untold
from planner.campaign.power_ons import PowerOns, of_design
from planner.errors import InputError
from planner.plan.by_hand import (
    chosen_by_hand,
    even_points,
    fixed_repeats,
    hand_made_visits,
    is_hand_made,
    temperatures_of,
)
from planner.plan.savings import with_plan
from planner.plan.schedule_to_steps import steps
from planner.plan.untold_words import Remedy, fault_of, told_once
from planner.records import Campaign as Chosen
from planner.records import TestVisits
from planner.sensor import ErrorName
from planner.spec.model import Given, Spec
from planner.spec.motions import motions_of
from planner.temperature_table import GAP_K

ENOUGH = 2  # repeats: more of them make nothing observable that two do not
Visits = tuple[TestVisits, ...]


def refuse_what_no_campaign_tells(spec: Spec) -> None:
    """Raises InputError when no campaign of the spec's tests can tell an error that they calibrate.

    Every test at the same temperatures, with the most repeats that the spec allows: if the errors are not
    told by that for any number of temperature points, they are told by nothing. A spec that fixes all by hand
    is asked as it is. Published coefficients stand for all axes together, so no axis can be asked for.
    """
    if not asked_errors(spec):
        return
    refused: list[tuple[int, Visits, tuple[Untold, ...]]] = []
    for visits in [hand_made_visits(spec)] if is_hand_made(spec) else _largest(spec):
        found = untold_by(spec, visits, largest=not is_hand_made(spec))
        if not found:
            return
        refused.append((len(found), visits, found))
    _, visits, found = min(refused, key=lambda one: one[0])
    raise InputError("\n".join(_faults(spec, visits, found)))


@dataclass(frozen=True)
class Observable:
    """Visits that tell every error that they calibrate; added: what was added to tell them, in words."""

    visits: Visits
    added: tuple[str, ...] = ()


def observable(spec: Spec, visits: Visits) -> Observable:
    """The visits themselves, or the nearest ones that tell what they calibrate.

    Raises InputError, with the remedy, when tests that the planner may move do not help.
    """
    found = untold_by(spec, visits)
    if not found:
        return Observable(visits)
    more = visits if is_hand_made(spec) else _extended(spec, visits, found)
    if more == visits or untold_by(spec, more):
        raise InputError("\n".join(_faults(spec, visits, found)))
    return Observable(more, tuple(_added(visits, more)))


def untold_by(
    spec: Spec, visits: Sequence[TestVisits], *, largest: bool = False, without: Sequence[ErrorName] = ()
) -> tuple[Untold, ...]:
    """What a campaign of these visits does not tell of the errors that the spec's tests calibrate.

    largest: with the most repeats that the spec allows in place of those of the visits
    """
    asked = asked_errors(spec)
    made = campaign_of(spec, visits, largest=largest) if asked else None
    if made is None:
        return ()
    unknown = tuple(e for t in _unknown_tests(spec) for e in map(ErrorName, spec.tests[t].calibrates))
    return untold(made, asked, (*without, *(e for e in unknown if e not in asked)))


def asked_errors(spec: Spec) -> tuple[ErrorName, ...]:
    """The errors that tests calibrate by records whose motions are known; none with published coefficients."""
    if isinstance(spec.sensitivities, Given):
        return ()
    unknown = {e for test in _unknown_tests(spec) for e in spec.tests[test].calibrates}
    every = dict.fromkeys(e for test in spec.tests.values() for e in test.calibrates)
    return tuple(ErrorName(e) for e in every if e not in unknown and ErrorName(e).effect in spec.effects)


def _unknown_tests(spec: Spec) -> list[str]:
    """Tests on benches of a kind whose motions nobody knows."""
    return [
        name
        for name, test in spec.tests.items()
        if any(motion is None for motion in motions_of(test.bench, spec.benches[test.bench], test))
    ]


def campaign_of(spec: Spec, visits: Sequence[TestVisits], *, largest: bool = False) -> Campaign | None:
    """The campaign that one unit goes through; None without a record whose motions are known."""
    known = [visit for visit in visits if visit.test not in _unknown_tests(spec)]
    if not any(visit.temperatures_degc for visit in known):
        return None
    alone = with_plan(spec, units=None, shifts=())
    laid = steps(alone, Chosen(tuple(known), (), 0.0, 0.0, False))
    made = design(laid, spec)
    runs = of_design(made)
    if largest:
        tests = {step.id: step.test or "" for step in laid}
        runs = _counted(spec, runs, [tests[str(made.step[start])] for start in runs.starts])
    return campaign(spec, runs)


def _counted(spec: Spec, runs: PowerOns, tests: Sequence[str]) -> PowerOns:
    """Every power-on as often as it stands for: the most repeats where they are free."""
    most = spec.plan.repeats.most / min(ENOUGH, spec.plan.repeats.most)
    return runs.counted(np.array([1.0 if fixed_repeats(spec, t) is not None else most for t in tests]))


# ---------------------------------------------------------------- before there is a plan


def _largest(spec: Spec) -> Iterator[Visits]:
    """All tests at the same temperatures, as far as the spec leaves that free: one campaign a set of them."""
    choice = spec.plan.temperatures
    free = [name for name in spec.tests if chosen_by_hand(spec, name) is None]
    sets = [even_points(*choice.range, n) for n in sorted(set(choice.candidates))] if free else [()]
    by_hand = {name: chosen_by_hand(spec, name) for name in spec.tests if name not in free}
    fixed = [temperatures_of(spec, by)[0] for by in by_hand.values() if by is not None and by != "room"]
    for points in dict.fromkeys((*sets, *fixed)) if free else sets:
        yield tuple(
            _visit(spec, name, points if name in free else temperatures_of(spec, by_hand[name])[0])
            for name in spec.tests
        )


def _visit(spec: Spec, test: str, temperatures: Sequence[float]) -> TestVisits:
    repeats = fixed_repeats(spec, test)
    free = min(ENOUGH, spec.plan.repeats.most)
    each = np.broadcast_to(np.asarray(free if repeats is None else repeats), (len(temperatures),))
    pairs = sorted(zip(temperatures, each.tolist(), strict=True))
    return TestVisits(test, tuple(t for t, _ in pairs), tuple(n for _, n in pairs))


# ---------------------------------------------------------------- what would tell it


def _extended(spec: Spec, visits: Visits, found: Sequence[Untold]) -> Visits:
    """The visits with those that tell what is not told, with the fewest repeats, of tests that may be moved."""
    while found:
        remedies = (_remedy(spec, visits, u) for u in found)
        remedy = next((r for r in remedies if r is not None and _may_be_made(spec, r)), None)
        if remedy is None:
            break
        visits = _also_at(spec, visits, remedy.tests, remedy.temperatures)
        found = untold_by(spec, visits)
    return visits


def _may_be_made(spec: Spec, remedy: Remedy) -> bool:
    """Whether it is of tests alone, and of such as the planner may move."""
    return bool(remedy.tests) and all(chosen_by_hand(spec, test) is None for test in remedy.tests)


def _faults(spec: Spec, visits: Visits, found: Sequence[Untold]) -> Iterator[str]:
    made = campaign_of(spec, visits)
    for error in told_once(found) if made is not None else ():
        own = [u for u in found if u.error == error]
        yield fault_of(spec, made.runs, own, _remedy(spec, visits, own[0]))


def _remedy(spec: Spec, visits: Visits, u: Untold) -> Remedy | None:
    """What would tell it: an effect taken out, or the fewest tests made at its temperatures too."""
    idle = tuple(p for p in u.partners if p not in asked_errors(spec))
    if idle and not _still(u, untold_by(spec, visits, without=idle)):
        return Remedy(idle=idle)
    everywhere = {t for v in visits for t in v.temperatures_degc}
    nodes = u.nodes_degc or tuple(everywhere)
    there = tuple(sorted(t for t in everywhere if np.abs(np.array(nodes) - t).min() <= GAP_K))
    absent = [test for test in _nearest(spec, u) if _may_go(spec, test, there) and not _goes(visits, test, there)]
    for tests in chain.from_iterable(combinations(absent, k) for k in sorted({1, 2, len(absent)} - {0})):
        if not _still(u, untold_by(spec, _also_at(spec, visits, tests, there))):
            return Remedy(tests, there, into=_into(spec, visits, tests, there, u))
    return None


def _nearest(spec: Spec, u: Untold) -> list[str]:
    """The tests: those first that calibrate the error, then those of what it is mixed up with."""
    def place(test: str) -> int:
        serves = spec.tests[test].calibrates
        return 0 if u.error in serves else 1 if set(serves) & set(u.partners) else 2

    return sorted(spec.tests, key=place)


def _into(
    spec: Spec, visits: Visits, tests: tuple[str, ...], there: Sequence[float], u: Untold
) -> str | None:
    """A test that is made there already and would tell it with the motions of the absent one."""
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
        if not untold_by(changed, visits):
            return name
    return None


def _still(u: Untold, found: Sequence[Untold]) -> bool:
    """Whether any of it is among what is found."""
    return any((o.error, o.channel) == (u.error, u.channel) and o.term == u.term for o in found)


def _goes(visits: Visits, test: str, there: Sequence[float]) -> bool:
    return any(v.test == test and set(there) <= set(v.temperatures_degc) for v in visits)


def _may_go(spec: Spec, test: str, there: Sequence[float]) -> bool:
    """Whether the test's motions are known and its chamber reaches the temperatures."""
    if test in _unknown_tests(spec):
        return False
    chamber, room = spec.benches[spec.tests[test].bench].chamber, spec.plan.temperatures.room
    if chamber is None:
        return set(there) <= {room}
    return all(chamber.range[0] <= t <= chamber.range[1] for t in there)


def _also_at(spec: Spec, visits: Visits, tests: Sequence[str], there: Sequence[float]) -> Visits:
    """The visits with some tests made at further temperatures, with the fewest repeats."""
    made = {v.test: dict(zip(v.temperatures_degc, v.repeats, strict=True)) for v in visits}
    for test in tests:
        fixed = fixed_repeats(spec, test)
        least = fixed if isinstance(fixed, int) else min(max(ENOUGH, spec.plan.repeats.least), spec.plan.repeats.most)
        own = made.setdefault(test, {})
        own.update({t: least for t in there if t not in own})
    return tuple(
        TestVisits(test, tuple(sorted(made[test])), tuple(made[test][t] for t in sorted(made[test])))
        for test in spec.tests
        if test in made
    )


def _added(before: Visits, after: Visits) -> Iterator[str]:
    """`faces at -60, 20 degC`, test by test."""
    from planner.plan.untold_words import degrees

    known = {v.test: set(v.temperatures_degc) for v in before}
    for visit in after:
        new = [t for t in visit.temperatures_degc if t not in known.get(visit.test, set())]
        if new:
            yield f"{visit.test} at {degrees(new)}"
