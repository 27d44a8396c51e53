"""A plan with what stands beside it, who waits for it, and what the spec has it remark."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from planner.nouns.allowances import AllowedErrors
from planner.nouns.plan import Plan
from planner.pipelines.navigation import Navigation
from planner.spec.load import LoadedSpec
from planner.spec.unused_tests import unused_tests


@dataclass(frozen=True)
class Planned:
    """A plan with everything that its report shows."""

    plan: Plan
    navigation: Navigation
    allowed: AllowedErrors | None


Answered = Callable[[Planned], None]


def nobody(planned: Planned) -> None:
    """For who waits for all of it."""
    del planned


def remarked(loaded: LoadedSpec, navigation: Navigation) -> list[str]:
    """The spec's warnings with their places, and what only the built flight shows.

    A model's own note only repeats one of them.
    """
    unused = unused_tests(loaded.spec)
    said = [f"not used, with 0 repeats by hand: {', '.join(unused)}"] if unused else []
    said += [f"{warning.path}: {warning.message}" for warning in loaded.warnings]
    remark = f"trajectory: {navigation.unaided}"
    return said if navigation.unaided is None or remark in said else [*said, remark]
