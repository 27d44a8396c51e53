"""The flow of a verification: plan → recount → Monte Carlo → answer; and of a sweep: specs → plans."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from planner import __version__, catalog
from planner.errors import InputError
from planner.nouns.progress import Progress, silent
from planner.nouns.sensor import ErrorName
from planner.nouns.trajectory import Trajectory
from planner.plan.spec_to_trajectory import flight_path
from planner.solvers.one_thread import one_thread
from planner.spec.load import LoadedSpec
from planner.spec.model import Given, Spec
from planner.spec.places import did_you_mean
from planner.units import from_si
from planner.verify.experiment import Experiment, experiment
from planner.verify.families import budgets_of
from planner.verify.flown import LOOKS, Flown, Pilot, flown_until_told
from planner.verify.linearity import linearity
from planner.verify.outcome import claims_of
from planner.verify.prediction import DrawnCurves, Prediction
from planner.verify.recount import Recount, is_by_information, recount
from planner.verify.recount_front import check_campaigns
from planner.verify.recount_promise import as_planned, check_promise
from planner.verify.rounds import BINDING, CURVES, OWN, TEMPERATURES, Worst, rounds
from planner.verify.spreads import SPREADS, Types, types_of
from planner.verify.starts import as_flown
from planner.verify.through_files import Pipeline, through_files
from planner.verify.verification import Verification
from planner.verify.weak import weak_coefficients
from planner.verify.workers import runner


@dataclass(frozen=True)
class FlightOptions:
    """How many flights (None: as many of LOOKS as it takes), from which seed, and who flies them.

    temperature: `own` (each requirement's), `flight` or `range`; curves: a family, `all`, or `binding`, the
    one that the plan says binds; spreads: `stated`, or `drawn` for types of unit where they are estimates
    (None: drawn where the spec says from how many power-ons); through_files: how many units go the whole way
    through files, too
    """

    flights: int | None = None
    seed: int = 1
    temperature: str = OWN
    curves: str = BINDING
    spreads: str | None = None
    workers: int = 1
    cluster: str | None = None
    through_files: int = 2


def checked(options: FlightOptions) -> FlightOptions:
    """The options. Raises InputError for a word that we do not know."""
    if options.temperature not in TEMPERATURES:
        raise InputError(f"--temperature must be {', '.join(TEMPERATURES)}, not {options.temperature!r}")
    if options.curves not in CURVES:
        raise InputError(
            f"--curves must be {', '.join(CURVES)}, not {options.curves!r}"
            f"{did_you_mean(options.curves, CURVES)}"
        )
    if options.spreads not in (None, *SPREADS):
        raise InputError(f"--spreads must be {' or '.join(SPREADS)}, not {options.spreads!r}")
    if options.workers == 0:
        raise InputError("--workers must be 1 or more, or -1 for all cores")
    return options


@one_thread()
def verify(
    loaded: LoadedSpec,
    document: Mapping[str, Any],
    options: FlightOptions,
    progress: Progress,
    made_for: LoadedSpec | None = None,
) -> Verification:
    """A plan's tree against its spec: counted again, then flown.

    made_for: the spec that the plan is of, where units are of another: it is counted by that one and
    calibrated with that one's effects, and what is flown has all that `loaded` says of the units.
    Raises InputError for what is no plan, StoppedEarly when the user stopped before the first flights.
    """
    progress("counting the plan again")
    trajectory = flight_path(loaded.spec, loaded.folder)
    own = made_for or loaded
    counted = recount(document, own, flight_path(own.spec, own.folder) if made_for else trajectory)
    if _is_foreign(counted) or (options.flights == 0 and not is_by_information(document)):
        return _answer(loaded, document, options, counted)
    progress("preparing the flights")
    try:
        e = experiment(document, loaded.spec, trajectory, seed=options.seed, declares=tuple(own.spec.effects))
    except InputError as error:
        if counted.ok:
            raise
        return _answer(loaded, document, options, counted, why=str(error))
    curves = DrawnCurves(e.spec)
    if is_by_information(document) and made_for is None:
        progress("counting again what is promised")
        counted = counted.and_also(check_promise(document, as_planned(e, curves)))
        progress("counting the genetic campaigns again")
        counted = counted.and_also([check_campaigns(document, e, curves)])
    if options.flights == 0:
        return _answer(loaded, document, options, counted)
    told = replace(options, flights=LOOKS[0]) if options.flights is None and not counted.ok else options
    flown = _flown(e, document, told, curves, progress)
    found = _answer(loaded, document, options, counted, flown, trajectory)
    if made_for is not None:
        return replace(found, notes=(*found.notes, _units_of_another(loaded, made_for)))
    if options.through_files == 0 or found.stopped:
        return found
    progress("some units the whole way through files")
    with TemporaryDirectory(prefix="planner-verify-") as folder:
        first = flown[0]
        files = through_files(
            first.e, first.found.tally, options.through_files, _pipeline(loaded), Path(folder)
        )
    return replace(found, files=files)


def _flown(
    e: Experiment,
    document: Mapping[str, Any],
    options: FlightOptions,
    curves: DrawnCurves,
    progress: Progress,
) -> list[Flown]:
    """Every round, or those that were done when the user stopped it."""
    run, prediction = runner(options.workers, options.cluster), None
    if e.flight is not None:
        prediction = Prediction(e, e.flight, curves)
    asked = rounds(document, e.spec, options.curves, options.temperature, _worst(e, prediction))
    pilot = Pilot(document, _types(e, options), prediction, run, progress)
    return flown_until_told(e, asked, options.flights, pilot)


def _types(e: Experiment, options: FlightOptions) -> Types | None:
    """The types of unit, where spreads are drawn and some are estimates."""
    found = types_of(e.spec, options.seed)
    return None if options.spreads == "stated" or not found.errors or e.flight is None else found


def _worst(e: Experiment, prediction: Prediction | None) -> Worst:
    """Looked for by verify's own linear model; without a flight nothing depends on the temperature."""
    if prediction is None:
        return lambda index, family: as_flown(e.spec)
    return lambda index, family: prediction.worst(index, family)


def _units_of_another(loaded: LoadedSpec, made_for: LoadedSpec) -> str:
    """What was flown with which knowledge."""
    more = [name for name in loaded.spec.effects if name not in made_for.spec.effects]
    lacks = f", which knows nothing of {', '.join(more)}" if more else ""
    return (
        f"the plan and its calibration are of {made_for.path.name}{lacks}; the units that fly are of "
        f"{loaded.path.name}"
    )


def _pipeline(loaded: LoadedSpec) -> Pipeline:
    """calibrate and apply as the commands do them."""
    from planner.calibrate.fit_options import FitOptions
    from planner.export.calibration_files import calibration_files
    from planner.pipelines import data
    from planner.whole_files import write_all_whole

    def calibrate(table: Path, folder: Path) -> Path:
        found = data.calibrate(table, loaded, FitOptions(), silent)
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
    flown: Sequence[Flown] = (),
    trajectory: Trajectory | None = None,
    why: str | None = None,
) -> Verification:
    confidence, by_information = loaded.spec.plan.confidence, is_by_information(document)
    first = flown[0] if flown else None
    e, tally = (first.e, first.found.tally) if first else (None, None)
    stopped = any(f.stopped for f in flown)
    return Verification(
        version=__version__,
        name=loaded.spec.name,
        spec_sha256=loaded.sha256,
        plan_sha256=str(document.get("plan_sha256", "")),
        recount=counted,
        outcomes=tuple(o for f in flown for o in f.outcomes(document)),
        claims=() if e is None or tally is None or by_information else claims_of(e, tally, confidence),
        weak=() if e is None else weak_coefficients(e),
        linear=() if e is None or stopped else linearity(e),
        flights=min((f.found.tally.flights for f in flown), default=0),
        wanted=max((f.found.wanted for f in flown), default=options.flights or 0),
        stopped=stopped,
        seed=options.seed,
        temperature=options.temperature,
        curves=options.curves,
        flown=_words(loaded, e, trajectory),
        confidence=confidence,
        notes=tuple(_notes(loaded, e, options, flown) if why is None else [f"not flown: {why}"]),
    )


def _words(loaded: LoadedSpec, e: Experiment | None, trajectory: Trajectory | None) -> str:
    if e is None or trajectory is None:
        return "none"
    if e.flight is None:
        return "none: the linear combination with the published coefficients"
    duration = float(trajectory.time_s[-1] - trajectory.time_s[0])
    return f"{trajectory.name}, {duration:g} s, nonlinear, on day {e.day:g}"


def _whose(loaded: LoadedSpec) -> str:
    """Where the noise of the records comes from."""
    given = loaded.spec.unit.noise.model_fields_set
    if len(given) == 2:
        return "as the spec says"
    left = "" if not given else f" for the {'gyro' if 'accelerometer' in given else 'accelerometer'}"
    return f"as `planner simulate` has it, since unit.noise says nothing{left}"


def _in_flight(e: Experiment) -> str:
    """Whose noise acts in flight."""
    if e.flight is None or not e.flight.beside.noise:
        return "the flights have none"
    return f"in flight, too, that of the {' and the '.join(e.flight.beside.noise)}"


def _spreads(spec: Spec) -> str:
    """Which run-to-run spreads are estimates."""
    from_some = {
        str(ErrorName.of(s, e)): b.power_ons
        for (s, e), b in budgets_of(spec).items()
        if b.power_ons is not None
    }
    if not from_some:
        return "run-to-run spreads are taken as known: the spec says of none from how many power_ons it is"
    named = ", ".join(f"{error} from {n} power-ons" for error, n in from_some.items())
    return f"run-to-run spreads that are estimates: {named}; the others are taken as known"


def _notes(
    loaded: LoadedSpec, e: Experiment | None, options: FlightOptions, flown: Sequence[Flown]
) -> list[str]:
    if e is None:
        return []
    noise = e.chance.white
    notes = [
        f"noise of the records: gyro {from_si(noise['gyro'], 'deg/s'):.3g} deg/s/√Hz, accelerometer "
        f"{from_si(noise['accelerometer'], 'mg'):.3g} mg/√Hz, {_whose(loaded)}; {_in_flight(e)}"
    ]
    notes.append(_spreads(loaded.spec))
    if options.flights is None and flown and flown[0].found.wanted > LOOKS[0]:
        notes.append(f"{LOOKS[0]} flights left it open: flown on to {flown[0].found.wanted}")
    if isinstance(loaded.spec.sensitivities, Given):
        notes.append(
            "sensitivities are given: nothing is flown; each error adds its published metres, all axes as one"
        )
    if any(catalog.effects()[name].parameters for name in loaded.spec.effects):
        notes.append("nonlinear parameters (time constants) are taken as known in the calibrations")
    return notes
