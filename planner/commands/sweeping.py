"""The files of a sweep: finished points kept one by one, then the table, the CSV and the page."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.commands.output import notes
from planner.errors import InputError
from planner.whole_files import write_all_whole, write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

SHOWN = 10  # notes on points without a plan


@dataclass(frozen=True)
class Sweep:
    """Finished points in the order of the grid; wanted: how many there are to be; notes: on odd points."""

    name: str
    keys: tuple[str, ...]
    rows: tuple[dict[str, Any], ...]
    wanted: int
    stopped: bool
    notes: tuple[str, ...] = ()

    @property
    def unanswered(self) -> int:
        """Points for which nothing was found within plan.time_limit."""
        return sum(row["status"] == "stopped" for row in self.rows)

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
    remarks = _held_before(folder, spec.stem, grid.keys)
    found = {i: kept for i in range(len(grid)) if (kept := _kept(folder, grid.digest_at(i))) is not None}
    if found:
        remarks.append(f"{len(found)} of {len(grid)} points were finished before")
    notes(remarks)
    left = [i for i in range(len(grid)) if i not in found]
    stopped = False
    try:
        for number, result in pipeline.sweep(spec, grid, left, workers, cluster):
            row = pipeline.row_of(grid.values_at(number), grid.digest_at(number), result)
            write_whole(_file(folder, row["digest"]), json.dumps(row, ensure_ascii=False) + "\n")
            found[number] = row
            progress(f"{len(found)} of {len(grid)} points")
    except KeyboardInterrupt:
        stopped = True
    rows = tuple(found[i] for i in sorted(found))
    return Sweep(spec.stem, grid.keys, rows, len(grid), stopped, tuple(_without_plan(rows)))


def _held_before(folder: Path, name: str, keys: Sequence[str]) -> list[str]:
    """What the folder has from another sweep: its points stay. Raises InputError for what is of no sweep."""
    held = folder / "sweep.json"
    foreign = next((f for f in (folder / "report.html", folder / "sweep.csv") if f.exists()), None)
    if not held.exists():
        if foreign is None:
            return []
        raise InputError(f"{foreign} is of no sweep and would be replaced; give another folder with -o")
    try:
        before = json.loads(held.read_bytes())
        told = (str(before["spec"]), tuple(map(str, before["keys"])), len(before["points"]))
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        raise InputError(f"{held} is of no sweep and would be replaced; give another folder") from None
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


def write(done: Sweep, page: str, folder: Path) -> None:
    """sweep.csv, sweep.json and the page."""
    from planner.export.json_figures import json_text
    from planner.export.verify import sweep_csv
    from planner.report.subjects.sweep import csv_columns, csv_rows

    write_all_whole(
        {
            folder / "sweep.csv": sweep_csv(csv_columns(done.document), csv_rows(done.document)),
            folder / "sweep.json": json_text(done.document),
            folder / "report.html": page,
        }
    )
