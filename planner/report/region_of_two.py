"""The allowed region of two errors while all others stay as planned: a rhombus, an ellipse, or in between."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.plan import Plan
from planner.nouns.sensitivities import Constraint
from planner.solvers.linear_combination import combination

PREFERRED = ("gyro.bias", "accelerometer.bias")
_RAYS = 61  # a quarter turn in 1.5 degree steps: the chord of an ellipse is 1e-4 off, below a line's width
_CLOSEST = 4
_HALVINGS = 40  # 2^-40 of the bracket


@dataclass(frozen=True)
class AllowedRegion:
    """The first quadrant of the region; the other three mirror it, since only sizes count.

    errors: the error across and the error up; boundary: (n, 2) SI, from the x axis to the y axis;
    point: the plan's allowances; requirement: (n,) index of the requirement that bounds each ray
    """

    errors: tuple[str, str]
    boundary: Array
    point: tuple[float, float]
    requirement: NDArray[np.int64]


def axes_of_region(plan: Plan, constraints: Sequence[Constraint]) -> tuple[str, str] | None:
    """The biases if the requirements feel both, else the two errors that the requirements feel most."""
    errors = [a.error for a in plan.allowances if _felt(constraints, a.error)]
    if all(error in errors for error in PREFERRED):
        return PREFERRED
    shares = {e: sum(r.shares.get(e, 0.0) for r in plan.requirements) for e in errors}
    largest = sorted(errors, key=lambda e: -shares[e])[:2]
    return (largest[0], largest[1]) if len(largest) == 2 else None


def allowed_region(
    plan: Plan, constraints: Sequence[Constraint], errors: tuple[str, str]
) -> AllowedRegion | None:
    """Where both errors may lie so that every constraint holds; None if the other errors leave no room.

    Along the ray (cos φ, sin φ), in units of the region's own half-axes, the combination of a constraint
    grows with the radius, so its root is bracketed and halved; the region ends at the nearest root.
    """
    names = [a.error for a in plan.allowances]
    sizes = np.array([a.allowed for a in plan.allowances])
    pair = [names.index(error) for error in errors]
    others = sizes.copy()
    others[pair] = 0.0
    constraints = _closest(constraints, names, sizes, pair)
    axes = np.array([[1.0, 0.0], [0.0, 1.0]])
    ends = [_nearest(constraints, names, others, pair, axes[[i]], sizes[pair[i]])[0][0] for i in (0, 1)]
    if not all(np.isfinite(ends)) or min(ends) <= 0.0:
        return None
    angles = np.linspace(0.0, np.pi / 2, _RAYS)
    owner = _nearest(constraints, names, others, pair, _rays(angles, ends), 1.0)[1]
    rays = _rays(_with_corners(angles, owner), ends)
    radius, owner = _nearest(constraints, names, others, pair, rays, 1.0)
    point = (float(sizes[pair[0]]), float(sizes[pair[1]]))
    requirement = np.array([constraints[i].requirement for i in owner])
    return AllowedRegion(errors, rays * radius[:, None], point, requirement)


def _rays(angles: Array, ends: Sequence[float]) -> Array:
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rays[0], rays[-1] = (1.0, 0.0), (0.0, 1.0)  # cos(π/2) is 6e-17: the corners on the axes are exact
    return np.asarray(rays * np.array(ends))


def _with_corners(angles: Array, owner: NDArray[np.intp]) -> Array:
    """More rays wherever another constraint takes over, so that the corner between them is not cut off."""
    turns = np.flatnonzero(np.diff(owner))
    extra = [np.linspace(angles[i], angles[i + 1], _RAYS) for i in turns]
    return np.unique(np.concatenate([angles, *extra]))


def four_quadrants(boundary: Array) -> Array:
    """(n, 2) of the first quadrant -> the closed outline of all four sign combinations."""
    left = boundary[::-1] * (-1, 1)
    return np.concatenate([boundary, left, boundary * (-1, -1), boundary[::-1] * (1, -1)])


def _nearest(
    constraints: Sequence[Constraint],
    names: Sequence[str],
    others: Array,
    pair: Sequence[int],
    rays: Array,
    guess: float,
) -> tuple[Array, NDArray[np.intp]]:
    """Radius (n,) along each ray at which the first constraint is used up, and the index of that one."""
    radii = np.stack([_radius(c, names, others, pair, rays, guess) for c in constraints])
    return radii.min(axis=0), radii.argmin(axis=0)


def _radius(
    constraint: Constraint,
    names: Sequence[str],
    others: Array,
    pair: Sequence[int],
    rays: Array,
    guess: float,
) -> Array:
    value = combination(constraint, names)

    def excess(radius: Array) -> Array:
        sizes = np.tile(others, (len(radius), 1))
        sizes[:, pair] = rays * radius[:, None]
        return np.asarray(value(sizes) - constraint.limit)

    start, end = excess(np.zeros(len(rays))), excess(np.full(len(rays), guess or 1.0))
    if start[0] > 0.0:
        return np.zeros(len(rays))
    if constraint.rule == "worst_case":  # a straight line: the root is exact
        slope = (end - start) / (guess or 1.0)
        return np.where(slope > 0.0, -start / np.where(slope > 0.0, slope, 1.0), np.inf)
    return _halved(excess, guess or 1.0, len(rays))


def _halved(excess: Callable[[Array], Array], guess: float, count: int) -> Array:
    """Root of a growing function by doubling and halving; infinite where it never turns positive."""
    low, high = np.zeros(count), np.full(count, guess)
    for _ in range(_HALVINGS):
        if (inside := excess(high) <= 0.0).any():
            high = np.where(inside, 2.0 * high, high)
        else:
            break
    else:
        return np.full(count, np.inf)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        outside = excess(middle) > 0.0
        low, high = np.where(outside, low, middle), np.where(outside, middle, high)
    return np.asarray(0.5 * (low + high))


def _closest(
    constraints: Sequence[Constraint], names: Sequence[str], sizes: Array, pair: Sequence[int]
) -> list[Constraint]:
    """The constraints nearest to their limits at the plan and with either error grown tenfold.

    A requirement at any time has one constraint per instant; only a few of them bound the region.
    """
    probes = np.tile(sizes, (3, 1))
    probes[[1, 2], pair] *= 10.0
    used = np.stack([combination(c, names)(probes) / c.limit for c in constraints])
    keep = np.unique(np.argsort(-used, axis=0, kind="stable")[:_CLOSEST])
    return [constraints[i] for i in keep]


def _felt(constraints: Sequence[Constraint], error: str) -> bool:
    return any(np.any(c.vectors.get(error, 0.0)) for c in constraints)
