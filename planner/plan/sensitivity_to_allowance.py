"""Requirements → the sensor errors that they allow: the genetic algorithm's front, corners, exact optimum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.errors import InfeasibleError
from planner.nouns.allowances import AllowedErrors, Corner, GeneticHistory
from planner.nouns.array import Array
from planner.nouns.sensitivities import Constraint
from planner.solvers.convex import EVEN, Corners
from planner.solvers.genetic import GeneticSettings, minimise
from planner.solvers.limit_surface import ROUNDING, LimitSurface, binding
from planner.solvers.linear_combination import combined, shares
from planner.units import from_si

FRONT_POINTS = 200  # as many as a figure and a table can show
_ON_THE_LIMIT = 1e-6  # fitness |S/limit − 1| at which the search for the surface has arrived
# of percentiles while searching, as a share of what the smallest errors leave: 1/500 of the promised gap
_SEARCH_TOLERANCE = 1e-5
_RAYS = 200  # directions in which it is tried which percentiles bind
_RAY_CONTRAST = 4  # power of a uniform number: near the axes most shares of a ray are small
_CANDIDATES = 4000  # points of the archive that the front is chosen from; more cost time and add none


@dataclass(frozen=True)
class _Region:
    """Errors that may vary, as shares x of their range: ε = smallest + x·width, 0 <= x <= 1.

    exact, quick: the surface at full accuracy, and as accurate as the search needs it
    """

    smallest: Array
    width: Array
    exact: LimitSurface
    quick: LimitSurface

    def sizes(self, share: Array) -> Array:
        """(..., E) shares -> sizes in SI."""
        return np.asarray(self.smallest + share * self.width)

    def onto_limit(self, share: Array, surface: LimitSurface) -> Array:
        """Each point moved along its ray from the smallest errors until a limit or a bound stops it."""
        longest = share.max(axis=-1, keepdims=True)
        pattern = share / np.where(longest > 0, longest, 1.0)
        far = surface.reach(self.smallest, pattern * self.width, np.ones(share.shape[:-1]))
        return np.asarray(far[..., None] * pattern)

    def filled(self, share: Array) -> Array:
        """Each point with every error in turn raised as far as the limits let it: then none dominates it."""
        share = share.copy()
        for error in np.flatnonzero(self.width > 0):
            direction = np.eye(len(self.width))[error] * self.width
            room = self.exact.reach(self.sizes(share), direction[None, :], 1.0 - share[:, error])
            share[:, error] += room
        return share


def allowed_errors(
    constraints: Sequence[Constraint],
    errors: Sequence[str],
    units: Mapping[str, str],
    smallest: Mapping[str, float],
    largest: Mapping[str, float],
    settings: GeneticSettings,
    seed: int,
) -> AllowedErrors:
    """The region of error sizes ε, smallest <= ε <= largest (SI), in which every constraint holds.

    The genetic algorithm minimises the published fitness |S − S_required| / S_required (K 3.4.3), S the
    constraint that is used most. Everything that it met is moved onto the limit and thinned to the `front`.
    One run more per corner makes one error (or all evenly) as large as possible; the exact corner and the
    gap stand beside it. Errors of equal bounds are constants. If the largest sizes meet every requirement,
    the front is that one point. The same arguments give the same bytes.
    Raises InfeasibleError, with the errors that bind and the nearest limit, if the smallest do not.
    """
    low = np.array([smallest[error] for error in errors], dtype=float)
    high = np.array([largest[error] for error in errors], dtype=float)
    if not ((low >= 0) & (low <= high) & np.isfinite(high)).all():
        raise ValueError("bounds of the errors must satisfy 0 <= smallest <= largest, all finite")
    tightness = _tightness(constraints, errors, low)
    region = _region(constraints, errors, low, high)
    if region.exact.load(high) <= 1.0 or not (high > low).any():
        front, corners, history = high[None, :], _open_corners(errors, low, high), _no_history()
    else:
        corners = _corners(constraints, errors, region, settings, seed)
        front, history = _front(errors, region, corners, settings, seed)
    return AllowedErrors(
        errors=tuple(errors),
        units={error: units[error] for error in errors},
        smallest=_named(errors, low),
        largest=_named(errors, high),
        front=tuple(tuple(float(size) for size in point) for point in front),
        corners=corners,
        history=history,
        tightness=tightness,
    )


def _region(constraints: Sequence[Constraint], errors: Sequence[str], low: Array, high: Array) -> _Region:
    exact = LimitSurface(constraints, errors)
    tolerance = max(exact.tolerance, _SEARCH_TOLERANCE * (1.0 - float(exact.load(low))))
    quick = LimitSurface(constraints, errors, tolerance)
    region = _Region(low, high - low, exact, quick)
    if sum(constraint.rule == "percentile" for constraint in constraints) <= 1:
        return region
    # a percentile costs a millisecond a generation, so the search knows only those that bind somewhere
    points = region.sizes(region.onto_limit(_rays(len(errors)), quick))
    needed = binding(constraints, errors, points, tolerance)
    return replace(region, quick=LimitSurface(needed, errors, tolerance))


def _rays(errors: int) -> Array:
    """(N, E) directions all over the positive orthant: the axes, the diagonal, and between them."""
    between = np.random.default_rng(errors).random((_RAYS, errors)) ** _RAY_CONTRAST
    return np.concatenate([np.eye(errors), np.ones((1, errors)), between])


def _tightness(constraints: Sequence[Constraint], errors: Sequence[str], low: Array) -> dict[int, float]:
    """Requirement -> largest share of its limit that the smallest errors use; refuses more than 1."""
    used: dict[int, float] = {}
    worst, worst_used = None, 1.0 + ROUNDING
    for constraint in constraints:
        share = float(combined(constraint, errors, low)) / constraint.limit
        used[constraint.requirement] = max(used.get(constraint.requirement, 0.0), share)
        if share > worst_used:
            worst, worst_used = constraint, share
    if worst is not None:
        raise _infeasible(worst, errors, low)
    return used


def _infeasible(constraint: Constraint, errors: Sequence[str], low: Array) -> InfeasibleError:
    """The refusal: what binds, largest first, and the limit that the smallest errors would meet."""
    nearest = float(combined(constraint, errors, low))
    parts = sorted(zip(errors, shares(constraint, errors, low), strict=True), key=lambda part: -part[1])
    binds = [(error, float(part)) for error, part in parts if part > 0]
    largest = ", ".join(f"{error} {part:.0%}" for error, part in binds[:3])
    shown, limit = (from_si(value, constraint.unit) for value in (nearest, constraint.limit))
    return InfeasibleError(
        f"{constraint.error} {limit:.6g} {constraint.unit} cannot be met: with every error at its smallest"
        f" it is {shown:.6g} {constraint.unit} ({constraint.rule}); it is made of {largest}",
        binds=binds,
        nearest_limit=nearest,
    )


def _front(
    errors: Sequence[str], region: _Region, corners: Sequence[Corner], settings: GeneticSettings, seed: int
) -> tuple[Array, GeneticHistory]:
    """Sizes (N, E) on the limit, N <= FRONT_POINTS, in ascending order; and the history of the search."""
    archive: list[Array] = []

    def misfit(share: Array) -> Array:
        return np.asarray(np.abs(region.quick.load(region.sizes(share)) - 1.0))

    result = minimise(
        misfit,
        *_unit_bounds(region),
        settings,
        np.random.default_rng([seed, len(errors)]),
        target=_ON_THE_LIMIT,
        watch=lambda share, _: archive.append(share[:: 1 + len(share) // _CANDIDATES].copy()),
    )
    met = np.unique(np.concatenate([*archive, result.genes]), axis=0)
    candidates = region.onto_limit(met[:: max(1, len(met) // _CANDIDATES)], region.quick)
    ends = np.array([[corner.genetic[error] for error in errors] for corner in corners])
    chosen = _spread(_shares_of(ends, region), candidates, FRONT_POINTS)
    # the quick surface may be overstepped by its tolerance: back along the ray, exactly, then up again
    points = region.filled(region.onto_limit(chosen, region.exact))
    return region.sizes(_undominated(points)), result.history


def _corners(
    constraints: Sequence[Constraint],
    errors: Sequence[str],
    region: _Region,
    settings: GeneticSettings,
    seed: int,
) -> tuple[Corner, ...]:
    """One corner for every error that may vary, and the even one; each by the search and exactly."""
    exact = Corners(constraints, errors, region.smallest, region.smallest + region.width)
    free = [int(j) for j in np.flatnonzero(region.width > 0)]
    found = [_corner(errors, region, exact.error(j), [j], (settings, seed), errors[j]) for j in free]
    return (*found, _corner(errors, region, exact.even(), free, (settings, seed), EVEN))


def _corner(
    errors: Sequence[str],
    region: _Region,
    exact: Array,
    raised: Sequence[int],
    search: tuple[GeneticSettings, int],
    name: str,
) -> Corner:
    """The point on the limit whose smallest share among the `raised` errors is largest."""
    settings, seed = search

    def lowest(share: Array) -> Array:
        return np.asarray(-region.onto_limit(share, region.quick)[:, raised].min(axis=1))

    rng = np.random.default_rng([seed, *raised])
    result = minimise(lowest, *_unit_bounds(region), settings, rng)
    point = region.onto_limit(result.best[None, :], region.exact)[0]
    reached, best = point[raised].min(), _shares_of(exact, region)[raised].min()
    if name != EVEN:  # the gap of an error is that of its size, bounds included
        reached, best = region.sizes(point)[raised[0]], exact[raised[0]]
    gap = float((best - reached) / best) if best > 0 else 0.0
    return Corner(name, _named(errors, region.sizes(point)), _named(errors, exact), max(gap, 0.0))


def _unit_bounds(region: _Region) -> tuple[Array, Array]:
    return np.zeros(len(region.width)), (region.width > 0).astype(float)


def _shares_of(sizes: Array, region: _Region) -> Array:
    width = np.where(region.width > 0, region.width, 1.0)
    return np.asarray(np.where(region.width > 0, (sizes - region.smallest) / width, 0.0))


def _spread(ends: Array, candidates: Array, count: int) -> Array:
    """The ends, then again and again the candidate that is farthest from all chosen, up to `count` points.

    Distances are taken in units of the ends' extent, so that every error spreads over its own range.
    """
    extent = np.where(ends.max(axis=0) > 0, ends.max(axis=0), 1.0)
    scaled, chosen = candidates / extent, list(ends[:count])
    distance = np.full(len(candidates), np.inf)
    for end in ends / extent:
        distance = np.minimum(distance, ((scaled - end) ** 2).sum(axis=1))
    while len(chosen) < count and distance.max(initial=0.0) > 1e-12:  # what is left are copies
        farthest = int(distance.argmax())
        chosen.append(candidates[farthest])
        distance = np.minimum(distance, ((scaled - scaled[farthest]) ** 2).sum(axis=1))
    return np.array(chosen)


def _undominated(points: Array) -> Array:
    """The points that no other one exceeds in every error, each once, in ascending order."""
    points = np.unique(points, axis=0)
    at_least = (points[None, :, :] >= points[:, None, :]).all(axis=2)
    return np.asarray(points[at_least.sum(axis=1) == 1])


def _open_corners(errors: Sequence[str], low: Array, high: Array) -> tuple[Corner, ...]:
    """All corners are the largest point when that is allowed."""
    everything = _named(errors, high)
    names = [error for error, one, other in zip(errors, low, high, strict=True) if other > one]
    return tuple(Corner(name, everything, everything, 0.0) for name in [*names, EVEN])


def _no_history() -> GeneticHistory:
    return GeneticHistory(best=(), mean=(), generations=0, evaluations=0, stopped="converged")


def _named(errors: Sequence[str], sizes: Array) -> dict[str, float]:
    return {error: float(size) for error, size in zip(errors, sizes, strict=True)}
