"""What the requirements ask of the sensors: spec → trajectory → sensitivities."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from planner.nouns.allowances import ErrorModel
from planner.nouns.progress import Progress
from planner.nouns.sensitivities import Constraint, Sensitivities
from planner.nouns.trajectory import Trajectory
from planner.plan.allowance_to_repeats import error_menus
from planner.plan.errors_to_points import point_menus
from planner.plan.observable_campaign import refuse_what_no_campaign_observes
from planner.plan.spec_to_errors import error_models
from planner.plan.spec_to_sensitivity import constraints as constraints_of
from planner.plan.spec_to_sensitivity import sensitivities as sensitivities_of
from planner.plan.spec_to_trajectory import aided, flight_path, on_its_day, trajectory_of
from planner.plan.task import Task, planning_task
from planner.spec.height_aid import unaided
from planner.spec.load import LoadedSpec
from planner.spec.model import Given, Spec


@dataclass(frozen=True)
class Navigation:
    """What the requirements ask of the sensors: errors, their sensitivities, the constraints."""

    models: tuple[ErrorModel, ...]
    sensitivities: Sensitivities | None
    constraints: tuple[Constraint, ...]
    trajectory: str
    flight: Trajectory | None = None

    @property
    def unaided(self) -> str | None:
        """What becomes of the height of a long flight that nothing holds."""
        t = self.flight
        return None if t is None or t.height_aid_m is not None else unaided(float(t.time_s[-1] - t.time_s[0]))


def navigate(loaded: LoadedSpec, progress: Progress) -> Navigation:
    """Spec → errors, sensitivities on its trajectory (unless they are given), constraints."""
    spec = loaded.spec
    models = error_models(spec)
    if isinstance(spec.sensitivities, Given):
        return Navigation(models, None, constraints_of(spec, None), "published coefficients")
    progress("building the trajectory")
    trajectory = flight_path(spec, loaded.folder)
    progress("propagating the sensor errors")
    flown = on_its_day(trajectory, spec)  # before there is a campaign, which may take some days more
    found = sensitivities_of(flown, [model.name for model in models], instants=instants_of(spec))
    return Navigation(models, found, constraints_of(spec, found), trajectory.name, trajectory)


def sensitivity(
    loaded: LoadedSpec, flight: Path | None, progress: Progress, *, at: float | None = None
) -> Sensitivities:
    """The linear-combination coefficients on the spec's trajectory, or on a flight from a file.

    at: a time of interest in seconds, at which the history then has an instant
    """
    choice = loaded.spec.trajectory if flight is None else {"file": str(flight.resolve())}
    progress("building the trajectory")
    trajectory = on_its_day(aided(trajectory_of(choice, loaded.folder), loaded.spec), loaded.spec)
    progress("propagating the sensor errors")
    instants = [*instants_of(loaded.spec), *([] if at is None else [at])]
    inside = [t for t in instants if trajectory.time_s[0] <= t <= trajectory.time_s[-1]]
    return sensitivities_of(trajectory, asked_errors(loaded.spec), instants=inside)


def asked_errors(spec: Spec) -> list[str]:
    """Bias and scale factor of both sensors always, then whatever else the spec speaks of."""
    basic = [f"{s}.{e}" for e in ("bias", "scale_factor") for s in ("gyro", "accelerometer")]
    return list(dict.fromkeys([*basic, *(model.name for model in error_models(spec))]))


def instants_of(spec: Spec) -> list[float]:
    """The times in seconds at which requirements ask, where they say one."""
    return [float(r.at) for r in spec.requirement if not isinstance(r.at, str)]


def task_of(spec: Spec, navigation: Navigation) -> Task:
    """What may be chosen, temperatures and repeats, and what each choice costs and leaves of the errors.

    Raises InputError when an error that the tests calibrate is unobservable in every campaign.
    """
    refuse_what_no_campaign_observes(spec)
    menus = error_menus(spec, navigation.models, point_menus(spec))
    return planning_task(spec, navigation.models, menus, navigation.constraints)
