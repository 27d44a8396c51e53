"""What the requirements do not need: a calibration at all, a test, an effect that is better known without.

An error that nobody calibrates keeps its systematic size, anywhere within it alike (its standard deviation is
a third's root of it; quantiles are drawn, because no Gaussian tells them), and all of its curve. Where that
is little beside the limits, a campaign without its test is shorter.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain

import numpy as np

from planner import catalog
from planner.campaign.noise import budget_of
from planner.campaign.observability import unobservable
from planner.errors import PlannerError
from planner.information.choose import Found, campaign_found
from planner.information.figures import figure_of
from planner.information.in_flight import Asked
from planner.information.model_of import Flight, bare_promise
from planner.information.told import alike, told
from planner.information.whole_flights import length_of_share
from planner.nouns.array import Array
from planner.nouns.deadline import BESIDE, Deadline
from planner.nouns.sensor import ErrorName
from planner.plan.flight_response import Flying
from planner.plan.visits_to_observability import campaign_of
from planner.protocols import SENSORS
from planner.spec.model import NAVIGATION_ERRORS, Spec
from planner.units import from_si

DRAWS = 20_000
OF_REST = 0.5  # of the time that the plan has left, for what a campaign without a test is


def unneeded(flight: Flight, found: Found) -> Iterator[str]:
    """Remarks on a campaign that could be shorter if less were calibrated."""
    spec = flight.spec
    bare = _left_alone(flight, spec.model_copy(update={"effects": ()}))
    if bare is not None:
        said = ", ".join(
            f"{wanted.error} {from_si(value, unit):.4g} {unit}"
            for wanted, value in zip(spec.requirement, bare, strict=True)
            for unit in (NAVIGATION_ERRORS[wanted.error],)
        )
        yield f"requirement: no calibration is needed: units as they are keep every limit ({said})"
        return
    for visit in found.visits:
        if flight.deadline.over(BESIDE, "what is not needed"):
            return
        yield from _without(flight, found, visit.test)
    if not flight.deadline.over(BESIDE, "what is not needed"):
        yield from _better_known(flight, found)


def _better_known(flight: Flight, found: Found) -> Iterator[str]:
    """Effects that these records tell worse than is known uncalibrated; whether it is shorter without."""
    spec, made = flight.spec, campaign_of(found.offers.spec, found.visits)
    errors = {e: _budgeted(spec, e) for e in spec.effects}
    badly = made and {u.error for u in unobservable(made, [*chain.from_iterable(errors.values())])}
    left = [effect for effect, own in errors.items() if badly and own and badly.issuperset(own)]
    if not left:
        return
    known = catalog.effects()
    kept = tuple(e for e in spec.effects if e not in left and known[e].temperature_of not in left)
    said = f"effects: {', '.join(left)}: told worse by this campaign than known uncalibrated"
    other = replace(
        flight.under(spec.model_copy(update={"effects": kept})),
        deadline=Deadline(OF_REST * flight.deadline.left),
    )
    try:
        cost = campaign_found(other, effort="brief").cost
    except PlannerError:
        cost = np.inf
    if cost < found.cost:
        yield f"{said}; take them out of the spec: {cost / 3600:.2f} h suffice then"
    else:
        yield f"{said}; what is promised counts that"


def _budgeted(spec: Spec, effect: str) -> list[ErrorName]:
    """The errors of an effect of which the spec says how large they are."""
    return [e for s in SENSORS if budget_of(spec.unit, e := ErrorName.of(s, effect)) is not None]


def _without(flight: Flight, found: Found, test: str) -> Iterator[str]:
    """A shorter campaign that leaves the errors uncalibrated which only this test tells."""
    lost = _lost(found, test)
    kept = tuple(e for e in flight.spec.effects if e not in lost)
    if not lost or len(flight.spec.tests) == 1 or len(kept) == len(flight.spec.effects):
        return
    tests = {name: t for name, t in flight.spec.tests.items() if name != test}
    spec = flight.spec.model_copy(update={"effects": kept, "tests": tests})
    other = replace(flight.under(spec), deadline=Deadline(OF_REST * flight.deadline.left))
    if _left_alone(flight, spec, own_only=True) is None:
        return
    try:
        shorter = campaign_found(other)
    except PlannerError:
        return
    if shorter.cost < found.cost:
        yield (
            f"tests.{test}: without it {shorter.cost / 3600:.2f} h suffice, with "
            f"{', '.join(sorted(lost))} left uncalibrated; take the test and these effects out of the spec "
            "to plan so"
        )


def _lost(found: Found, test: str) -> set[str]:
    """Effects that fly and are undetermined without a test, however often all others are made."""
    counts = np.array([[0.0 if k.test == test else 2.0 for k in found.offers.kinds]])
    if not np.any(counts):
        return set()
    promise = found.judge.promise
    flying = {(f.error, f.term, f.channel) for f in promise.flying if f.error not in promise.unbudgeted}
    lost: set[str] = set()
    for group in alike(promise.kinds.channels, promise.kinds.degc):
        known = told(group, counts)
        for i, term in enumerate(group.first.terms):
            if known.undetermined[:, :, known.places[i]].any() and any(
                (c.terms[i].error, c.terms[i].name, c.channel) in flying for c in group.channels
            ):
                lost.add(term.error.effect)
    return lost


def _left_alone(flight: Flight, spec: Spec, *, own_only: bool = False) -> list[float] | None:
    """(requirements,) the largest figures when nothing is calibrated, SI; None where one is beyond its limit.

    own_only: without any curve
    """
    other = flight.under(spec)
    promise = bare_promise(other)
    if own_only:
        promise = replace(promise, families={"": {}}, means={})
    left, _ = promise.left(np.zeros((1, 0)))
    figures = [float(figure_of(a, S).max()) for a, S in zip(promise.asked, left, strict=True)]
    for k, (a, S) in enumerate(zip(promise.asked, left, strict=True)):
        if np.any(figures > flight.limits):  # no draw makes a figure smaller
            return None
        if a.share is not None:
            figures[k] = max(figures[k], _drawn(other, a, S[0]))
    return None if np.any(figures > flight.limits) else figures


def _drawn(flight: Flight, a: Asked, S: Array) -> float:
    """The quantile of |d| with every systematic size drawn evenly, all else as Gaussian; S: (f, S, I, c, c).

    The largest over families and instants.
    """
    assert a.share is not None
    J = a.response.sum(axis=4)  # (S or 1, I, c, F)
    size = np.array([_systematic(flight.spec, f) for f in flight.response.flying])
    rest = S - np.einsum("sicf,f,sidf->sicd", J, size**2 / 3.0, J)
    rng = np.random.default_rng(flight.spec.plan.seed)
    even = rng.uniform(-1.0, 1.0, (DRAWS, len(size))) * size
    normal = rng.normal(size=(DRAWS, S.shape[-1]))
    value, vector = np.linalg.eigh(rest)
    root = vector * np.sqrt(np.maximum(value, 0.0))[..., None, :]
    found = 0.0
    for family in root:
        for i in range(J.shape[1]):
            lengths = np.linalg.norm(
                even @ np.swapaxes(J[:, i], 1, 2) + normal @ np.swapaxes(family[:, i], 1, 2), axis=2
            )
            found = max(found, length_of_share(lengths, a.share, a.weights))
    return found


def _systematic(spec: Spec, f: Flying) -> float:
    """Size before calibration of a term that nothing calibrates."""
    budget = budget_of(spec.unit, f.error)
    return 0.0 if budget is None or f.error.effect in spec.effects else float(budget.systematic_size)
