"""A spec that an older planner read, in the present format: migrate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.api.answer import Answer, Row
from planner.api.given import text_of

if TYPE_CHECKING:
    from planner.report.blocks import Report
    from planner.spec.load import LoadedSpec
    from planner.spec.migration import Migration


@dataclass(frozen=True)
class MigrateAnswer(Answer):
    """A spec in the present format. Rows: the changes, none where it was in it."""

    made: Migration

    @property
    def text(self) -> str:
        """The spec's text; comments and layout are those of the old one."""
        return self.made.spec.text

    @property
    def spec(self) -> LoadedSpec:
        """The same, loaded."""
        return self.made.spec

    @property
    def changes(self) -> tuple[str, ...]:
        """A sentence each."""
        return self.made.changes

    def to_dict(self) -> dict[str, Any]:
        """Changes, and the difference of the texts."""
        return {"changes": list(self.changes), "diff": self.made.diff}

    def rows(self) -> Sequence[Row]:
        """One row a change."""
        return [{"change": one} for one in self.changes]

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """The changes, and the difference of the texts."""
        from planner.report.blocks import Block, Difference, Report, Text, existing, section

        if not self.changes:
            return (Report("migrate", "", "This is the present format; nothing is to be changed."),)
        told: list[Block] = [Text(f"{one}.") for one in self.changes]
        return (
            Report(
                "migrate",
                "",
                "",
                sections=existing(section("changes", "Changes", *told, Difference(self.made.diff))),
            ),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings of the spec."""
        return tuple(map(str, self.spec.warnings))

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """The spec at `out`."""
        return {out: self.text}


def migrate(spec: str | Path | Mapping[str, Any], *, published: bool = False) -> MigrateAnswer:
    """The spec in the present format: `planner: 1` is said, keys that its method does not read go.

    published: plan by the published method, as older planners did where nothing was said. Raises InputError
    for a later format, and for faults of other kinds, all at once.
    """
    from planner.spec.migration import migrated

    return MigrateAnswer(migrated(*text_of(spec), published=published))
