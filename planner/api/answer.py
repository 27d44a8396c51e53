"""What every verb answers: plain values, a table, words, files. One record a verb, frozen."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.errors import InputError

if TYPE_CHECKING:
    from pandas import DataFrame

    from planner.nouns.plan import Plan
    from planner.report.blocks import Report

Row = Mapping[str, Any]


class Answer(ABC):
    """What a verb answers; a subclass is a frozen dataclass of the records that it holds.

    `to_dict` is what `--json` gives as `result`, `to_pandas` its main table, `reports` its words, `save` its
    files; a notebook shows the first screen. exit_code: what the command ends with, 0 when all is well.
    """

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Plain values, as the command's JSON file has them; units stand in the keys or beside the values."""

    @abstractmethod
    def rows(self) -> Sequence[Row]:
        """The main table, one mapping a row."""

    @property
    @abstractmethod
    def reports(self) -> tuple[Report, ...]:
        """The words: one report, or one of each unit."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What the reader of the answer should know beside it."""
        return ()

    @property
    def exit_code(self) -> int:
        """0 done, 1 the answer is no, 3 cannot be met, 4 stopped early."""
        return 0

    @property
    def remark(self) -> str:
        """Why the exit code is not 0, in words; empty where the answer itself says so."""
        return ""

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """Place -> content of every file of the answer, `out` being what the command's `-o` names.

        command: the line that made it, which pages show
        """
        raise InputError(f"{type(self).__name__} has no files; its figures are in to_dict()")

    def save(self, out: str | Path) -> tuple[Path, ...]:
        """Write the files of the answer, all or none, over what is there; what was written.

        Raises InputError when the place cannot be written.
        """
        from planner.own_files import write_own

        files = self.placed(Path(out))
        write_own(files, None, Path(out), force=True)
        return tuple(files)

    def to_pandas(self) -> DataFrame:
        """The main table as a data frame. Raises InputError where pandas is not installed."""
        try:
            import pandas as pd
        except ImportError:
            raise InputError(
                "to_pandas() needs pandas, which is not installed; pip install 'planner[notebook]'"
            ) from None
        return pd.DataFrame.from_records([_flat(row) for row in self.rows()])

    @cached_property
    def _shown(self) -> str:
        from planner.report.page import first_screen

        return "\n".join(map(first_screen, self.reports))

    def _repr_html_(self) -> str:
        return self._shown

    def __str__(self) -> str:
        from io import StringIO

        from rich.console import Console

        from planner.report.console import show

        text = StringIO()
        for report in self.reports:
            show(report, Console(file=text, width=110, highlight=False, no_color=True, soft_wrap=True))
        return text.getvalue().rstrip("\n")


def _flat(row: Row) -> dict[str, Any]:
    """Mappings within a row as columns of their own: `motion` {axis 1: 90} -> `motion.axis 1`."""
    found: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, Mapping):
            found |= {f"{key}.{name}": one for name, one in _flat(value).items()}
        else:
            found[key] = value
    return found


def page(report: Report, command: str = "") -> str:
    """A report as its page, with the command that made it."""
    from planner.report.page import html

    return html(replace(report, command=command))


def document_and_page(answer: Answer, out: Path, name: str, command: str) -> dict[Path, str | bytes]:
    """The tree of an answer as the JSON file `name`, its only report as report.html, in the folder `out`."""
    from planner.export.json_figures import json_text

    (report,) = answer.reports
    return {out / name: json_text(answer.to_dict()), out / "report.html": page(report, command)}


PlanLike = str | Path | Mapping[str, Any] | Answer


def plan_tree(plan: PlanLike | Plan) -> dict[str, Any]:
    """The tree of a plan: of plan.json or its folder, of a plan made just now, or a tree itself.

    Raises InputError for what is no plan.
    """
    import json

    from planner.export.documents import read_plan
    from planner.export.json import plan_text
    from planner.nouns.plan import Plan

    if isinstance(plan, (str, Path)):
        return read_plan(Path(plan))
    if isinstance(plan, Answer):
        plan = plan.to_dict()
    elif isinstance(plan, Plan):
        plan = json.loads(plan_text(plan))
    if not isinstance(plan, Mapping) or "steps" not in plan:
        raise InputError(f"{type(plan).__name__} is no plan; give plan.json, its folder or what plan() made")
    return dict(plan)


def plan_tree_if_any(plan: PlanLike | None) -> dict[str, Any] | None:
    """The tree of a plan, where one is given. Raises InputError as `plan_tree`."""
    return None if plan is None else plan_tree(plan)


def of_units(documents: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The document of one unit as it is; those of several under `units`."""
    return dict(documents[0]) if len(documents) == 1 else {"units": list(documents)}
