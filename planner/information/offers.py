"""What a campaign may be made of: tests at temperatures, how few and how many repeats, and what they cost.

A campaign is a row of counts (g,) over all kinds of power-on on offer. Installations, soaks and ramps are
paid for once, as in `planner.plan.costs`; every repeat for itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.information.kinds import Kind
from planner.nouns.array import Array
from planner.nouns.choices import TestVisits
from planner.plan.by_hand import chosen_by_hand, fixed_repeats, in_room, temperatures_of
from planner.plan.costs import Resource, Tariff
from planner.spec.model import Spec
from planner.temperature_table import GAP_K

PAID_ONCE = ("records", "room_records")


@dataclass(frozen=True)
class Offer:
    """One test on offer. places: its kinds; least, most: repeats where it is made; fixed: (n,) by hand, in
    the order of places; everywhere: it is made at all its places (chosen by hand) if it is made at all"""

    test: str
    places: NDArray[np.intp]
    least: int
    most: int
    fixed: tuple[int, ...] | None
    everywhere: bool

    @property
    def fewest(self) -> int:
        """Repeats of one visit at least."""
        return self.least if self.fixed is None else min(self.fixed)


@dataclass(frozen=True)
class Offers:
    """Everything on offer. kinds: g of them; once: (g, R) what a kind uses of the resources paid once."""

    spec: Spec
    kinds: tuple[Kind, ...]
    tests: tuple[Offer, ...]
    once: NDArray[np.bool_]
    once_price: Array
    each_price: Array
    resources: tuple[Resource, ...]

    @cached_property
    def wherever(self) -> tuple[NDArray[np.bool_], Array]:
        """(g, W) and (W,): what is paid once, whichever bench it is on, at the least of their prices.

        A soak is needed at a temperature on one bench or another: by these no campaign costs more than it
        does. What may be saved may be saved on all of them.
        """
        names = list(dict.fromkeys(replace(r, bench="") for r in self.resources))
        same = np.array(
            [[replace(r, bench="") == name for name in names] for r in self.resources], dtype=bool
        )
        price = self.once_price[:, None]
        least = np.where(same, price, np.inf).min(axis=0, initial=np.inf)
        saved = np.where(same, np.minimum(price, 0.0), 0.0).sum(axis=0)
        used = self.once.astype(float) @ same.reshape(len(self.resources), len(names)) > 0
        return np.asarray(used), np.asarray(np.where(saved < 0.0, saved, least))

    def cost(self, counts: Array) -> Array:
        """(B,) weighted seconds of one batch's work for counts (B, g)."""
        used = (counts > 0) @ self.once.astype(float) > 0
        return np.asarray(used @ self.once_price + counts @ self.each_price)

    @cached_property
    def degc(self) -> Array:
        """(g,) temperatures."""
        return np.array([k.temperature_degc for k in self.kinds])

    @cached_property
    def soaked(self) -> NDArray[np.bool_]:
        """(g,) whether the temperature is one of a chamber."""
        return np.array([not in_room(self.spec, k.test) for k in self.kinds])

    def visits(self, counts: Array) -> tuple[TestVisits, ...]:
        """The tests of counts (g,), in the order of the spec; tests that are not made are left out."""
        found = []
        for offer in self.tests:
            made = [(self.kinds[k].temperature_degc, int(counts[k])) for k in offer.places if counts[k] > 0]
            if made:
                made.sort()
                found.append(TestVisits(offer.test, tuple(t for t, _ in made), tuple(n for _, n in made)))
        return tuple(found)


def offered(spec: Spec, also: Sequence[float] = ()) -> list[tuple[str, tuple[float, ...]]]:
    """(test, temperatures) on offer: the grid where the planner may choose, else what hands chose."""
    grid = grid_of(spec, also)
    found = []
    for test in spec.tests:
        by_hand = chosen_by_hand(spec, test)
        chosen = grid if by_hand is None else temperatures_of(spec, by_hand)[0]
        found.append((test, tuple(dict.fromkeys(chosen))))
    return found


def grid_of(spec: Spec, also: Sequence[float] = ()) -> tuple[float, ...]:
    """Candidate temperatures: steps from room over the range of use, what hands chose, and both ends.

    Nearer to another than a table can tell apart, a point of the grid is left out.
    """
    choice = spec.plan.temperatures
    low, high = choice.range
    by_hand = [
        t for test in spec.tests for t in _by_hand(spec, test) if low <= t <= high or in_room(spec, test)
    ]
    kept = sorted({*by_hand, *also})
    step = choice.step
    first = int(np.ceil((low - choice.room) / step - 1e-9))
    last = int(np.floor((high - choice.room) / step + 1e-9))
    for t in [round(choice.room + step * i, 6) + 0.0 for i in range(first, last + 1)] + [low, high]:
        if all(abs(t - other) > GAP_K + 1e-6 for other in kept):
            kept.append(float(t))
    return tuple(sorted(t for t in kept if low <= t <= high))


def _by_hand(spec: Spec, test: str) -> tuple[float, ...]:
    chosen = chosen_by_hand(spec, test)
    return () if chosen is None else temperatures_of(spec, chosen)[0]


def offers_of(spec: Spec, kinds: Sequence[Kind], prices: Array | None = None) -> Offers:
    """The kinds of a spec with their prices (or others of the same resources) and what hands fixed."""
    tariff = Tariff(spec, [k.temperature_degc for k in kinds])
    amounts = np.array(
        [
            tariff.amounts(k.test, [k.temperature_degc], np.array([[1]]), room=in_room(spec, k.test))[0]
            for k in kinds
        ]
    )
    each = np.array([r.kind in PAID_ONCE for r in tariff.resources])
    prices = tariff.prices if prices is None else prices
    return Offers(
        spec,
        tuple(kinds),
        tuple(_tests(spec, kinds)),
        amounts[:, ~each] > 0,
        prices[~each],
        amounts[:, each] @ prices[each],
        tuple(r for r in tariff.resources if r.kind not in PAID_ONCE),
    )


def _tests(spec: Spec, kinds: Sequence[Kind]) -> Iterator[Offer]:
    choice = spec.plan.repeats
    for test in spec.tests:
        places = np.array([i for i, k in enumerate(kinds) if k.test == test], dtype=np.intp)
        if not len(places):
            continue
        repeats = fixed_repeats(spec, test)
        fixed = None if repeats is None else tuple(int(n) for n in np.broadcast_to(repeats, len(places)))
        by_hand = chosen_by_hand(spec, test) is not None
        if fixed is not None and not by_hand:
            yield Offer(test, places, fixed[0], fixed[0], None, False)
        else:
            yield Offer(test, places, choice.least, choice.most, fixed, by_hand)
