"""Closing the loop: diagnose, update."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.api.answer import Answer, PlanLike, Row, of_units, page, plan_tree_if_any
from planner.api.given import SpecLike, read, whole
from planner.errors import InputError
from planner.nouns.progress import Progress, silent

if TYPE_CHECKING:
    from planner.diagnose.diagnosis_to_spec import SpecUpdate
    from planner.nouns.diagnosis import Diagnosis
    from planner.pipelines.diagnosing import Diagnosed, Replanned
    from planner.report.blocks import Report
    from planner.spec.load import LoadedSpec


@dataclass(frozen=True)
class DiagnoseAnswer(Answer):
    """What the declared error model of every unit in a table lacks. Rows: terms of the effects found."""

    records: tuple[Diagnosed, ...]

    @property
    def verdict(self) -> str:
        """`clean`, `explained`, `partly_explained`, `unexplained` or `untestable`, of the only unit.

        Raises InputError for several units.
        """
        if len(self.records) != 1:
            raise InputError(f"{len(self.records)} units have a verdict each: records[…].diagnosis.found")
        return self.records[0].diagnosis.found.verdict

    def to_dict(self) -> dict[str, Any]:
        """diagnosis.json; of several units under `units`."""
        return of_units(self._documents())

    def _documents(self) -> list[dict[str, Any]]:
        from planner.export.diagnosis_json import diagnosis_document

        return [diagnosis_document(each.diagnosis) for each in self.records]

    def rows(self) -> Sequence[Row]:
        """One row a term of an effect that was found."""
        return [
            {"of_unit": document["unit"], "effect": e["effect"], "p_value": e["p_value"], **term}
            for document in self._documents()
            for e in document["effects"]
            for term in e["terms"]
        ]

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """One of each unit."""
        from planner.report.subjects.diagnosis import diagnosis_report

        return tuple(diagnosis_report(each.diagnosis, each.table) for each in self.records)

    @property
    def notes(self) -> tuple[str, ...]:
        """Of every unit."""
        found = [each.diagnosis for each in self.records]
        return tuple(note for each in found for note in (*each.notes, *each.found.notes))

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """diagnosis.json and report.html in the folder `out`; several units have a folder each.

        Raises InputError for units whose names make one folder.
        """
        from planner.export.calibration_files import unit_folders
        from planner.export.diagnosis_json import diagnosis_text

        files: dict[Path, str | bytes] = {}
        places = unit_folders(out, [each.diagnosis.found.unit for each in self.records])
        for each, report, place in zip(self.records, self.reports, places, strict=True):
            if place / "diagnosis.json" in files:
                raise InputError(
                    f"two units would both write {place}; give them names that differ in letters"
                )
            files[place / "diagnosis.json"] = diagnosis_text(each.diagnosis)
            files[place / "report.html"] = page(report, command)
        return files


def diagnose(
    data: str | Path,
    spec: SpecLike,
    *,
    plan: PlanLike | None = None,
    seed: int = 1,
    progress: Progress = silent,
) -> DiagnoseAnswer:
    """Dwell table → missing effects, the error before and after on runs not seen, cost in flight, what next.

    plan: what a flight then comes to in all. Raises InputError for a table that cannot be read or is empty.
    """
    from planner.pipelines import diagnosing as pipeline

    found = pipeline.diagnose(Path(data), read(spec), seed, progress, plan_tree_if_any(plan))
    return DiagnoseAnswer(found)


@dataclass(frozen=True)
class UpdateAnswer(Answer):
    """A spec with what a diagnosis found. text: the new spec's; spec: the same, loaded. Rows: the changes."""

    change: SpecUpdate
    spec: LoadedSpec
    diagnosis: Diagnosis
    plans: Replanned | None

    @property
    def text(self) -> str:
        """The new spec's text: the old one's comments and layout stay."""
        return self.change.text

    def to_dict(self) -> dict[str, Any]:
        """Changes, the difference of the texts, hours and metres of both plans."""
        from planner.report.subjects.update import update_document

        return update_document(self.change, self.plans, self.diagnosis)

    def rows(self) -> Sequence[Row]:
        """One row a change."""
        return [{"change": one} for one in self.change.changes]

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """The difference, then both plans."""
        from planner.report.subjects.update import update_report

        return (update_report(self.change, self.plans, self.diagnosis),)

    @property
    def notes(self) -> tuple[str, ...]:
        """Of the change, and warnings of the new spec."""
        return (*self.change.notes, *map(str, self.spec.warnings))

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """The new spec at `out`."""
        return {out: self.change.text}


def update(
    spec: SpecLike,
    diagnosis: str | Path | DiagnoseAnswer,
    *,
    out: str | Path = "spec2.yaml",
    plan: bool = True,
    progress: Progress = silent,
) -> UpdateAnswer:
    """The spec with the effects that a diagnosis found: effect, budget, the test that calibrates it.

    out: what the new spec will be called, which relative files follow; `save` writes it. plan: plan both
    specs and compare. Raises InputError for a diagnosis of another spec, or one that found nothing to change.
    """
    from planner.export.diagnosis_json import read_diagnosis
    from planner.pipelines import diagnosing as pipeline

    old = whole(spec)
    if isinstance(diagnosis, DiagnoseAnswer):
        if len(diagnosis.records) != 1:
            raise InputError(f"a spec is updated by the diagnosis of one unit, not {len(diagnosis.records)}")
        found = diagnosis.records[0].diagnosis
    else:
        found = read_diagnosis(Path(diagnosis))
    made, new = pipeline.update(old, found, Path(out))
    return UpdateAnswer(made, new, found, pipeline.replanned(old, new, progress) if plan else None)
