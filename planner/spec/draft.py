"""A spec with gaps: what is left when its faulty parts are taken out, so that the rest is checked as well."""

from __future__ import annotations

import copy
from collections.abc import Collection, Sequence
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationError

from planner.quantities import AnyQuantity, PositiveSeconds
from planner.spec.forms import Name, one_or_many
from planner.spec.model import Bench, Requirement, Spec, Test, Unit
from planner.spec.places import data_path, part_at
from planner.spec.plan_choice import PlanChoice, Shift
from planner.spec.yaml12 import Path
from planner.units import parse

# How deep a part may lie that is taken out alone; what is deeper takes what it lies in with it.
DEPTH = {
    "requirement": 3,
    "sensitivities": 3,
    "unit": 6,
    "effects": 2,
    "benches": 4,
    "tests": 5,
    "plan": 4,
    "initial_alignment": 2,
    "recalibration": 2,
}
ROUNDS = 8  # of taking out more; a spec is 6 deep


class GappedTest(Test):
    """As Test; what was taken out has a stand-in, of which nothing is said."""

    __test__ = False

    bench: str = ""
    record: PositiveSeconds = Field(1.0)


class GappedRequirement(Requirement):
    """As Requirement; what was taken out has a stand-in, of which nothing is said."""

    error: Any = "position"
    limit: AnyQuantity = parse("1 m")


class GappedPlan(PlanChoice):
    """As PlanChoice; a shift that was taken out is None."""

    shifts: Annotated[tuple[Shift | None, ...], BeforeValidator(one_or_many)] = ()  # type: ignore[assignment]  # a draft has gaps, which a Spec has not


class Draft(Spec):
    """As Spec, but nothing must be there; a requirement that was taken out is None."""

    planner: Any = 1
    name: str = "draft"
    requirement: Annotated[tuple[GappedRequirement | None, ...], BeforeValidator(one_or_many)] = ()  # type: ignore[assignment]  # a draft has gaps, which a Spec has not
    trajectory: Any = None
    unit: Unit = Unit()
    effects: tuple[str, ...] = ()
    benches: dict[Name, Bench] = Field(default_factory=dict)
    tests: dict[Name, GappedTest] = Field(default_factory=dict)  # type: ignore[assignment]  # a draft has gaps, which a Spec has not
    plan: GappedPlan = GappedPlan()


def drafted(
    value: dict[Any, Any], foreign: Collection[Path], faulty: Collection[Path]
) -> tuple[Spec | None, frozenset[Path]]:
    """The spec without its faulty parts, and which parts that are; None when nothing of it has a form.

    foreign: unknown keys, which nothing else is asked about; faulty: everything else in which a fault was
    found. What cannot stand without a part that is taken out is taken out with it.
    """
    gaps = {path[: DEPTH.get(str(path[0]), 1)] for path in faulty if path}
    if () in faulty:
        return None, frozenset(gaps)
    for _ in range(ROUNDS):
        rest = copy.deepcopy(value)
        for path in sorted((*foreign, *gaps), key=len, reverse=True):
            _remove(rest, path)
        try:
            return Draft.model_validate(rest), frozenset(gaps)
        except ValidationError as error:
            found = {data_path(rest, detail["loc"])[0] for detail in error.errors(include_url=False)}
            gaps |= {path[:-1] if path in gaps else path for path in found}
        if () in gaps:
            break
    return None, frozenset(gaps)


def _remove(value: Any, path: Sequence[Any]) -> None:
    """Take a part out; an item of a list leaves a gap, so that the others keep their numbers."""
    value, last = part_at(value, path[:-1]), path[-1]
    if isinstance(value, list) and isinstance(last, int) and last < len(value):
        value[last] = "" if any(isinstance(item, str) for item in value) else None
    elif isinstance(value, dict):
        value.pop(last, None)
