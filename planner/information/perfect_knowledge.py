"""Whether a campaign at a set of temperatures could keep the promise, if it knew the curves there perfectly.

Whatever a campaign visits, it knows no more of a curve than its exact values at the temperatures visited, and
no linear estimate of the rest is better than the posterior mean (kriging) from these. Where tables are read
by straight lines and every visit makes a node, more can be said: a fit gives back whatever its columns can
make, so it makes of a curve the lines through its values there, however it weighs the records.

Ordinary kriging: Cressie, Statistics for Spatial Data (1993), 3.2; the mean is the coefficient's constant.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from planner.information.curves import about_means
from planner.information.even import even
from planner.information.figures import is_within
from planner.information.in_flight import Asked
from planner.information.model_of import Flight, asked_of
from planner.information.offers import Offers
from planner.information.promise import Promise
from planner.information.smooth import Moments
from planner.information.tables import hats_of, nearest
from planner.nouns.array import Array
from planner.protocols import Sensor
from planner.solvers.length_share import share_by_moments
from planner.temperature_table import GAP_K, LEAST_ROWS

NUGGET = 1e-9  # of the variance: keeps equal rows of smooth curves apart
CLEARLY = 1.0 + 2e-3  # a figure beyond the limit by more is beyond it whatever the quadrature
DRAWN = 1.06  # times the best campaign's quantile by drawn curves over Gaussian; others' came up to 4 % less
SLIGHT = 0.01  # of a limit's square: a curve that could add no more counts as none, which is less still
HALF = 0.5  # of this share of the flights or more a smaller covariance keeps more
ROUGHLY, ROUGH_FROM = 1.08, 0.8  # of a length by moments alone, which is 5 % off at most from this share on
EVEN = 4  # temperatures
FEW = 2  # temperatures of rooms, in which tests may be made or not


@dataclass(frozen=True)
class PerfectKnowledge:
    """The exact requirements, what is on offer, and the model of the promise."""

    flight: Flight
    offers: Offers
    promise: Promise

    @cached_property
    def grid(self) -> Array:
        """(T,) degC that cost a soak."""
        return np.unique(self.offers.degc[self.offers.soaked])

    @cached_property
    def free(self) -> Array:
        """(F,) degC that cost none: of tests in the room."""
        return np.unique(self.offers.degc[~self.offers.soaked])

    def may_do(self, sets: NDArray[np.intp], tightened: Array) -> NDArray[np.bool_]:
        """(B,) whether campaigns at exactly the temperatures of sets (B, K) could keep every requirement.

        sets: places of the grid; tightened: (families, requirements) of the judge
        """
        left, families = np.arange(len(sets)), [*self._moments.values()]
        for i in self._hardest_first:
            for a, factor in zip(self._asked, tightened[i], strict=True):
                if len(left) and (a.share is None or a.share >= HALF):
                    most = a.limit * CLEARLY * (1.0 if a.share is None else DRAWN / factor)
                    left = left[self._within(families[i], a, sets[left], most)]
        good = np.zeros(len(sets), dtype=bool)
        good[left] = True
        return good

    def _within(self, moments: Moments, a: Asked, sets: NDArray[np.intp], most: float) -> NDArray[np.bool_]:
        """(B,) whether at the last instant a requirement could be kept within a length, SI.

        When nothing but the curves between the sets is unknown.
        """
        own, lines = a.own[:, -1, :, -1], list[tuple[Array, Array]]()
        total = np.broadcast_to(own, (len(sets), *own.shape)).copy()
        everywhere = np.broadcast_to(self._place(self.free), (len(sets), len(self.free)))
        points = np.concatenate([self._place(self.grid)[sets], everywhere], axis=1)
        place = self._place(a.temperature_degc)
        for error, moment in moments.items():
            mine = [i for i, f in enumerate(self.flight.response.flying) if f.error.parts == error]
            J = a.response[:, -1][:, :, mine]
            if np.sum(J**2, axis=(1, 2, 3)).max() * moment.max() <= SLIGHT * a.limit**2:
                continue
            J = np.broadcast_to(J, (len(place), *J.shape[1:]))
            if error in self._by_lines:
                lines.append((moment, J))
            else:
                total += _through(J, _kriged(moment, points, place))
        may = np.zeros(len(sets), dtype=bool)
        for which, nodes in self._nodes(sets):
            at, whole = self._place(nodes), total[which]
            hats = hats_of(a.temperature_degc.ravel(), nodes)
            for moment, J in lines:
                whole = whole + _through(J, _lined(moment, at, place, hats))
            near = _worth_a_look(a, whole, most * ROUGHLY)
            may[which[near]] |= is_within(a, whole[near][:, None, :, None], np.array([most]))[:, 0]
        return may

    def _nodes(self, sets: NDArray[np.intp]) -> Iterator[tuple[NDArray[np.intp], Array]]:
        """(b,) which of sets (B, K), and their (b, N) nodes: with each choice of the rooms' temperatures."""
        own = self.grid[sets]
        for count in range(len(self.free) + 1 if self._by_lines else 1):
            for rooms in combinations(self.free, count):
                new = ~(own[:, :, None] == np.array(rooms)).any(axis=(1, 2))
                which = np.flatnonzero(new) if count else np.arange(len(sets))
                if len(which) and own.shape[1] + count > 0:
                    both = np.concatenate([own[which], np.tile(rooms, (len(which), 1))], axis=1)
                    yield which, np.sort(both, axis=1)
        if not own.shape[1] and not self._by_lines:
            yield np.arange(len(sets)), np.tile(self.free, (len(sets), 1))

    @cached_property
    def _by_lines(self) -> frozenset[tuple[Sensor, str]]:
        """Errors whose table has a node at every temperature that a campaign visits, and lines between them.

        A scale factor's table has one only where its input is large, and a ramp has no temperature.
        """
        spec, every = self.flight.spec, np.unique([*self.grid, *self.free])
        ramps = any(t.ramp is not None for t in spec.tests.values())
        apart = np.diff(every).min(initial=np.inf) > GAP_K
        if self.promise.smooth is not None or len(self.free) > FEW or ramps or not apart:
            return frozenset()
        fewest = np.zeros(len(self.offers.kinds))
        for offer in self.offers.tests:
            fewest[offer.places] = offer.fewest
        channels = self.promise.kinds.channels
        rows = [np.diff(np.append(c.starts, len(c.rows))) * fewest for c in channels]
        if min(int(r.min()) for r in rows) < LEAST_ROWS:
            return frozenset()
        terms = [t for c in channels for t in c.terms]
        others = {t.error.parts for t in terms if not t.tabled or t.driven}
        return frozenset({t.error.parts for t in terms} - others)

    @cached_property
    def _hardest_first(self) -> list[int]:
        """Families by what a few even temperatures make of them: what one rules out no other is asked of."""
        limits = np.array([a.limit for a in self.promise.asked])
        figures = self.promise.figures(even(self.offers, EVEN)[None])[0]
        loads = np.nan_to_num(figures / limits, posinf=np.inf).max(axis=1)
        return [int(i) for i in np.argsort(-loads, kind="stable")]

    @cached_property
    def _asked(self) -> tuple[Asked, ...]:
        return asked_of(self.flight, exact=True)

    @cached_property
    def _points(self) -> Array:
        degc = [self.offers.degc, *(a.temperature_degc.ravel() for a in self._asked)]
        return np.unique(np.round(np.concatenate(degc), 6))

    @cached_property
    def _moments(self) -> dict[str, Moments]:
        """family -> covariances at the points: what all units have in common adds to what is left, too."""
        curves = self.flight.unseen.curves  # by which exact figures judge: others are 2 % off
        means = curves.means(self._points)
        return {name: about_means(each, means) for name, each in curves.moments(self._points).items()}

    def _place(self, degc: Array) -> NDArray[np.intp]:
        return nearest(self._points, degc)


def _worth_a_look(a: Asked, whole: Array, most: float) -> NDArray[np.bool_]:
    """(B,) whether a requirement on covariances (B, S, c, c) is worth a closer look."""
    if a.share is None or a.share < ROUGH_FROM:
        return np.ones(len(whole), dtype=bool)
    each = share_by_moments(whole, most)
    return np.asarray((each.min(axis=1) if a.weights is None else each @ a.weights) >= a.share)


def _through(J: Array, left: Array) -> Array:
    """(B, S, c, c) of responses (S, c, a, m) to what is left (B, S, m, m) of a curve on each channel."""
    return np.asarray(np.einsum("bsmn,scam,sdan->bscd", left, J, J, optimize=True))


def _lined(moment: Array, points: NDArray[np.intp], place: NDArray[np.intp], hats: Array) -> Array:
    """(B, S, m, m) covariance of curve − lines at flight points (S, m), through points (B, K).

    hats: (B, S m, K) of the lines
    """
    B, K = points.shape
    S, m = place.shape
    H = hats.reshape(B, S, m, K)
    across = moment[place.ravel()].take(points, axis=1).reshape(S, m, B, K)
    there = moment[points[:, :, None], points[:, None, :]]
    cross = np.einsum("bsmk,snbk->bsmn", H, across)
    lines = (hats @ there).reshape(B, S, m, K)
    at = moment[place[:, :, None], place[:, None, :]]
    return np.asarray(at - cross - np.swapaxes(cross, 2, 3) + np.einsum("bsmk,bsnk->bsmn", lines, H))


def _kriged(moment: Array, points: NDArray[np.intp], place: NDArray[np.intp]) -> Array:
    """(B, S, m, m) covariance of constant + curve at flight points (S, m), known at points (B, K)."""
    B, K = points.shape
    S, m = place.shape
    scale = float(np.trace(moment)) / len(moment)
    if scale <= 0.0:
        return np.zeros((B, S, m, m))
    k, at = moment / scale, place.ravel()
    system = np.zeros((B, K + 1, K + 1))
    system[:, :K, :K] = k[points[:, :, None], points[:, None, :]]
    system[:, range(K), range(K)] += NUGGET
    system[:, :K, K] = system[:, K, :K] = 1.0
    sides = np.ones((B, K + 1, len(at)))
    sides[:, :K] = k[points][:, :, at]
    weights = np.linalg.solve(system, sides).reshape(B, K + 1, S, m)
    sides = sides.reshape(B, K + 1, S, m)
    known = np.einsum("bksm,bksn->bsmn", sides, weights, optimize=True)
    return np.asarray(scale * (k[place[:, :, None], place[:, None, :]] - known))
