"""How small and how large every error may be in flight: the bounds of the region of allowed errors.

Sizes are what plan.json calls allowed: the marginal sigma of an error in flight times the quantile z of the
requirements. The smallest are those that the most records at the best temperatures leave; the largest those
of units that nobody calibrates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import NormalDist

import numpy as np

from planner.information.easiest import easiest
from planner.information.exact import quickly
from planner.information.exchange import Judge
from planner.information.in_flight import share_of
from planner.information.model_of import Flight, bare_promise, on_offer
from planner.information.parts import left_in_flight
from planner.information.promise import Promise
from planner.nouns.array import Array
from planner.nouns.sensitivities import Constraint
from planner.spec.model import Requirement, Spec

Sizes = Mapping[str, float]


def quantile_of(wanted: Requirement) -> float:
    """How many sigmas of one error a requirement's figure is: z of its percentile, 1 for rss."""
    share = share_of(wanted)
    return 1.0 if share is None else NormalDist().inv_cdf(0.5 + share / 2.0)


def largest_quantile(spec: Spec) -> float:
    """Of all requirements: what an allowance is in sigmas."""
    return max(quantile_of(wanted) for wanted in spec.requirement)


def extreme_sizes(flight: Flight) -> tuple[Sizes, Sizes]:
    """Error -> the smallest and the largest size that it can have in flight, SI."""
    smallest, bare = _most_accurate(flight), _left_alone(flight)
    return smallest, {error: max(size, smallest[error]) for error, size in bare.items()}


def in_sizes(constraints: Sequence[Constraint], spec: Spec) -> tuple[Constraint, ...]:
    """Constraints on sizes in place of sigmas: homogeneous of degree one, so the limit takes the factor."""
    return tuple(replace(c, limit=largest_quantile(spec) * c.limit) for c in constraints)


def _most_accurate(flight: Flight) -> Sizes:
    offers, promise = on_offer(flight)
    judge = Judge(promise, families=list(promise.families))
    n = easiest(offers, judge.by_family, judge.families)
    return _sizes(flight, promise, n[None])


def _left_alone(flight: Flight) -> Sizes:
    other = flight.under(flight.spec.model_copy(update={"effects": ()}))
    return _sizes(other, bare_promise(other), np.zeros((1, 0)))


def _sizes(flight: Flight, promise: Promise, counts: Array) -> Sizes:
    """By quick figures: the most records are so many that their days do not matter."""
    parts = left_in_flight(flight, quickly(flight, promise, counts), 0).parts
    z = largest_quantile(flight.spec)
    return {str(error): z * float(np.linalg.norm([*own.values()])) for error, own in parts.items()}
