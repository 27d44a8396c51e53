"""The flow of a sweep: a grid of specs → a plan for each, as far as its hours."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner import __version__
from planner.errors import InfeasibleError, InputError
from planner.pipelines.planning import Navigation, navigate
from planner.plan.allowance_to_repeats import error_menus
from planner.plan.campaign_by_total import by_total
from planner.plan.campaign_to_plan import plan_of
from planner.plan.errors_to_points import point_menus
from planner.plan.plan_to_schedule_figures import with_schedule_figures
from planner.plan.repeats_to_schedule import campaign
from planner.plan.schedule_to_steps import planned_tests, steps
from planner.plan.task import planning_task
from planner.records import Plan
from planner.spec.load import LoadedSpec, spec_from_bytes
from planner.spec.yaml12 import read_yaml
from planner.units import from_si
from planner.verify.vary import GridPoint, grid, variation
from planner.verify.workers import runner

Progress = Callable[[str], None]


@dataclass(frozen=True)
class SweepTask:
    """What the workers share: the points to plan, and the file that they come from."""

    points: tuple[GridPoint, ...]
    path: Path


def points_of(spec: Path, vary: Sequence[str], points: int) -> list[GridPoint]:
    """The grid over a spec's file. Raises InputError for a spec or a variation that is wrong."""
    from planner.spec.load import load_spec

    load_spec(spec)  # every fault of the spec itself, with its place in the file
    tree = read_yaml(spec.read_bytes(), str(spec)).value
    return grid(dict(tree), [variation(text, points) for text in vary], __version__)


def sweep(
    spec: Path, points: Sequence[GridPoint], workers: int, cluster: str | None, progress: Progress
) -> Iterator[tuple[GridPoint, dict[str, Any]]]:
    """Each point with what its plan says, in the order in which they are finished."""
    task = SweepTask(tuple(points), spec)
    run = runner(workers, cluster)
    for done, (number, found) in enumerate(
        run(plan_point, task, [(i, 1) for i in range(len(points))]), start=1
    ):
        progress(f"{done} of {len(points)} plans")
        yield points[number], found


def plan_point(task: SweepTask, number: int, size: int) -> tuple[int, dict[str, Any]]:
    """One point: planned, infeasible (and what binds) or invalid."""
    del size
    point = task.points[number]
    try:
        loaded = spec_from_bytes(point.text.encode(), task.path)
        return number, _planned(_plan(loaded))
    except InfeasibleError as error:
        binds = [{"part": part, "share": share} for part, share in error.binds]
        return number, {
            "status": "infeasible",
            "why": str(error),
            "binds": binds,
            "nearest_limit": error.nearest_limit,
        }
    except InputError as error:
        return number, {"status": "invalid", "why": str(error)}


def _plan(loaded: LoadedSpec) -> Plan:
    """The exact campaign alone: no genetic algorithm beside it, no figures."""
    spec = loaded.spec
    navigation: Navigation = navigate(loaded, lambda message: None)
    menus = error_menus(spec, navigation.models, point_menus(spec))
    task = planning_task(spec, navigation.models, menus, navigation.constraints)
    chosen = by_total(task, campaign(task))
    timeline = steps(spec, chosen)
    made = plan_of(
        task,
        navigation.constraints,
        chosen,
        timeline,
        planned_tests(spec, chosen, timeline),
        version=__version__,
        sha256=loaded.sha256,
        genetic=None,
        notes=(),
    )
    return with_schedule_figures(made, spec, chosen)


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


def row_of(point: GridPoint, found: Mapping[str, Any]) -> dict[str, Any]:
    """A point as sweep.json holds it."""
    return {"values": dict(point.values), "digest": point.digest, **found}
