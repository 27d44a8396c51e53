"""What a chunk of flights found, in a form that adds up in any order of work: sums, counts, lengths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array


@dataclass(frozen=True)
class Tally:
    """Sums over the flights of one chunk, or of many.

    number: of the chunk, for the order; flights: how many
    lengths: (R, F) navigation error of every flight for each requirement, SI; linear: (R, F) the same by the
        linear combination; apart: (R,) sums of |nonlinear − linear|² at the requirement's last instant
    at_instants: (R, 2, M) sums of |d|² and of |d|⁴ at each of the instants at which a requirement holds
    squares: (R, E, 5) sums of squared lengths of what each part of each error adds, at the last instant
    beside: (R, W) the same of what flies beside the errors: noise, initial alignment
    sizes: (E, 5) sums of squares of the parts themselves; largest: (E, 5) their largest moduli
    counts: (E,) how many terms went into sizes; claimed: (E, 2) estimates at their nodes: within the allowed
        half-width, and all
    """

    number: int
    flights: int
    lengths: Array
    linear: Array
    apart: Array
    at_instants: Array
    squares: Array
    beside: Array
    sizes: Array
    largest: Array
    counts: Array
    claimed: Array


def total(tallies: Sequence[Tally]) -> Tally:
    """All chunks as one; added in the order of their numbers, so that sums are the same to the last bit."""
    ordered = sorted(tallies, key=lambda t: t.number)

    def summed(name: str) -> Array:
        value: Array = np.zeros_like(getattr(ordered[0], name))
        for t in ordered:
            value = value + getattr(t, name)
        return value

    return Tally(
        number=0,
        flights=sum(t.flights for t in ordered),
        lengths=np.concatenate([t.lengths for t in ordered], axis=1),
        linear=np.concatenate([t.linear for t in ordered], axis=1),
        apart=summed("apart"),
        at_instants=summed("at_instants"),
        squares=summed("squares"),
        beside=summed("beside"),
        sizes=summed("sizes"),
        largest=np.max([t.largest for t in ordered], axis=0),
        counts=summed("counts"),
        claimed=summed("claimed"),
    )
