"""The small YAML map of a raw recording: which column is what, in which unit, on which axis, with which sign.

    value = ± ((reading − zero) · scale + offset) in `unit`;   sensitivity: readings per unit, is 1 / scale

unit: imu7                    # of the inertial unit; default: the file's name
rate: 1000 Hz                 # needed when no column holds the time
time: {column: timestamp, unit: us}
gyro: {x: -gyr_y, y: gyr_x, z: 3, unit: deg/s}     # a minus turns the sign; a number counts columns from 1
acc: {x: acc_x, y: acc_y, z: acc_z, unit: g, zero: [12, -30, 5], sensitivity: 2048}
temperature: {column: T1, unit: degC, scale: 0.01, offset: 20}
ref_rate: {x: 0 deg/s, y: 0 deg/s, z: table_rate, unit: deg/s}

`planner reduce --map-help` tells every key.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, Tag, ValidationError, WithJsonSchema

from planner.errors import Fault, InputError, unusable_file
from planner.nouns.given_files import COLUMN_MAP
from planner.quantities import Acceleration, Number, PositiveSeconds, Rate, Seconds, Switch, quantity, schema
from planner.spec.forms import mapping_or_text, of_forms
from planner.spec.part import SpecPart
from planner.units import UnitError, dimension_of, parse, unit_factor

AXES = ("x", "y", "z")
SENSOR_KEYS = ("gyro", "acc", "ref_rate", "ref_acc")
DIMENSION = {"gyro": "deg/s", "acc": "m/s^2", "ref_rate": "deg/s", "ref_acc": "m/s^2", "time": "s"}
ISO, CLOCK = "iso", "clock"  # times that are dates, or hours:minutes:seconds
_SPELLINGS = {"dps": "deg/s", "mdps": "mdeg/s", "degps": "deg/s", "mps2": "m/s^2", "mss": "m/s^2", "G": "g"}


def _source(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, str | int) or value in ("", "-", 0):
        raise ValueError("must be the name or the number of a column, with a minus to turn its sign")
    return value


def _per_axis(value: object) -> object:
    """Three numbers from one, from a list, or from x, y, z."""
    if isinstance(value, dict):
        if set(value) != set(AXES):
            raise ValueError("must be one number, three in a list, or x, y and z")
        value = [value[axis] for axis in AXES]
    found: list[Any] = list(value) if isinstance(value, list | tuple) else [value] * 3
    if len(found) != 3 or any(isinstance(x, bool) or not isinstance(x, int | float) for x in found):
        raise ValueError("must be one number, three in a list, or x, y and z")
    return tuple(float(x) for x in found)


_ONE_OR_THREE = {
    "oneOf": [
        {"type": "number"},
        {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
        {
            "type": "object",
            "properties": {axis: {"type": "number"} for axis in AXES},
            "required": list(AXES),
            "additionalProperties": False,
        },
    ]
}
Source = Annotated[str | int, BeforeValidator(_source)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
PerAxis = Annotated[tuple[Finite, Finite, Finite], BeforeValidator(_per_axis), WithJsonSchema(_ONE_OR_THREE)]
FileName = Annotated[
    str | dict[str, str],
    Field(
        description="another file of the same run, beside the recording; or {_acc: _gyro}: the "
        "recording's name with that part replaced"
    ),
]
Where = Annotated[
    dict[str, str | int | float],
    Field(description="rows of the file that count: column -> what must stand there"),
]


class OneColumn(SpecPart):
    """One column: (reading − zero) · scale + offset, in `unit`."""

    column: Source = Field(description="name, or number from 1; a minus turns the sign")
    unit: str = Field(description="unit of the readings after scale and offset")
    scale: Number = 1.0
    offset: Number = 0.0
    zero: Number = Field(0.0, description="reading that means zero; taken off before the scale")
    file: FileName | None = None
    where: Where = Field(default_factory=dict)


class TimeColumn(SpecPart):
    """The column of the time: a number in `unit`, or text."""

    column: Source = Field(description="name, or number from 1")
    unit: str = Field(
        description="s, ms, us, ns, min, h, day; iso for dates such as 2026-03-01T12:00:00.5Z; clock for "
        "12:00:00.5; or a pattern such as %d.%m.%Y %H:%M:%S.%f"
    )
    scale: Number = 1.0
    offset: Number = 0.0
    plus: OneColumn | None = Field(None, description="a second column to add, as the nanoseconds of ROS")
    wraps: Number | None = Field(
        None, description="the counter begins again at this many counts, as 4294967296", gt=0
    )


class AxisColumns(SpecPart):
    """Three columns, one for each body axis: ± ((reading − zero) · scale + offset), in `unit`."""

    x: Source
    y: Source
    z: Source
    unit: str
    scale: PerAxis = Field((1.0, 1.0, 1.0), description="units in one count; one number, or one an axis")
    sensitivity: PerAxis | None = Field(None, description="counts in one unit, instead of scale")
    zero: PerAxis = Field((0.0, 0.0, 0.0), description="reading that means zero, in counts")
    offset: PerAxis = Field((0.0, 0.0, 0.0), description="added after the scale, in `unit`")
    file: FileName | None = None
    time: TimeColumn | None = Field(None, description="of that other file; default: as the recording's")
    where: Where = Field(default_factory=dict)

    @property
    def scales(self) -> tuple[float, float, float]:
        """Units in one count of x, y, z."""
        if self.sensitivity is None:
            return self.scale
        x, y, z = self.sensitivity
        return 1.0 / x, 1.0 / y, 1.0 / z


class FullScale(SpecPart):
    """Readings at these are saturated."""

    gyro: Rate | None = Field(None, description="of the gyros, as 2000 deg/s")
    acc: Acceleration | None = Field(None, description="of the accelerometers, as 16 g")


class PowerOns(SpecPart):
    """How the power-ons of one file are told apart; one of column, gap and clock."""

    column: Source | None = Field(None, description="a new text in it is another power-on")
    gap: PositiveSeconds | None = Field(None, description="a longer gap in time is one")
    clock: Literal["restarts"] | None = Field(None, description="restarts: where the time falls there is one")
    first: int = Field(1, description="number of the first power-on")


class UnitColumn(SpecPart):
    """The column that names the inertial unit of a row."""

    column: Source


_PlanTime = Annotated[
    Annotated[Seconds, Tag("text")] | Annotated[dict[str, Seconds], Field(min_length=1), Tag("mapping")],
    of_forms(
        "must be a time such as 30 s, or one for each file, {run_1.bin: 0 s, run_2.bin: 480 s}",
        mapping_or_text,
    ),
]


class ColumnMap(SpecPart):
    """What a raw recording holds and how to reduce it."""

    planner: int | None = None
    format: str | None = Field(None, description="name of the reader; default: by the file")
    skip_lines: int = Field(0, ge=0, description="lines above the header that are no comments")
    unit: str | UnitColumn | None = Field(None, description="of the inertial unit; default: the file's name")
    run: int | PowerOns = Field(
        1, description="number of the first file's power-on; or how those of one file are told apart"
    )
    day: Number | None = Field(None, description="days since the first calibration")
    time_on: Seconds | None = Field(None, description="seconds since power-on at the first sample")
    rate: Annotated[float, quantity("Hz", "1000 Hz"), schema("1000 Hz")] | None = None
    time: TimeColumn | None = None
    gyro: AxisColumns | None = None
    acc: AxisColumns | None = None
    temperature: OneColumn | None = None
    ref_rate: AxisColumns | None = None
    ref_acc: AxisColumns | None = None
    step: Source | None = Field(None, description="column that names the plan's step of each sample")
    records: Literal["rests", "step", "plan", "whole"] | None = Field(
        None,
        description="rests: found; step: from the column; plan: by the plan's times; whole: a power-on each",
    )
    plan_time: _PlanTime = Field(
        0.0, description="time on the plan's clock at the first sample; of several files, {run_1.bin: 0 s, …}"
    )
    shortest: PositiveSeconds = Field(1.0, description="shorter rests are left out")
    record: PositiveSeconds | None = Field(None, description="longer rests are cut; default: by Allan")
    motions: Switch = Field(
        True, description="whether hand turns between rests are kept, for rests_and_turns"
    )
    full_scale: FullScale = FullScale()

    def plan_time_of(self, path: Path) -> float:
        """s on the plan's clock at a file's first sample. Raises InputError for a file that has none."""
        if isinstance(self.plan_time, float):
            return self.plan_time
        if path.name not in self.plan_time:
            raise InputError(f"{path}: the map's plan_time does not name it; add '{path.name}: 0 s'")
        return self.plan_time[path.name]

    @property
    def first_run(self) -> int:
        """The number of the first power-on."""
        return self.run if isinstance(self.run, int) else self.run.first

    @property
    def parts(self) -> dict[str, AxisColumns | OneColumn]:
        """Key -> what it says, of the sensors, references and temperature that there are."""
        found = {key: getattr(self, key) for key in (*SENSOR_KEYS, "temperature")}
        return {key: part for key, part in found.items() if part is not None}


def read_map(path: Path) -> ColumnMap:
    """The map of a YAML file. Raises InputError with every fault at its line."""
    from planner.spec.yaml12 import MAX_BYTES

    try:
        with Path(path).open("rb") as file:
            return map_of(file.read(MAX_BYTES + 1), path)
    except OSError as error:
        raise unusable_file(path, error, COLUMN_MAP) from error


def map_of(text: bytes, path: Path) -> ColumnMap:
    """The map of a YAML text that stands, or would stand, in a file. Raises InputError with every fault."""
    from planner.spec.sentences import faults_of
    from planner.spec.yaml12 import read_yaml

    document = read_yaml(text, str(path))
    if not isinstance(document.value, dict):
        raise unusable_file(path, "is no map of columns" if text.strip() else "is empty", COLUMN_MAP)
    try:
        found = ColumnMap.model_validate(document.value)
    except ValidationError as error:
        faults = [fault for _, fault in faults_of(error, document, document.value, ColumnMap)]
        raise InputError(f"{Path(path).name} cannot be used", faults) from None
    wrong = [Fault(str(path), 0, 0, *said, "P711") for said in contradictions(found)]
    if wrong:
        raise InputError(f"{Path(path).name} cannot be used", wrong)
    return found


def contradictions(columns: ColumnMap) -> list[tuple[str, str]]:
    """(key, sentence) of what the map's form alone does not show."""
    found = []
    if columns.gyro is None and columns.acc is None:
        found.append(("gyro", "neither gyro nor acc is named; name at least one"))
    if columns.time is None and columns.rate is None and not _own_times(columns):
        found.append(("rate", "missing; give the sampling rate, like 1000 Hz, or the column of the time"))
    if columns.rate is not None and columns.rate <= 0:
        found.append(("rate", "must be more than 0 Hz"))
    if columns.records == "step" and columns.step is None:
        found.append(("step", "missing; name the column that holds the plan's steps"))
    for key in SENSOR_KEYS:
        part = getattr(columns, key)
        if part is not None:
            found += [(f"{key}.{where}", said) for where, said in _odd_triad(part, DIMENSION[key])]
    found += [(f"time.{where}", said) for where, said in _odd_time(columns.time)]
    temperature = columns.temperature
    if temperature is not None and plain_unit(temperature.unit) not in ("degC", "K", "degF"):
        found.append(("temperature.unit", f"{temperature.unit!r} must be degC, K or degF"))
    return [*found, *_odd_runs(columns)]


def _own_times(columns: ColumnMap) -> bool:
    sensors = [part for part in (columns.gyro, columns.acc) if part is not None]
    return bool(sensors) and all(part.time is not None for part in sensors)


def _odd_triad(part: AxisColumns, like: str) -> list[tuple[str, str]]:
    found = []
    if said := _wrong_unit(part.unit, like):
        found.append(("unit", said))
    if part.sensitivity is not None and part.scale != (1.0, 1.0, 1.0):
        found.append(("sensitivity", "is 1/scale; give one of the two"))
    for key, values in (("scale", part.scale), ("sensitivity", part.sensitivity or (1.0,))):
        if 0.0 in values:
            found.append((key, "must not be 0"))
    return [*found, *((f"time.{where}", said) for where, said in _odd_time(part.time))]


def _odd_time(time: TimeColumn | None) -> list[tuple[str, str]]:
    if time is None:
        return []
    found = []
    if not is_written_time(time.unit) and (said := _wrong_unit(time.unit, "s")):
        found.append(("unit", f"{said}, or iso, clock, or a pattern like %H:%M:%S.%f"))
    if is_written_time(time.unit) and (time.scale, time.offset, time.wraps) != (1.0, 0.0, None):
        found.append(("unit", "a written time has no scale, offset or wraps"))
    if time.plus is not None and (said := _wrong_unit(time.plus.unit, "s")):
        found.append(("plus.unit", said))
    return found


def _odd_runs(columns: ColumnMap) -> list[tuple[str, str]]:
    runs = columns.run
    if isinstance(runs, int):
        return []
    told = [key for key in ("column", "gap", "clock") if getattr(runs, key) is not None]
    if len(told) != 1:
        return [("run", "give one of column, gap, clock: what tells one power-on from the next")]
    if told[0] in ("gap", "clock") and columns.time is None:
        return [(f"run.{told[0]}", "needs the column of the time")]
    return []


def _wrong_unit(unit: str, like: str) -> str:
    try:
        right = dimension_of(plain_unit(unit)) == dimension_of(like)
    except UnitError as error:
        return str(error)
    return "" if right else f"{unit!r} has the wrong dimension; expected one like {like}"


def is_written_time(unit: str) -> bool:
    """Whether times are text: dates, hours:minutes:seconds, or of a pattern."""
    return unit.lower() in (ISO, CLOCK) or "%" in unit


def plain_unit(unit: str) -> str:
    """A unit as `units` writes it, from spellings of data sheets: `dps`, `m/s2`, `°/s`, `°C`."""
    text = unit.strip().replace("°", "deg").replace("º", "deg")
    text = _SPELLINGS.get(text.replace(" ", ""), text)
    text = re.sub(r"\b(s|sec)2\b", "s^2", text)
    return text.replace(" ", "") if re.fullmatch(r"deg ?[CF]", text) else text


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
    return quantity.si if quantity.dimension == dimension_of(plain_unit(unit)) else None


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
    return unit_factor(plain_unit(unit))[0]
