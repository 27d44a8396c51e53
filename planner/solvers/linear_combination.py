"""How the sizes of independent errors combine into one figure: the sum, the root of squares, or a percentile.

A constraint holds one vector v per term of every error. With sizes ε_j

    worst_case   S = Σ_j w_j ε_j                   w_j = Σ_terms ‖v‖
    rss          S = sqrt(Σ_j w_j² ε_j²)           w_j = sqrt(Σ_terms ‖v‖²)
    percentile   P(‖Σ_j Σ_terms v z ε_j‖ < S) = p  z independent, standard normal

(K eqs 32-34 for the sum.) All three are homogeneous of degree one and grow with every size.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from planner.nouns.array import Array
from planner.nouns.sensitivities import Constraint
from planner.solvers.gaussian_length import percentile


def weights(constraint: Constraint, errors: Sequence[str]) -> Array:
    """(E,) what one unit of each error adds, alone, by the constraint's rule; 0 for an error without vectors.

    For `percentile` it is the root mean square length that one unit adds.
    """
    lengths = [_lengths(constraint, error) for error in errors]
    if constraint.rule == "worst_case":
        return np.array([length.sum() for length in lengths])
    return np.array([np.sqrt((length**2).sum()) for length in lengths])


def combined(constraint: Constraint, errors: Sequence[str], sizes: Array) -> Array:
    """What the constraint limits: sizes (..., E), one per error, in SI -> (...), in SI like the limit."""
    return combination(constraint, errors)(sizes)


def combination(constraint: Constraint, errors: Sequence[str]) -> Callable[[Array], Array]:
    """`combined` with the constraint worked out once, for whoever asks many times."""
    weight = weights(constraint, errors)
    if constraint.rule == "worst_case":
        return lambda sizes: np.asarray(np.asarray(sizes) @ weight)
    if constraint.rule == "rss":
        return lambda sizes: np.sqrt(np.asarray(sizes) ** 2 @ weight**2)
    covariances, probability = covariance_per_unit(constraint, errors), constraint.probability
    return lambda sizes: percentile(np.tensordot(np.asarray(sizes) ** 2, covariances, 1), probability)


def shares(constraint: Constraint, errors: Sequence[str], sizes: Array) -> Array:
    """(E,) each error's part, as fractions that sum to 1: of the sum (worst_case), else of the squares.

    For `percentile` these are the parts of the variance's trace. All are 0 if nothing contributes.
    """
    parts = weights(constraint, errors) * np.asarray(sizes)
    if constraint.rule != "worst_case":
        parts = parts**2
    total = parts.sum()
    return np.asarray(parts / total) if total > 0 else np.zeros(len(errors))


def covariance_per_unit(constraint: Constraint, errors: Sequence[str]) -> Array:
    """(E, k, k) covariance of the vector that one unit of each error adds: Σ_terms v vᵀ."""
    size = next((np.shape(v)[-1] for v in constraint.vectors.values()), 1)
    empty = np.zeros((0, size))
    vectors = [np.atleast_2d(constraint.vectors.get(error, empty)) for error in errors]
    return np.stack([v.T @ v for v in vectors]) if vectors else np.zeros((0, size, size))


def _lengths(constraint: Constraint, error: str) -> Array:
    """(terms,) ‖v‖ of one error's terms."""
    vectors = constraint.vectors.get(error)
    return np.zeros(0) if vectors is None else np.linalg.norm(np.atleast_2d(vectors), axis=-1)
