"""A plan taken to the bench: export."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.api.answer import Answer, Row

if TYPE_CHECKING:
    from planner.protocols import Exported
    from planner.report.blocks import Report


@dataclass(frozen=True)
class ExportAnswer(Answer):
    """A schedule in one of the export formats. Rows: its files."""

    form: str
    record: Exported

    def to_dict(self) -> dict[str, Any]:
        """The format, and the names of its files."""
        return {"format": self.form, "files": list(self.record.files), "notes": list(self.record.notes)}

    def rows(self) -> Sequence[Row]:
        """One row a file."""
        return [{"file": name, "content": content} for name, content in self.record.files.items()]

    @property
    def reports(self) -> tuple[Report, ...]:
        """One line."""
        from planner.report.blocks import Report

        return (Report("Export", "", f"{self.form}: {', '.join(self.record.files)}"),)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the format cannot say."""
        return tuple(self.record.notes)

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """The files: into `out` if that is a folder or has no suffix; else `out` is the first of them."""
        from planner.export.outputs import places

        return places(self.record.files, out)


def export(
    plan: str | Path,
    form: str,
    *,
    dialect: str | None = None,
    start: str | None = None,
    timezone: str | None = None,
) -> ExportAnswer:
    """The schedule of a plan's file for bench software and calendars.

    form: `acutrol`, `csv`, `json`, `ics`, `chamber`, or an installed package's; start: local time of step 0.
    Raises InputError for a format or dialect that there is not, a plan that was changed, and one that asks
    its benches for more than they can do.
    """
    from planner.export.outputs import exported_file
    from planner.protocols import ExportOptions

    return ExportAnswer(form, exported_file(Path(plan), form, ExportOptions(dialect, start, timezone)))
