"""Rules for the requirement, the trajectory, given sensitivities and the declared effects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError

from planner import catalog
from planner.effects._shaped import plain_name
from planner.errors import InputError
from planner.protocols import SENSORS
from planner.spec.height_aid import unaided
from planner.spec.model import NAVIGATION_ERRORS, Given
from planner.spec.places import did_you_mean
from planner.spec.references import Vertical
from planner.spec.review import Review
from planner.spec.sentences import faults_of
from planner.spec.yaml12 import Path
from planner.units import Quantity, UnitError, check_unit, dimension_of


def unit_of(error: str) -> str | None:
    """Display unit of `gyro.bias`; None when there is no such error."""
    sensor, _, name = error.partition(".")
    effect = catalog.effects().get(name)
    return effect.units[sensor] if effect is not None and sensor in effect.sensors else None


def all_errors() -> list[str]:
    """Every `<sensor>.<effect>` there is."""
    return [
        f"{sensor}.{name}"
        for name, e in catalog.effects().items()
        for sensor in SENSORS
        if sensor in e.sensors
    ]


def wrong_unit(quantity: Quantity, unit: str, example: str | None = None) -> str | None:
    """What is wrong with a quantity's unit, or None."""
    try:
        check_unit(quantity, unit, example)
    except UnitError as error:
        return str(error)
    return None


def requirements(sheet: Review) -> None:
    """A limit has the unit of its error and is greater than zero."""
    examples = {"m": "10 m", "m/s": "2 m/s", "deg": "0.5 deg"}
    for index, requirement in sheet.requirements():
        path = (*sheet.item(("requirement",), index), "limit")
        unit = NAVIGATION_ERRORS[requirement.error]
        if not sheet.whole(*path[:-1], "error"):
            continue
        wrong = wrong_unit(requirement.limit, unit, examples[unit])
        if wrong:
            sheet.fault("P201", path, wrong)
        elif requirement.limit.si <= 0:
            sheet.fault("P202", path, f"a limit must be greater than zero; write e.g. '{examples[unit]}'")


def trajectory(sheet: Review) -> None:
    """The flight is one that we have, with its own parameters, or a file that is there."""
    flight = sheet.spec.trajectory
    if isinstance(flight, str):
        _family(sheet, flight, ("trajectory",), {})
    elif isinstance(flight, dict) and "name" not in flight and "file" not in flight:
        sheet.fault("P211", ("trajectory",), "needs the name of a built-in flight, or {file: flight.csv}")
    elif isinstance(flight, dict):
        settings = {key: value for key, value in flight.items() if key not in ("name", "vertical")}
        _height_aid(sheet, flight)
        _family(sheet, flight.get("name", "file"), ("trajectory", "name"), settings)


def _height_aid(sheet: Review, flight: dict[str, Any]) -> None:
    """`vertical` may stand in the trajectory, too; once in all."""
    if "vertical" not in flight:
        return
    path = ("trajectory", "vertical")
    if sheet.spec.vertical is not None:
        sheet.fault("P212", path, "the spec has 'vertical' beside the trajectory; keep one", key=True)
    try:
        Vertical.model_validate(flight["vertical"])
    except ValidationError as error:
        written = flight["vertical"]
        sheet.faults += [f for _, f in faults_of(error, sheet.document, written, Vertical, path)]


def _family(sheet: Review, name: object, path: Path, settings: dict[str, Any]) -> None:
    families = catalog.trajectories()
    if not isinstance(name, str) or name not in families:
        sheet.fault("P213", path, f"unknown trajectory{did_you_mean(name, families)}")
        return
    model = families[name].parameters
    try:
        flown = model.model_validate(settings)
        aided = sheet.spec.vertical is not None or "vertical" in _written(sheet.spec.trajectory)
        remark = None if aided else unaided(getattr(flown, "duration", 0.0))
        if remark and not isinstance(sheet.spec.sensitivities, Given):
            sheet.warn("P214", ("trajectory",), remark, key=True)
        if not isinstance(sheet.spec.sensitivities, Given):
            _within(sheet, getattr(flown, "duration", float("inf")))
    except ValidationError as error:
        for where, fault in faults_of(error, sheet.document, settings, model, ("trajectory",)):
            if sheet.readable(("trajectory", *where)):
                sheet.faults.append(fault)
    if name == "file":
        _flight_file(sheet, settings.get("file"))


def _written(flight: object) -> dict[str, Any]:
    return flight if isinstance(flight, dict) else {}


def _flight_file(sheet: Review, name: object) -> None:
    if not isinstance(name, str):
        return  # its own field has said so
    try:
        found = bool(name.strip()) and (sheet.folder / name).is_file()
    except (OSError, ValueError):  # a name that no file system takes
        found = False
    if not found:
        sheet.fault("P215", ("trajectory", "file"), f"there is no file {name[:200]!r} beside the spec")
        return
    from planner.trajectories.file import flight_table  # reads the file; other specs need none of it

    try:
        table = flight_table(sheet.folder / name)
    except InputError as refusal:
        sheet.faults += refusal.faults
        return
    for remark in table.remarks:
        sheet.warn("P217", ("trajectory", "file"), remark)
    time = table.column("time_s")
    _within(sheet, float(time[-1] - time[0]))


def _within(sheet: Review, duration: float) -> None:
    """Requirements hold at moments of the flight."""
    for index, requirement in sheet.requirements():
        if not isinstance(requirement.at, str) and requirement.at > duration:
            path = (*sheet.item(("requirement",), index), "at")
            sheet.fault("P218", path, f"{requirement.at:g} s is after the end of the flight, {duration:g} s")


def sensitivities(sheet: Review) -> None:
    """Published coefficients exist for every error that matters, in metres per unit of the error."""
    source = sheet.spec.sensitivities
    if not isinstance(source, Given):
        return
    for error, coefficient in source.given.items():
        _coefficient(sheet, error, coefficient)
    for index, requirement in sheet.requirements():
        if requirement.at != "end":
            path = (*sheet.item(("requirement",), index), "at")
            sheet.fault(
                "P221", path, "given sensitivities hold at the end of the flight only; leave 'at' out"
            )
    _missing_coefficients(sheet, source)


def _coefficient(sheet: Review, error: str, coefficient: Quantity) -> None:
    path = ("sensitivities", "given", error)
    unit = unit_of(error)
    if unit is None:
        sheet.fault("P222", path, f"unknown error{did_you_mean(error, all_errors())}", key=True)
        return
    if error not in sheet.budgeted() and sheet.readable(("unit",)):
        sheet.warn(
            "P223", path, "has no budget in 'unit', so it adds nothing to the navigation error", key=True
        )
    for index, requirement in sheet.requirements():
        if not sheet.whole(*sheet.item(("requirement",), index), "error"):
            continue
        goal = NAVIGATION_ERRORS[requirement.error]
        per = "%" if unit == "1" else f"({unit})" if "/" in unit else unit
        if coefficient.dimension != dimension_of(f"{goal}/{'1' if unit == '1' else per}".removesuffix("/1")):
            example = f"{coefficient.text.split()[0]} {goal}/{per}"
            sheet.fault("P224", path, f"{coefficient.text!r} has the wrong unit; expected e.g. '{example}'")
            return


def _missing_coefficients(sheet: Review, source: Given) -> None:
    known = {*source.given, *sheet.names("sensitivities", "given")}
    for error, places in sheet.calibrated().items():
        if error not in known and unit_of(error):
            message = f"{error} is calibrated, but has no coefficient; add it to sensitivities.given"
            sheet.fault("P225", places[0], message)
            known.add(error)
    for sensor, effect, path, _ in sheet.budgets():
        if f"{sensor}.{effect}" not in known:
            sheet.warn(
                "P226", path, "has no coefficient in sensitivities.given, so it adds nothing", key=True
            )


def effects_declared(sheet: Review) -> None:
    """Declared effects exist, stand once, and serve something."""
    names = sheet.spec.effects
    known = catalog.effects()
    served = {effect for _, effect, _, _ in sheet.budgets()}
    varying = {e for _, e, _, budget in sheet.budgets() if budget.temperature_residual is not None}
    for index, name in enumerate(names):
        path = ("effects", index)
        if name not in known:
            sheet.fault("P241", path, f"unknown effect '{name[:40]}'{did_you_mean(name, known)}")
        elif name in names[:index]:
            sheet.fault("P242", path, f"'{name}' is declared twice; keep one")
        elif other := _same_effect(name, names[:index]):
            sheet.fault("P242", path, f"'{name}' is '{other}' once more on the same sensor; keep one")
        elif name not in served and known[name].temperature_of not in varying and sheet.whole("unit"):
            sheet.warn(
                "P243",
                path,
                f"no budget of 'unit' speaks of '{name}', so it adds nothing to the navigation error"
                + (f"; that of '{plain_name(name)}' is another's" if plain_name(name) in served else ""),
            )


def _same_effect(name: str, before: Sequence[str]) -> str | None:
    """Another name of the same effect that acts on a sensor of this one."""
    known = catalog.effects()
    alike = (other for other in before if other in known and plain_name(other) == plain_name(name))
    return next((o for o in alike if {*known[o].sensors} & {*known[name].sensors}), None)
