"""A spec with gaps: what is left when its faulty parts are taken out, so that the rest is checked as well."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from planner.spec.forms import Name, one_or_many
from planner.spec.model import Bench, Requirement, Spec, Test, Unit


class Draft(Spec):
    """As Spec, but nothing must be there; a requirement that was taken out is None."""

    planner: Any = 1
    name: str = "draft"
    requirement: Annotated[tuple[Requirement | None, ...], BeforeValidator(one_or_many)] = ()  # type: ignore[assignment]  # a draft has gaps, which a Spec has not
    trajectory: Any = None
    unit: Unit = Unit()
    effects: tuple[str, ...] = ()
    benches: dict[Name, Bench] = Field(default_factory=dict)
    tests: dict[Name, Test] = Field(default_factory=dict)
