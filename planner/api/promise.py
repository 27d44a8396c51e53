"""A plan's promise put to the test: verify."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.api.answer import Answer, PlanLike, Row, document_and_page, plan_tree
from planner.api.given import SpecLike, whole
from planner.nouns.progress import Progress, silent

if TYPE_CHECKING:
    from planner.report.blocks import Report
    from planner.verify.verification import Verification


@dataclass(frozen=True)
class VerifyAnswer(Answer):
    """Whether a plan's promise is kept. Rows: the requirements, promised and flown."""

    record: Verification

    @property
    def verdict(self) -> str:
        """`kept`, `broken` or `undecided`."""
        return self.record.verdict

    def to_dict(self) -> dict[str, Any]:
        """verify.json."""
        from planner.export.verify import verify_document

        return verify_document(self.record)

    def rows(self) -> Sequence[Row]:
        """One row a requirement."""
        return list(self.to_dict()["requirements"])

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """report.html."""
        from planner.report.subjects.verify import verify_report

        return (verify_report(self.record),)

    @property
    def notes(self) -> tuple[str, ...]:
        """Of the flights."""
        return tuple(self.record.notes)

    @property
    def exit_code(self) -> int:
        """0 kept, 1 broken, 4 not sure yet or stopped early."""
        if self.verdict == "broken":
            return 1
        return 4 if self.record.stopped or self.verdict == "undecided" else 0

    @property
    def remark(self) -> str:
        """How far it came."""
        found = self.record
        return f"stopped after {found.flights} of {found.wanted} flights" if found.stopped else ""

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """verify.json and report.html in the folder `out`."""
        return document_and_page(self, out, "verify.json", command)


def verify(
    spec: SpecLike,
    plan: PlanLike,
    *,
    flights: int | None = None,
    seed: int = 1,
    temperature: str = "own",
    curves: str = "binding",
    spreads: str | None = None,
    workers: int = 1,
    cluster: str | None = None,
    through_files: int = 2,
    made_for: SpecLike | None = None,
    progress: Progress = silent,
) -> VerifyAnswer:
    """Count a plan again by other code, then fly it: is its promise kept?

    Options as of `planner verify --help`; made_for: the spec that the plan is of, to fly an old plan with
    units of an updated spec. Ctrl-C keeps the flights so far. Raises InputError for a word that there is not.
    """
    from planner.pipelines import promise as pipeline

    options = pipeline.checked(
        pipeline.FlightOptions(flights, seed, temperature, curves, spreads, workers, cluster, through_files)
    )
    loaded, tree = whole(spec), plan_tree(plan)
    old = None if made_for is None else whole(made_for)
    return VerifyAnswer(pipeline.verify(loaded, tree, options, progress, old))
