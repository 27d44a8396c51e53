"""A sweep: finished points kept one by one in its folder, then the table, the CSV and the page."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.api.answer import Answer, Row, document_and_page
from planner.api.given import SpecLike, whole
from planner.nouns.progress import Progress, silent

if TYPE_CHECKING:
    from planner.report.blocks import Report

SHOWN = 10  # notes on points without a plan
FILES = ("sweep.csv", "sweep.json", "report.html")


@dataclass(frozen=True)
class SweepAnswer(Answer):
    """Finished points in the order of the grid; wanted: how many there are to be. Rows: the points.

    held: what the folder had before; odd: on points without a plan
    """

    name: str
    keys: tuple[str, ...]
    points: tuple[dict[str, Any], ...]
    wanted: int
    stopped: bool
    held: tuple[str, ...] = ()
    odd: tuple[str, ...] = ()

    @property
    def unanswered(self) -> int:
        """Points for which nothing was found within plan.time_limit."""
        return sum(row["status"] == "stopped" for row in self.points)

    def to_dict(self) -> dict[str, Any]:
        """sweep.json."""
        from planner import __version__

        return {
            "planner": __version__,
            "spec": self.name,
            "keys": list(self.keys),
            "points": list(self.points),
            "wanted": self.wanted,
        }

    def rows(self) -> Sequence[Row]:
        """One row a point, as sweep.csv."""
        from planner.report.subjects.sweep import csv_columns, csv_rows

        document = self.to_dict()
        columns = csv_columns(document)
        return [dict(zip(columns, row, strict=True)) for row in csv_rows(document)]

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """Hours against metres."""
        from planner.report.subjects.sweep import sweep_report

        return (sweep_report(self.to_dict()),)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the folder held, and points without a plan."""
        return (*self.held, *self.odd)

    @property
    def exit_code(self) -> int:
        """4 when it was stopped, or a point had no answer in time."""
        return 4 if self.stopped or self.unanswered else 0

    @property
    def remark(self) -> str:
        """How far it came."""
        said = f"stopped after {len(self.points)} of {self.wanted} points; the same command goes on"
        return said if self.stopped else ""

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """sweep.csv, sweep.json and report.html in the folder `out`."""
        from planner.export.csv_text import csv_text
        from planner.report.subjects.sweep import csv_columns, csv_rows

        document = self.to_dict()
        table = csv_text(csv_columns(document), csv_rows(document))
        return {out / "sweep.csv": table, **document_and_page(self, out, "sweep.json", command)}


def sweep(
    spec: SpecLike,
    *vary: str,
    folder: str | Path,
    points: int = 10,
    workers: int = 1,
    cluster: str | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> SweepAnswer:
    """Plan a grid of specs: seconds against metres. vary: `KEY=A..B` or `KEY=A,B,…`.

    folder: finished points are kept in its `points`, each as soon as it is there; the same call goes on
    where it was stopped, and Ctrl-C stops it. force: replace files of others
    Raises InputError for a variation that is wrong, and for a folder that holds files of others (P010).
    """
    from planner.own_files import refuse_others
    from planner.pipelines import sweep as pipeline
    from planner.whole_files import write_whole

    loaded, place = whole(spec), Path(folder)
    grid = pipeline.points_of(loaded, vary, points)
    name = loaded.path.stem
    if not force:
        refuse_others(dict.fromkeys(map(place.joinpath, FILES)), loaded.path)
    held = _held_before(place, name, grid.keys)
    found = {i: kept for i in range(len(grid)) if (kept := _kept(place, grid.digest_at(i))) is not None}
    if found:
        held.append(f"{len(found)} of {len(grid)} points were finished before")
    left = [i for i in range(len(grid)) if i not in found]
    stopped = False
    try:
        for number, result in pipeline.sweep(loaded.path, grid, left, workers, cluster):
            row = pipeline.row_of(grid.values_at(number), grid.digest_at(number), result)
            write_whole(_file(place, row["digest"]), json.dumps(row, ensure_ascii=False) + "\n")
            found[number] = row
            progress(f"{len(found)} of {len(grid)} points")
    except KeyboardInterrupt:
        stopped = True
    rows = tuple(found[i] for i in sorted(found))
    return SweepAnswer(name, grid.keys, rows, len(grid), stopped, tuple(held), tuple(_without_plan(rows)))


def _held_before(folder: Path, name: str, keys: Sequence[str]) -> list[str]:
    """What the folder has from another sweep: its points stay."""
    held = folder / "sweep.json"
    try:
        before = json.loads(held.read_bytes())
        told = (str(before["spec"]), tuple(map(str, before["keys"])), len(before["points"]))
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        return []  # none, or of something else, which may be replaced
    if told[:2] == (name, tuple(keys)):
        return []
    return [
        f"{folder} held a sweep of {told[0]} over {', '.join(told[1])}; its {told[2]} points stay in "
        f"{folder / 'points'}, and its own command brings its table back"
    ]


def _file(folder: Path, digest: str) -> Path:
    return folder / "points" / f"{digest[:32]}.json"


def _kept(folder: Path, digest: str) -> dict[str, Any] | None:
    """A point that was finished before; what cannot be read, is another's, or had no answer, is not."""
    try:
        row = json.loads(_file(folder, digest).read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    whole = isinstance(row, dict) and row.get("digest") == digest
    return row if whole and row.get("status") in ("planned", "infeasible", "invalid") else None


def _without_plan(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Points that are no spec, or had no answer in time; the table has room for a few words only."""
    odd = [row for row in rows if row["status"] in ("invalid", "stopped")]
    for row in odd[:SHOWN]:
        yield f"{', '.join(f'{k}={v}' for k, v in row['values'].items())}: no plan: {row['why']}"
    if len(odd) > SHOWN:
        yield f"and {len(odd) - SHOWN} more points without a plan; sweep.csv says why"
