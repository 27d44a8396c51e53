"""The flow of a verification: plan → recount → Monte Carlo → answer; and of a sweep: specs → plans."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from planner import __version__, catalog
from planner.errors import InputError, StoppedEarly
from planner.nouns.trajectory import Trajectory
from planner.plan.spec_to_trajectory import trajectory_of
from planner.spec.load import LoadedSpec
from planner.spec.model import Given
from planner.units import from_si
from planner.verify.experiment import Experiment, Where, experiment
from planner.verify.linearity import linearity
from planner.verify.monte_carlo import MonteCarlo, fly
from planner.verify.outcome import claims_of, outcomes
from planner.verify.recount import Recount, recount
from planner.verify.through_files import Pipeline, through_files
from planner.verify.verification import Verification
from planner.verify.weak import weak_coefficients
from planner.verify.workers import runner

Progress = Callable[[str], None]


@dataclass(frozen=True)
class FlightOptions:
    """How many flights, from which seed, at which temperatures, and who flies them.

    through_files: how many of their units go the whole way through files, too
    """

    flights: int = 2000
    seed: int = 1
    where: Where = "flight"
    workers: int = 1
    cluster: str | None = None
    through_files: int = 2


def flight_options(
    flights: int, seed: int, temperature: str, workers: int, cluster: str | None, through_files: int
) -> FlightOptions:
    """Options from words. Raises InputError for one that we do not know."""
    if temperature not in ("flight", "range"):
        raise InputError(f"--temperature must be flight or range, not {temperature!r}")
    if workers == 0:
        raise InputError("--workers must be 1 or more, or -1 for all cores")
    where: Where = "range" if temperature == "range" else "flight"
    return FlightOptions(flights, seed, where, workers, cluster, through_files)


def verify(
    loaded: LoadedSpec, document: Mapping[str, Any], options: FlightOptions, progress: Progress
) -> Verification:
    """A plan's tree against its spec: counted again, then flown.

    Raises InputError for what is no plan, StoppedEarly when the user stopped before the first flights.
    """
    progress("counting the plan again")
    trajectory = trajectory_of(loaded.spec.trajectory, loaded.folder)
    counted = recount(document, loaded, trajectory)
    if _is_foreign(counted) or options.flights == 0:
        return _answer(loaded, document, options, counted)
    progress("preparing the flights")
    try:
        e = experiment(document, loaded.spec, trajectory, seed=options.seed, where=options.where)
    except InputError as error:
        if counted.ok:
            raise
        return _answer(loaded, document, options, counted, why=str(error))
    run = runner(options.workers, options.cluster)
    flown = fly(e, options.flights, run, progress)
    if flown is None:
        raise StoppedEarly("stopped before the first flights had landed: nothing can be said")
    found = _answer(loaded, document, options, counted, e, flown, trajectory)
    if options.through_files == 0 or flown.stopped:
        return found
    progress("some units the whole way through files")
    with TemporaryDirectory(prefix="planner-verify-") as folder:
        files = through_files(e, flown.tally, options.through_files, _pipeline(loaded), Path(folder))
    return replace(found, files=files)


def _pipeline(loaded: LoadedSpec) -> Pipeline:
    """calibrate and apply as the commands do them."""
    from planner.calibrate.fit_options import FitOptions
    from planner.export.calibration_files import calibration_files
    from planner.export.files import write_all_whole
    from planner.pipelines import data

    def calibrate(table: Path, folder: Path) -> Path:
        found = data.calibrate(table, loaded, FitOptions(), lambda message: None)
        files = calibration_files(found, folder)
        write_all_whole(files)
        return next(iter(files))

    def apply(calibration: Path, raw: Path, out: Path) -> None:
        data.apply(calibration, raw, out, None)

    return Pipeline(calibrate, apply)


def _is_foreign(counted: Recount) -> bool:
    """Whether the plan is of another spec, or no plan at all: then flying it would say nothing."""
    return any(check.name in ("shape", "names") and not check.ok for check in counted.checks)


def _answer(
    loaded: LoadedSpec,
    document: Mapping[str, Any],
    options: FlightOptions,
    counted: Recount,
    e: Experiment | None = None,
    flown: MonteCarlo | None = None,
    trajectory: Trajectory | None = None,
    why: str | None = None,
) -> Verification:
    confidence = loaded.spec.plan.confidence
    judged = () if e is None or flown is None else outcomes(e, flown.tally, document, loaded.spec)
    return Verification(
        version=__version__,
        name=loaded.spec.name,
        spec_sha256=loaded.sha256,
        plan_sha256=str(document.get("plan_sha256", "")),
        recount=counted,
        outcomes=judged,
        claims=() if e is None or flown is None else claims_of(e, flown.tally, confidence),
        weak=() if e is None else weak_coefficients(e),
        linear=() if e is None or flown is None or flown.stopped else linearity(e),
        flights=0 if flown is None else flown.tally.flights,
        wanted=options.flights,
        stopped=flown is not None and flown.stopped,
        seed=options.seed,
        where=options.where,
        flown=_words(loaded, e, trajectory),
        confidence=confidence,
        notes=tuple(_notes(loaded, e) if why is None else [f"not flown: {why}"]),
    )


def _words(loaded: LoadedSpec, e: Experiment | None, trajectory: Trajectory | None) -> str:
    if e is None or trajectory is None:
        return "none"
    if e.flight is None:
        return "none: the linear combination with the published coefficients"
    duration = float(trajectory.time_s[-1] - trajectory.time_s[0])
    return f"{trajectory.name}, {duration:g} s, nonlinear, on day {e.day:g}"


def _whose(loaded: LoadedSpec) -> str:
    """Where the noise comes from, which plans count only if the spec has it."""
    given = loaded.spec.unit.noise.model_fields_set
    if len(given) == 2:
        return "as the spec says"
    left = "" if not given else f" for the {'gyro' if 'accelerometer' in given else 'accelerometer'}"
    return f"as `planner simulate` has it, since unit.noise says nothing{left} and the plan counts none"


def _in_flight(e: Experiment) -> str:
    """Whose noise acts in flight."""
    if e.flight is None or not e.flight.beside.noise:
        return "the flights have none"
    return f"in flight, too, that of the {' and the '.join(e.flight.beside.noise)}"


def _notes(loaded: LoadedSpec, e: Experiment | None) -> list[str]:
    if e is None:
        return []
    noise = e.chance.white
    notes = [
        f"noise of the records: gyro {from_si(noise['gyro'], 'deg/s'):.3g} deg/s/√Hz, accelerometer "
        f"{from_si(noise['accelerometer'], 'mg'):.3g} mg/√Hz, {_whose(loaded)}; {_in_flight(e)}"
    ]
    if isinstance(loaded.spec.sensitivities, Given):
        notes.append(
            "sensitivities are given: nothing is flown; each error adds its published metres, all axes as one"
        )
    if any(catalog.effects()[name].parameters for name in loaded.spec.effects):
        notes.append("nonlinear parameters (time constants) are taken as known in the calibrations")
    return notes
