"""The flow of the sensitivities: spec and flights → columns, errors over the flight, flights side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from planner.errors import InputError
from planner.nouns.progress import Progress
from planner.nouns.sensitivities import Sensitivities
from planner.pipelines.navigation import asked_errors, sensitivity
from planner.plan.error_over_flight import error_over_flight, uncalibrated_sizes
from planner.plan.flights_side_by_side import FlownErrors, side_by_side
from planner.plan.spec_to_errors import error_models
from planner.plan.spec_to_sensitivity import sensitivities as sensitivities_of
from planner.plan.spec_to_trajectory import aided, on_its_day, trajectory_of
from planner.spec.load import LoadedSpec


def flown_errors(
    loaded: LoadedSpec,
    flight: Path | None,
    beside: Sequence[str],
    progress: Progress,
    *,
    at: float | None = None,
) -> FlownErrors:
    """All that `planner sensitivity` says. beside: built-in trajectories by name, or CSV files.

    Raises InputError for a trajectory that is neither, and as `sensitivity` does.
    """
    found = sensitivity(loaded, flight, progress, at=at)
    sizes = uncalibrated_sizes(error_models(loaded.spec))
    curves = tuple(
        error_over_flight(found, sizes, error, adds=True, until=at if at is not None else until)
        for error, until in _wanted(loaded)
    )
    every = {_first_name(loaded, flight): found}
    for name in beside:
        progress(f"flying {name}")
        every[Path(name).stem] = _along(loaded, name)
    flights = side_by_side(every) if beside else ()
    last = min(float(s.time_s[-1]) for s in every.values())
    totals = {
        name: error_over_flight(s, sizes, "position", adds=True, until=last) for name, s in every.items()
    }
    return FlownErrors(found, curves, flights, totals if beside else {})


def _wanted(loaded: LoadedSpec) -> list[tuple[str, float | None]]:
    """Navigation errors of the requirements and the latest instant of each; None is the end of the flight."""
    found: dict[str, float | None] = {}
    for r in loaded.spec.requirement:
        until = None if isinstance(r.at, str) else float(r.at)
        before = found.get(r.error, 0.0)
        found[r.error] = None if until is None or before is None else max(until, before)
    return list(found.items()) or [("position", None)]


def _first_name(loaded: LoadedSpec, flight: Path | None) -> str:
    if flight is not None:
        return flight.stem
    choice = loaded.spec.trajectory
    return choice if isinstance(choice, str) else str(choice.get("name", Path(str(choice.get("file"))).stem))


def _along(loaded: LoadedSpec, name: str) -> Sensitivities:
    """Sensitivities along another flight: a file that is there, or a built-in by its name."""
    path = Path(name)
    try:
        choice = {"file": str(path.resolve())} if path.suffix else name
        trajectory = on_its_day(aided(trajectory_of(choice, loaded.folder), loaded.spec), loaded.spec)
    except InputError as error:
        raise InputError(f"--beside {name}: {error}") from None
    return sensitivities_of(trajectory, asked_errors(loaded.spec))
