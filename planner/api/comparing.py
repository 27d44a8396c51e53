"""Plans side by side and what they rest on: compare, why, afford."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.api.answer import Answer, PlanLike, Row, document_and_page, plan_tree
from planner.api.given import SpecLike, whole
from planner.errors import InputError
from planner.nouns.progress import Progress, silent

if TYPE_CHECKING:
    from planner.information.afford import Affordable
    from planner.nouns.plan_file import PlanWhy
    from planner.report.blocks import Report
    from planner.report.comparison import Comparison
    from planner.spec.load import LoadedSpec


@dataclass(frozen=True)
class CompareAnswer(Answer):
    """Plans side by side. Rows: seconds by bench, test and action, one column a plan.

    strict: whether a difference is a no
    """

    record: Comparison
    strict: bool = False

    @property
    def differ(self) -> bool:
        """Whether the plans differ at all."""
        return self.record.differ

    def to_dict(self) -> dict[str, Any]:
        """comparison.json."""
        from planner.report.comparison import comparison_document

        return comparison_document(self.record)

    def rows(self) -> Sequence[Row]:
        """Seconds under every heading."""
        found, names = self.to_dict(), self.record.plans
        return [
            {"by": by, "name": one["name"], **dict(zip(names, one["time_s"], strict=True))}
            for by in ("benches", "tests", "actions")
            for one in found[by]
        ]

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """What differs and why."""
        from planner.report.subjects.compare import comparison_report

        return (comparison_report(self.record),)

    @property
    def exit_code(self) -> int:
        """1 when the plans differ, if that was asked."""
        return 1 if self.strict and self.differ else 0

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """comparison.json, report.html in the folder `out`."""
        return document_and_page(self, out, "comparison.json", command)


def compare(*plans: PlanLike, strict: bool = False) -> CompareAnswer:
    """What differs between two plans or more, and why, in seconds.

    strict: a difference makes the exit code 1. Raises InputError for fewer than two, and for what is no plan.
    """
    from planner.report.comparison import compare as compare_plans

    if len(plans) < 2:
        raise InputError("compare needs two plans or more")
    return CompareAnswer(compare_plans([plan_tree(one) for one in plans]), strict)


@dataclass(frozen=True)
class WhyAnswer(Answer):
    """Why a plan is as it is. Rows: what every visit buys."""

    record: PlanWhy

    def to_dict(self) -> dict[str, Any]:
        """The part of plan.json that says why."""
        return self.record.model_dump(mode="json")

    def rows(self) -> Sequence[Row]:
        """One row a visit: seconds, and every requirement's figure without it; else why its repeats."""
        tree = self.to_dict()
        return list(tree["worth"] or tree["reasons"])

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """What binds, what visits buy, what changes are worth."""
        from planner.report.subjects.why import why_report

        return (why_report(self.record),)


def why(plan: PlanLike) -> WhyAnswer:
    """What binds in a plan, what every visit buys, what changes are worth.

    Of a plan by the published method, which prices no record, what asks for the repeats of every visit.
    """
    from planner.nouns.plan_file import PlanWhy, plan_part

    called = str(plan) if isinstance(plan, (str, Path)) else "the plan"
    return WhyAnswer(plan_part(plan_tree(plan), PlanWhy, called))


@dataclass(frozen=True)
class AffordAnswer(Answer):
    """What so many seconds of a campaign can keep. Rows: the least limits."""

    record: Affordable
    spec: LoadedSpec
    seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Least limits, tests, and the grade of sensor that the limits need."""
        from planner.report.subjects.afford import afford_document

        return afford_document(self.record, self.spec.spec)

    def rows(self) -> Sequence[Row]:
        """One row a requirement."""
        return list(self.to_dict()["requirements"])

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """The same in words."""
        from planner.report.subjects.afford import afford_report

        return (afford_report(self.record, self.spec.spec, self.seconds / 3600),)


def afford(spec: SpecLike, *, hours: float, progress: Progress = silent) -> AffordAnswer:
    """The least limits that so many hours can keep, and the grade of sensor that the limits need.

    Raises InputError for a spec that is not planned by information.
    """
    from planner.pipelines import planning as pipeline

    loaded = whole(spec)
    return AffordAnswer(pipeline.afford(loaded, 3600.0 * hours, progress), loaded, 3600.0 * hours)
