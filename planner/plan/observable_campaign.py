"""The cheapest campaign → the nearest one that observes what it calibrates, or a refusal with the remedy.

Where the planner chose the visits, the tests that make an error observable are made at its temperatures too;
where that does not help, or hands chose, the plan is refused. `planner check` asks the same before there is
a plan.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from planner.campaign.observability import Unobservable
from planner.errors import InputError
from planner.nouns.choices import Campaign, TestVisits
from planner.nouns.sensor import ErrorName
from planner.plan.by_hand import (
    chosen_by_hand,
    fixed_repeats,
    hand_made_visits,
    in_room,
    is_hand_made,
    temperatures_of,
)
from planner.plan.unobservable_to_remedy import Remedy, also_at, remedy_of
from planner.plan.unobservable_words import (
    degrees,
    fault_of,
    hidden_by_noise,
    hidden_by_references,
    named_once,
)
from planner.plan.visits_to_observability import ENOUGH, Visits, asked_errors, campaign_of, unobservable_in
from planner.protocols import SENSORS
from planner.spec.even_points import even_points
from planner.spec.model import Spec

if TYPE_CHECKING:  # `check` asks without a task, whose modules take 25 ms to import
    from planner.plan.task import Task

LONGER = (4, 16, 64, 256, 1024, 4096, 16_384, 65_536)  # times as long, by which records are tried
Stated = tuple[str, str]  # bench and key of `benches.<bench>.accuracy.<key>`
LOST = 100.0  # times what an error is known to without a calibration: by information nothing tells it then


def refuse_what_no_campaign_observes(spec: Spec) -> None:
    """Raises InputError when no campaign of the spec's tests observes an error that they calibrate.

    Every test at the same temperatures, with the most repeats that the spec allows: if that does
    not observe the errors for any number of temperature points, nothing does. A spec that fixes all by hand
    is asked as it is. Published coefficients stand for all axes together, so no axis can be asked for.

    By information what is promised has every error as the records tell it: of a campaign made by hand only
    what nothing tells is refused, and no motions are asked for where references that err are in the way.
    """
    fault = _unobserved(*_as_asked(spec))
    if fault:
        raise InputError(fault)


def left_open(spec: Spec) -> list[str]:
    """What a campaign made by hand tells no better than it is known uncalibrated: remarks on a plan."""
    found = _unobserved(_with_perfect_references(spec), 1.0)
    return [f"{line} (what is promised counts that)" for line in found.splitlines()]


def not_to_declare(spec: Spec, effects: Collection[str]) -> frozenset[str]:
    """Of some declared effects those that no campaign of the tests tells, or behind which others hide.

    Of the same campaigns that `refuse_what_no_campaign_observes` asks: effects with a budget that their
    records leave unobservable, and effects without a test behind which hides what the tests calibrate; only
    where there are none of either, effects that their own test does not tell.
    """
    told = {ErrorName(e) for test in spec.tests.values() for e in test.calibrates}
    budgeted = (ErrorName(f"{s}.{e}") for s in SENSORS for e in effects if e in getattr(spec.unit, s))
    untested = tuple(error for error in budgeted if error not in told)
    refused = _refused(*_as_asked(spec), untested)
    found = () if refused is None else refused[1]
    idle = {e.effect for u in found for e in (u.error, *u.partners) if e not in told}
    return frozenset(effects) & (idle or {u.error.effect for u in found})


def _as_asked(spec: Spec) -> tuple[Spec, float]:
    """The spec as it is asked, and `of_hands`: by information what no record tells is all that is refused."""
    return (_with_perfect_references(spec), LOST) if spec.planned_by == "information" else (spec, 1.0)


def _unobserved(spec: Spec, of_hands: float) -> str:
    """In words; of_hands: times what is known uncalibrated, to which they must tell an error."""
    refused = _refused(spec, of_hands)
    if refused is None:
        return ""
    return "\n".join(_faults(spec, *refused, largest=not is_hand_made(spec)))


def _refused(
    spec: Spec, of_hands: float, beside: Sequence[ErrorName] = ()
) -> tuple[Visits, tuple[Unobservable, ...]] | None:
    """The visits that leave the fewest errors unobservable, and those errors; None where some leave none.

    beside: further errors to ask for
    """
    if not asked_errors(spec):
        return None
    refused: list[tuple[int, Visits, tuple[Unobservable, ...]]] = []
    by_hand = is_hand_made(spec)
    for visits in [hand_made_visits(spec)] if by_hand else _largest(spec):
        beyond = of_hands if by_hand else 1.0
        found = unobservable_in(spec, visits, largest=not by_hand, beyond=beyond, beside=beside)
        if not found:
            return None
        refused.append((len(found), visits, found))
    _, visits, found = min(refused, key=lambda one: one[0])
    return visits, found


def _stated_accuracies(spec: Spec) -> list[Stated]:
    return [
        (bench, key)
        for bench, one in spec.benches.items()
        for key in type(one.accuracy).model_fields
        if getattr(one.accuracy, key) > 0.0
    ]


def _with_perfect(spec: Spec, stated: Sequence[Stated]) -> Spec:
    """The spec as if those references were exact."""
    benches = dict(spec.benches)
    for bench, key in stated:
        accuracy = benches[bench].accuracy.model_copy(update={key: 0.0})
        benches[bench] = benches[bench].model_copy(update={"accuracy": accuracy})
    return spec.model_copy(update={"benches": benches})


def _with_perfect_references(spec: Spec) -> Spec:
    return _with_perfect(spec, _stated_accuracies(spec))


def observable_campaign(task: Task, chosen: Campaign) -> Campaign:
    """The campaign itself where it observes what it calibrates; else with tests at further temperatures.

    What is added is not proved to be the least. More records raise no allowance, so that the requirements
    stay met. Raises InputError, with the remedy, when nothing that may be added helps.
    """
    found = observable(task.spec, chosen.visits)
    if not found.added:
        return chosen
    cost = _cost(task, found.visits)
    return replace(chosen, visits=found.visits, objective=cost, added=found.added)


def _cost(task: Task, visits: Sequence[TestVisits]) -> float:
    """Weighted seconds of one batch's work: every resource is paid for once, as far as it is used most."""
    used = [
        task.tariff.amounts(
            v.test, v.temperatures_degc, np.array([v.repeats]), room=in_room(task.spec, v.test)
        )[0]
        for v in visits
    ]
    return float(np.max(used, axis=0) @ task.tariff.prices)


@dataclass(frozen=True)
class Observable:
    """Visits that observe every error that they calibrate; added: what was added for that, in words."""

    visits: Visits
    added: tuple[str, ...] = ()


def observable(spec: Spec, visits: Visits) -> Observable:
    """The visits themselves, or the nearest ones that observe what they calibrate.

    Raises InputError, with the remedy, when tests that the planner may move do not help.
    """
    found = unobservable_in(spec, visits)
    if not found:
        return Observable(visits)
    more = visits if is_hand_made(spec) else _extended(spec, visits, found)
    if more == visits or unobservable_in(spec, more):
        raise InputError("\n".join(_faults(spec, visits, found)))
    return Observable(more, tuple(_added(visits, more)))


def _extended(spec: Spec, visits: Visits, found: Sequence[Unobservable]) -> Visits:
    """The visits with those that observe what is found, of tests that may be moved; the fewest repeats."""
    while found:
        remedies = (remedy_of(spec, visits, u) for u in found)
        remedy = next((r for r in remedies if r is not None and _may_be_made(spec, r)), None)
        if remedy is None:
            break
        visits = also_at(spec, visits, remedy.tests, remedy.temperatures)
        found = unobservable_in(spec, visits)
    return visits


def _may_be_made(spec: Spec, remedy: Remedy) -> bool:
    """Whether it is of tests alone, and of such as the planner may move."""
    return bool(remedy.tests) and all(chosen_by_hand(spec, test) is None for test in remedy.tests)


def _faults(
    spec: Spec, visits: Visits, found: Sequence[Unobservable], *, largest: bool = False
) -> Iterator[str]:
    made = campaign_of(spec, visits)
    assert made is not None  # something was found in it
    for error in named_once(found):
        own = [u for u in found if u.error == error]
        if err := _that_err(spec, visits, error, largest):
            yield hidden_by_references(spec, own, err)
            continue
        said = fault_of(spec, made.runs, own, remedy_of(spec, visits, own[0]))
        longer = _longer(spec, visits, error, largest)
        yield said if longer is None else said + hidden_by_noise(error, longer)


def _that_err(spec: Spec, visits: Visits, error: ErrorName, largest: bool) -> list[str]:
    """The stated accuracies behind which an error hides: each alone, or else all; none where it does not."""

    def tells(better: Spec) -> bool:
        return all(u.error != error for u in unobservable_in(better, visits, largest=largest))

    stated = _stated_accuracies(spec)
    if not stated or not tells(_with_perfect(spec, stated)):
        return []
    alone = [one for one in stated if tells(_with_perfect(spec, [one]))]
    return [f"benches.{bench}.accuracy.{key}" for bench, key in alone or stated]


def _longer(spec: Spec, visits: Visits, error: ErrorName, largest: bool) -> int | None:
    """Times as long as they are, records would tell an error that their noise hides; None: it does not."""
    noise: dict[str, float] = {s: q for s in SENSORS if (q := getattr(spec.unit.noise, s))}
    for times in LONGER if noise else ():
        quiet = spec.unit.noise.model_copy(update={s: q / times**0.5 for s, q in noise.items()})
        unit = spec.unit.model_copy(update={"noise": quiet})
        left = unobservable_in(spec.model_copy(update={"unit": unit}), visits, largest=largest)
        if not any(u.error == error for u in left):
            return times
    return None


def _added(before: Visits, after: Visits) -> Iterator[str]:
    """`faces at -60, 20 degC`, test by test."""
    known = {v.test: set(v.temperatures_degc) for v in before}
    for visit in after:
        new = [t for t in visit.temperatures_degc if t not in known.get(visit.test, set())]
        if new:
            yield f"{visit.test} at {degrees(new)}"


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
