"""The genetic algorithm's settings as a spec has them."""

from __future__ import annotations

from collections.abc import Callable

from planner.nouns.deadline import never
from planner.solvers.genetic import GeneticSettings
from planner.spec.model import Spec


def genetic_settings(spec: Spec, late: Callable[[], bool] = never) -> GeneticSettings:
    """Every parameter of `plan.genetic`; late: asked for every generation, whether it is the last."""
    genetic = spec.plan.genetic
    return GeneticSettings(
        individuals=genetic.individuals,
        best=genetic.best,
        crossover=genetic.crossover,
        mutation=genetic.mutation,
        generations=genetic.generations,
        bits=genetic.bits,
        patience=genetic.patience,
        tolerance=genetic.tolerance,
        late=late,
    )
