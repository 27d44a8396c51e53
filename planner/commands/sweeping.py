"""The files of a sweep: finished points kept one by one, then the table, the CSV and the page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.errors import InputError
from planner.export.files import write_all_whole, write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console

    from planner.verify.vary import GridPoint


@dataclass(frozen=True)
class Sweep:
    """Finished points in the order of the grid; wanted: how many there are to be."""

    name: str
    keys: tuple[str, ...]
    rows: tuple[dict[str, Any], ...]
    wanted: int
    stopped: bool

    @property
    def document(self) -> dict[str, Any]:
        """sweep.json."""
        from planner import __version__

        return {
            "planner": __version__,
            "spec": self.name,
            "keys": list(self.keys),
            "points": list(self.rows),
            "wanted": self.wanted,
        }


def run(
    spec: Path,
    vary: Sequence[str],
    points: int,
    folder: Path,
    workers: int,
    cluster: str | None,
    progress: Callable[[str], None],
) -> Sweep:
    """Plan what is not yet in the folder; each finished point is written at once."""
    from planner.pipelines import sweep as pipeline

    grid = pipeline.points_of(spec, vary, points)
    found = {p.digest: kept for p in grid if (kept := _kept(folder, p)) is not None}
    left = [p for p in grid if p.digest not in found]
    stopped = False
    try:
        for point, result in pipeline.sweep(spec, left, workers, cluster, progress):
            found[point.digest] = row = pipeline.row_of(point, result)
            write_whole(_file(folder, point), json.dumps(row, ensure_ascii=False) + "\n")
    except KeyboardInterrupt:
        stopped = True
    if found and all(row["status"] == "invalid" for row in found.values()):
        raise InputError(f"no point of the sweep is a spec; the first: {next(iter(found.values()))['why']}")
    rows = tuple(found[p.digest] for p in grid if p.digest in found)
    return Sweep(spec.stem, tuple(grid[0].values), rows, len(grid), stopped)


def _file(folder: Path, point: GridPoint) -> Path:
    return folder / "points" / f"{point.digest[:32]}.json"


def _kept(folder: Path, point: GridPoint) -> dict[str, Any] | None:
    """A point that was finished before; what cannot be read, or is another's, is planned again."""
    try:
        row = json.loads(_file(folder, point).read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return row if isinstance(row, dict) and row.get("digest") == point.digest else None


def write(done: Sweep, spec: Path, folder: Path) -> None:
    """sweep.csv, sweep.json and the page."""
    from planner.export.verify import sweep_csv, sweep_text
    from planner.report.sweep import csv_columns, csv_rows, sweep_html

    del spec
    write_all_whole(
        {
            folder / "sweep.csv": sweep_csv(csv_columns(done.document), csv_rows(done.document)),
            folder / "sweep.json": sweep_text(done.document),
            folder / "report.html": sweep_html(done.document),
        }
    )


def show(done: Sweep, console: Console) -> None:
    """The table on the terminal."""
    from planner.report.summary import rich_table
    from planner.report.sweep import sweep_table
    from planner.report.terminal import room

    with room(console, 130):
        console.print(rich_table(sweep_table(done.document)))
