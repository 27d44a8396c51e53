"""Random constraints that the tests of solvers and allowances share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.nouns.array import Array, Rule
from planner.nouns.sensitivities import Constraint
from planner.solvers.linear_combination import combined

RULES: tuple[Rule, ...] = ("worst_case", "rss", "percentile")


def named(count: int) -> tuple[str, ...]:
    return tuple(f"gyro.effect_{j}" for j in range(count))


def random_constraint(
    rule: Rule,
    errors: int,
    rng: np.random.Generator,
    *,
    index: int = 0,
    components: int = 3,
    limit: float = 1.0,
    percentile: float = 0.95,
) -> Constraint:
    """Vectors whose lengths differ by two decades from error to error, one to three terms each."""
    vectors = {
        name: rng.normal(size=(rng.integers(1, 4), components)) * 10 ** rng.uniform(-1, 1)
        for name in named(errors)
    }
    probability = percentile if rule == "percentile" else None
    return Constraint(index, "position", "m", rule, limit, 60.0, vectors, probability)


def binding_case(
    rule: Rule, errors: int, requirements: int, seed: int
) -> tuple[list[Constraint], Array, Array]:
    """Constraints met by the lower bounds and not by the upper ones; bounds over four decades."""
    rng = np.random.default_rng(seed)
    upper = 10 ** rng.uniform(-4, 0, errors)
    lower = upper * rng.uniform(0.0, 0.1, errors)
    constraints = []
    for index in range(requirements):
        drawn = random_constraint(rule, errors, rng, index=index)
        near, far = (float(combined(drawn, named(errors), size)) for size in (lower, upper))
        constraints.append(replace(drawn, limit=near + (far - near) * 10 ** rng.uniform(-2.5, -0.3)))
    return constraints, lower, upper
