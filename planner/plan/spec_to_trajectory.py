"""Stage: what the spec says of the flight in, the trajectory with its ideal readings out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from planner.catalog import trajectories
from planner.errors import Fault, InputError
from planner.nouns.trajectory import Trajectory
from planner.spec.model import Spec
from planner.spec.places import did_you_mean
from planner.spec.references import Vertical

FORMS = ("constant", "ramp")  # pydantic's names for the two ways to write a temperature; not in the spec


def flight_path(spec: Spec, folder: Path) -> Trajectory:
    """The flight of a spec as far as its requirements look, with what holds its height.

    Raises InputError as `trajectory_of` does, and for a requirement after the end of the flight.
    """
    whole = aided(trajectory_of(spec.trajectory, folder), spec)
    looks = [float("inf") if isinstance(r.at, str) else r.at for r in spec.requirement]
    long = float(whole.time_s[-1] - whole.time_s[0])
    late = [t for t in looks if long < t < float("inf")]
    if late:
        raise InputError(f"requirement at {late[0]:g} s: the flight ends at {long:g} s")
    return whole.until(max(looks)) if max(looks) < long else whole


def aided(trajectory: Trajectory, spec: Spec) -> Trajectory:
    """A flight with what the spec says of its vertical channel, beside the trajectory or in it."""
    written = spec.trajectory.get("vertical") if isinstance(spec.trajectory, dict) else None
    vertical = spec.vertical or (None if written is None else Vertical.model_validate(written))
    return trajectory if vertical is None else replace(trajectory, height_aid_m=vertical.aided)


def on_its_day(trajectory: Trajectory, spec: Spec, end_day: float = 0.0) -> Trajectory:
    """A flight on the day that it says, or else `flown_after` the end of the campaign, on `end_day`.

    What goes by the days (ageing, a step of the bias) is in flight what it has become until then.
    """
    return trajectory if trajectory.day > 0 else replace(trajectory, day=end_day + spec.flown_after_days)


def trajectory_of(choice: str | Mapping[str, Any], folder: Path) -> Trajectory:
    """The flight of a choice: a name, {name: …, parameters}, or {file: flight.csv} relative to `folder`.

    Raises InputError for an unknown family, unknown or impossible parameters, and a file that is no flight.
    """
    settings = {"name": choice} if isinstance(choice, str) else dict(choice)
    settings.pop("vertical", None)
    name = settings.pop("name", "file" if "file" in settings else None)
    families = trajectories()
    if not isinstance(name, str) or name not in families:
        what = "the trajectory has no name" if name is None else f"unknown trajectory {str(name)[:60]!r}"
        raise InputError(f"{what}{did_you_mean(name, families)}")
    family = families[name]
    return _built(family, _parameters(family.parameters, name, settings), folder)


def _built(family: Any, parameters: Any, folder: Path) -> Trajectory:
    if "file" in type(parameters).model_fields:  # what stands in a file may change
        return _flown(family, parameters.model_copy(update={"file": str(folder / parameters.file)}))
    try:
        return _flown_once(family, parameters)
    except TypeError:  # a foreign family's parameters may not be hashable
        return _flown(family, parameters)


def _flown(family: Any, parameters: Any) -> Trajectory:
    trajectory: Trajectory = family.build(parameters)
    return trajectory


# a command flies one trajectory, or compares two, and asks for it in several stages; a long one takes 0.5 GB
_flown_once = lru_cache(maxsize=2)(_flown)


def _parameters(model: type[BaseModel], name: str, settings: Mapping[str, Any]) -> BaseModel:
    try:
        return model.model_validate(settings)
    except ValidationError as error:
        raise InputError(f"trajectory {name} has wrong parameters", list(_faults(error, model))) from None


def _faults(error: ValidationError, model: type[BaseModel]) -> Iterator[Fault]:
    for detail in error.errors(include_url=False):
        where = [str(part) for part in detail["loc"] if part not in FORMS]
        path = ".".join(["trajectory", *where])
        message, code = str(detail.get("ctx", {}).get("error", detail["msg"])), "P108"
        if detail["type"] == "extra_forbidden":
            message, code = f"unknown parameter{did_you_mean(where[-1], model.model_fields)}", "P101"
        elif detail["type"] == "missing":
            message, code = "is missing", "P102"
        yield Fault("spec", 0, 0, path, message, code)
