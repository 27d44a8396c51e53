"""The flow of a sweep: a grid of specs → a plan for each, as far as its hours."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from planner import __version__
from planner.errors import InfeasibleError, InputError, StoppedEarly
from planner.nouns.plan import Plan
from planner.pipelines.planning import exact_plan
from planner.spec.load import LoadedSpec, spec_from_bytes
from planner.spec.yaml12 import read_yaml
from planner.units import from_si
from planner.verify.vary import Grid, GridPoint, Variation, grid, variation
from planner.verify.workers import runner

MOST_TRIED = 500  # combinations, of 5 to 25 ms each, before a value passes unseen and is marked in the table


@dataclass(frozen=True)
class SweepTask:
    """What the workers share: the grid, and the file that its spec comes from."""

    grid: Grid
    path: Path


def points_of(loaded: LoadedSpec, vary: Sequence[str], points: int) -> Grid:
    """The grid over a spec.

    Raises InputError for a variation that is wrong, and for a value that no point can have.
    """
    tree = dict(read_yaml(loaded.data, str(loaded.path)).value)
    variations = [variation(text, points, tree) for text in vary]
    found = grid(tree, variations, f"{__version__}\n{_flights(tree, variations, loaded.folder)}")
    _refuse_impossible_values(found, loaded.path)
    return found


def _flights(tree: Mapping[str, Any], variations: Sequence[Variation], folder: Path) -> str:
    """Digests of the flights' files: another flight under the same name is another sweep."""
    chosen = tree.get("trajectory")
    files = [chosen.get("file")] if isinstance(chosen, Mapping) else []
    files += [value for v in variations if v.key == "trajectory.file" for value in v.values]
    paths = [folder / str(file) for file in files if file is not None]
    return "\n".join(hashlib.sha256(p.read_bytes()).hexdigest() for p in paths if p.is_file())


def _refuse_impossible_values(points: Grid, path: Path) -> None:
    """Before hours of planning: every value is that of some point that is a spec."""
    for i, v in enumerate(points.variations):
        for k, value in enumerate(v.values):
            first, *others = islice(points.having(i, k), MOST_TRIED)
            why = _fault(points[first], path)
            if why and all(_fault(points[number], path) for number in others):
                raise InputError(f"--vary {v.key}={value}: {why}")


def _fault(point: GridPoint, path: Path) -> str:
    """Why it is no spec; nothing if it is one."""
    try:
        spec_from_bytes(point.text.encode(), path)
    except InputError as error:
        return _words(error)
    return ""


def sweep(
    spec: Path,
    points: Grid,
    numbers: Sequence[int],
    workers: int,
    cluster: str | None,
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Points of the grid with what their plans say, in the order in which they are finished.

    Raises StoppedEarly when workers die again and again.
    """
    run = runner(workers, cluster)
    try:
        yield from run(plan_point, SweepTask(points, spec), [(number, 1) for number in numbers])
    except StoppedEarly as error:
        raise StoppedEarly(f"{error}; the same command goes on") from None


def plan_point(task: SweepTask, number: int, size: int) -> tuple[int, dict[str, Any]]:
    """One point: planned, infeasible (and what binds), stopped (no answer in time) or invalid."""
    del size
    try:
        loaded = spec_from_bytes(task.grid[number].text.encode(), task.path)
        return number, _planned(exact_plan(loaded))
    except InfeasibleError as error:
        binds = [{"part": part, "share": share} for part, share in error.binds]
        return number, {
            "status": "infeasible",
            "why": str(error),
            "binds": binds,
            "nearest_limit": error.nearest_limit,
        }
    except StoppedEarly as error:
        return number, {"status": "stopped", "why": str(error)}
    except InputError as error:
        return number, {"status": "invalid", "why": _words(error)}


def _words(error: InputError) -> str:
    """What is wrong, by keys: lines of a point's spec are those of no file."""
    return "; ".join(f"{f.path}: {f.message}" for f in error.faults) or error.message


def _planned(plan: Plan) -> dict[str, Any]:
    from planner.export.json import number

    return {
        "status": "planned",
        "time_s": number(plan.time_s),
        "bound_s": number(plan.bound_s),
        "gap": number(plan.gap),
        "proved": plan.proved,
        "power_on_s": number(plan.power_on_s),
        "requirements": [
            {
                "error": r.error,
                "unit": r.unit,
                "limit": number(from_si(r.limit, r.unit)),
                "achieved": number(from_si(r.achieved, r.unit)),
            }
            for r in plan.requirements
        ],
        "tests": [
            {
                "test": t.test,
                "temperatures_degc": [number(x) for x in t.temperatures_degc],
                "repeats": list(t.repeats),
            }
            for t in plan.tests
        ],
    }


def row_of(values: Mapping[str, Any], digest: str, found: Mapping[str, Any]) -> dict[str, Any]:
    """A point as sweep.json holds it."""
    return {"values": dict(values), "digest": digest, **found}
