"""The small YAML map of a raw recording: which column is what, in which unit, on which axis, with which sign.

unit: imu7                    # of the inertial unit; default: the file's name
rate: 1000 Hz                 # needed when no column holds the time
time: {column: timestamp, unit: us}
gyro: {x: -gyr_y, y: gyr_x, z: 3, unit: deg/s}     # a minus turns the sign; a number counts columns from 1
acc: {x: acc_x, y: acc_y, z: acc_z, unit: m/s^2, scale: 0.001}
temperature: {column: T1, unit: degC, scale: 0.01, offset: 20}
ref_rate: {x: 0 deg/s, y: 0 deg/s, z: table_rate, unit: deg/s}
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationError

from planner.errors import Fault, InputError
from planner.quantities import Acceleration, Number, PositiveSeconds, Rate, Seconds, quantity
from planner.spec.part import SpecPart
from planner.units import UnitError, dimension_of, parse, unit_factor

AXES = ("x", "y", "z")
DIMENSION = {"gyro": "deg/s", "acc": "m/s^2", "ref_rate": "deg/s", "ref_acc": "m/s^2", "time": "s"}


def _source(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, str | int) or value in ("", "-", 0):
        raise ValueError("must be the name or the number of a column, with a minus to turn its sign")
    return value


Source = Annotated[str | int, BeforeValidator(_source)]


class OneColumn(SpecPart):
    """One column: reading · scale + offset, in `unit`."""

    column: Source = Field(description="name, or number from 1; a minus turns the sign")
    unit: str = Field(description="unit of the readings after scale and offset")
    scale: Number = 1.0
    offset: Number = 0.0


class AxisColumns(SpecPart):
    """Three columns, one for each body axis: reading · scale, in `unit`."""

    x: Source
    y: Source
    z: Source
    unit: str
    scale: Number = 1.0


class FullScale(SpecPart):
    """Readings at these are saturated."""

    gyro: Annotated[Rate | None, Field()] = None
    acc: Annotated[Acceleration | None, Field()] = None


class ColumnMap(SpecPart):
    """What a raw recording holds and how to reduce it."""

    planner: int | None = None
    format: str | None = Field(None, description="name of the reader; default: by the file")
    skip_lines: int = Field(0, ge=0, description="lines above the header that are no comments")
    unit: str | None = Field(None, description="of the inertial unit; default: the file's name")
    run: int = Field(1, description="number of the first file's power-on; each further file is the next")
    day: Number | None = Field(None, description="days since the first calibration")
    time_on: Seconds | None = Field(None, description="seconds since power-on at the first sample")
    rate: Annotated[float, quantity("Hz", "1000 Hz")] | None = None
    time: OneColumn | None = None
    gyro: AxisColumns | None = None
    acc: AxisColumns | None = None
    temperature: OneColumn | None = None
    ref_rate: AxisColumns | None = None
    ref_acc: AxisColumns | None = None
    step: Source | None = Field(None, description="column that names the plan's step of each sample")
    records: Literal["rests", "step", "plan"] | None = Field(
        None, description="rests: found; step: from the column; plan: from the plan's times"
    )
    plan_time: Seconds = Field(0.0, description="time on the plan's clock at the first sample")
    shortest: PositiveSeconds = Field(1.0, description="shorter rests are left out")
    record: PositiveSeconds | None = Field(None, description="longer rests are cut; default: by Allan")
    full_scale: FullScale = FullScale()


def read_map(path: Path) -> ColumnMap:
    """The map of a YAML file. Raises InputError with every fault at its line."""
    from planner.spec.sentences import faults_of
    from planner.spec.yaml12 import MAX_BYTES, read_yaml

    try:
        with Path(path).open("rb") as file:
            document = read_yaml(file.read(MAX_BYTES + 1), str(path))
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    if not isinstance(document.value, dict):
        raise InputError(f"{path} is no map of columns; it is lines of 'key: value'")
    try:
        found = ColumnMap.model_validate(document.value)
    except ValidationError as error:
        faults = [fault for _, fault in faults_of(error, document, document.value, ColumnMap)]
        raise InputError(f"{Path(path).name} cannot be used", faults) from None
    wrong = [Fault(str(path), 0, 0, *said) for said in contradictions(found)]
    if wrong:
        raise InputError(f"{Path(path).name} cannot be used", wrong)
    return found


def contradictions(columns: ColumnMap) -> list[tuple[str, str]]:
    """(key, sentence) of what the map's form alone does not show."""
    found = []
    if columns.gyro is None and columns.acc is None:
        found.append(("gyro", "neither gyro nor acc is named; name at least one"))
    if columns.time is None and columns.rate is None:
        found.append(("rate", "missing; give the sampling rate, like 1000 Hz, or the column of the time"))
    if columns.rate is not None and columns.rate <= 0:
        found.append(("rate", "must be more than 0 Hz"))
    if columns.records == "step" and columns.step is None:
        found.append(("step", "missing; name the column that holds the plan's steps"))
    for key, like in DIMENSION.items():
        part = getattr(columns, key)
        if part is not None and (said := _wrong_unit(part.unit, like)):
            found.append((f"{key}.unit", said))
    temperature = columns.temperature
    if temperature is not None and temperature.unit.replace("°", "deg").replace(" ", "") not in ("degC", "K"):
        found.append(("temperature.unit", f"{temperature.unit!r} must be degC or K"))
    return found


def _wrong_unit(unit: str, like: str) -> str:
    try:
        right = dimension_of(unit) == dimension_of(like)
    except UnitError as error:
        return str(error)
    return "" if right else f"{unit!r} has the wrong dimension; expected one like {like}"


def unsigned(source: str | int) -> tuple[float, str | int]:
    """(sign, column) of a source: `-gyr_y` -> (−1, `gyr_y`), -4 -> (−1, 4)."""
    if isinstance(source, int):
        return (-1.0, -source) if source < 0 else (1.0, source)
    return (-1.0, source[1:].strip()) if source.startswith("-") else (1.0, source.strip())


def constant(source: str | int, unit: str) -> float | None:
    """SI value of a source that is a quantity, such as `-1 g`; None for a column."""
    if isinstance(source, int) or not re.match(r"[-+]?[\d.]+\s*\S*[A-Za-z°%]", source):
        return None
    try:
        quantity = parse(source)
    except UnitError:
        return None
    return quantity.si if quantity.dimension == dimension_of(unit) else None


def standard_map(names: tuple[str, ...]) -> ColumnMap | None:
    """The map of a recording whose columns are named as a dwell table's; None when they are not."""
    known = set(names)

    def triad(pattern: str, unit: str) -> dict[str, Any] | None:
        columns = {axis: pattern.format(axis) for axis in AXES}
        return columns | {"unit": unit} if known.issuperset(columns.values()) else None

    given: dict[str, Any] = {
        "time": {"column": "time_s", "unit": "s"} if "time_s" in known else None,
        "gyro": triad("gyro_{}_dps", "deg/s"),
        "acc": triad("acc_{}_g", "g"),
        "ref_rate": triad("ref_rate_{}_dps", "deg/s"),
        "ref_acc": triad("ref_acc_{}_g", "g"),
        "temperature": {"column": "temp_degc", "unit": "degC"} if "temp_degc" in known else None,
        "step": "step" if "step" in known else None,
    }
    if given["time"] is None or (given["gyro"] is None and given["acc"] is None):
        return None
    return ColumnMap.model_validate({key: value for key, value in given.items() if value is not None})


def factor(unit: str) -> float:
    """SI value of one `unit`."""
    return unit_factor(unit)[0]
