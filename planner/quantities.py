"""Field types for what a user writes: text with a unit in the file, SI in the model, a pattern for editors.

Every type refuses a number without its unit, a unit of another dimension, nan and inf.
"""

from __future__ import annotations

import re
from datetime import date
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from planner.errors import Unfit
from planner.units import Quantity, UnitError, parse, to_degc, to_si

NUMBER_PATTERN = r"[+-]?([0-9]+([_ ][0-9]{3})*\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?"
QUANTITY_PATTERN = rf"^\s*{NUMBER_PATTERN}\s*([A-Za-zµμ%°(]|1/).*$"
TEMPERATURE_PATTERN = rf"^\s*{NUMBER_PATTERN}\s*(deg ?C|°C|C|celsius|K|kelvin)\s*$"
MOST_COUNTED = 1_000_000
LONGEST_S = 100 * 365.25 * 86400  # nobody plans a campaign, or a unit, of more than a century


def quantity(unit: str, example: str) -> Any:
    """Annotation of a float field: read in any unit of `unit`'s dimension, SI inside."""

    def read(value: object) -> float:
        try:
            return to_si(value, unit)
        except UnitError as error:
            raise Unfit("P111", _with_advice(str(error), f"e.g. '{example}'")) from None

    return BeforeValidator(read)


def schema(example: str, pattern: str = QUANTITY_PATTERN) -> Any:
    """What an editor is told of such a field."""
    return WithJsonSchema(
        {
            "type": "string",
            "pattern": pattern,
            "description": f"number with unit, e.g. {example}",
            "examples": [example],
        }
    )


def _with_advice(message: str, advice: str) -> str:
    return message if "write" in message else f"{message}; write {advice}"


def _temperature(value: object) -> float:
    try:
        return to_degc(value)
    except UnitError as error:
        raise Unfit("P111", str(error)) from None


def _quantity(value: object) -> Quantity:
    if isinstance(value, Quantity):
        return value
    try:
        return parse(value)
    except UnitError as error:
        raise Unfit("P111", _with_advice(str(error), "a number with its unit")) from None


def _count(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int):
        raise Unfit("P107", f"{_brief(value)} is not a whole number")
    return value


def _power_ons(value: object) -> object:
    """All that is expected in one sentence: of 0 power-ons and of half of one the same is to be said."""
    whole = isinstance(value, int) and not isinstance(value, bool)
    if whole and 2 <= value <= MOST_COUNTED:  # type: ignore[operator]  # whole says that it is an int
        return value
    raise Unfit(
        "P108" if whole else "P107",
        f"{_brief(value)} is no number of power-ons that a spread is estimated from: a whole number, not "
        f"less than 2 and not more than {MOST_COUNTED}; write e.g. 12, or leave it out where the "
        "spread is known",
    )


def _number(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise Unfit("P107", f"{_brief(value)} is not a number")
    return value


def _switch(value: object) -> object:
    if not isinstance(value, bool):
        raise Unfit("P107", f"{_brief(value)} is neither true nor false")
    return value


def _brief(value: object) -> str:
    kinds = {type(None): "nothing", list: "a list", dict: "a mapping"}
    return kinds.get(type(value)) or (repr(value) if isinstance(value, str) else str(value).lower())[:60]


def _within_a_century(value: float) -> float:
    if value > LONGEST_S:
        raise Unfit("P108", "is longer than a century")
    return value


def _proper_share(value: float) -> float:
    if not 0 < value < 1:
        raise Unfit("P108", "must lie between 0 % and 100 %, both excluded; write e.g. '95 %'")
    return value


WEEKDAYS = ("mon", "tue", "wed", "thu", "fri", "sat", "sun")
DAY_S = 86400.0
CLOCK_PATTERN = r"^([01]?[0-9]|2[0-4]):[0-5][0-9]$"
MOMENT_PATTERN = r"^(mon|tue|wed|thu|fri|sat|sun) ([01]?[0-9]|2[0-3]):[0-5][0-9]$"
DATED_PATTERN = r"^[12][0-9]{3}-[01][0-9]-[0-3][0-9] ([01]?[0-9]|2[0-3]):[0-5][0-9]$"
FIRST_MONDAY = date(1970, 1, 5)  # from which a moment with a date counts


def _clock(value: object) -> object:
    if isinstance(value, float):
        return value
    if not isinstance(value, str) or not re.search(CLOCK_PATTERN, value) or value.endswith("\n"):
        raise Unfit("P114", f"{_brief(value)} is no time of day; write e.g. '08:00'")
    hours, minutes = value.split(":")
    seconds = 3600.0 * int(hours) + 60.0 * int(minutes)
    if seconds > DAY_S:
        raise Unfit("P114", f"{value!r} is after midnight; a day ends at '24:00'")
    return seconds


def _moment(value: object) -> object:
    if isinstance(value, float):
        return value
    text = value if isinstance(value, str) and not value.endswith("\n") else ""
    day, _, clock = text.partition(" ")
    if re.search(DATED_PATTERN, text):
        return (date_of(day) - FIRST_MONDAY).days * DAY_S + float(str(_clock(clock)))
    if not re.search(MOMENT_PATTERN, text):
        raise Unfit(
            "P114", f"{_brief(value)} is no moment; write e.g. 'mon 08:00', or with a date '2026-12-21 08:00'"
        )
    return week_seconds(text)


def week_seconds(words: str) -> float:
    """Seconds from Monday 00:00 to `tue 08:30`."""
    day, clock = words.split()
    hours, minutes = clock.split(":")
    return DAY_S * WEEKDAYS.index(day) + 3600.0 * int(hours) + 60.0 * int(minutes)


def week_words(seconds: float) -> str:
    """`tue 08:30`, so many seconds from Monday 00:00."""
    day, rest = divmod(seconds, DAY_S)
    return f"{WEEKDAYS[int(day)]} {int(rest // 3600):02d}:{int(rest % 3600 // 60):02d}"


def date_of(text: str) -> date:
    """A day such as 2026-12-24. Raises Unfit for what is none."""
    try:
        found = date.fromisoformat(text) if re.fullmatch(r"\d{4}-\d{2}-\d{2}", text) else None
    except ValueError:
        found = None
    if found is None or not 1980 <= found.year <= 2200:
        raise Unfit("P114", f"{_brief(text)} is no date; write e.g. 2026-12-24")
    return found


_Time = Annotated[float, AfterValidator(_within_a_century), quantity("s", "15 min"), schema("15 min")]
Seconds = Annotated[_Time, Field(ge=0)]
PositiveSeconds = Annotated[_Time, Field(gt=0)]
Share = Annotated[float, AfterValidator(_proper_share), quantity("%", "95 %"), schema("95 %")]
Celsius = Annotated[float, BeforeValidator(_temperature), schema("-55 degC", TEMPERATURE_PATTERN)]
KelvinPerSecond = Annotated[float, quantity("K/min", "4 K/min"), Field(gt=0), schema("4 K/min")]
Kelvin = Annotated[float, quantity("K", "2 K"), Field(ge=0), schema("2 K")]
PositiveKelvin = Annotated[float, quantity("K", "40 K"), Field(gt=0), schema("40 K")]
Rate = Annotated[float, quantity("deg/s", "100 deg/s"), schema("100 deg/s")]
PositiveRate = Annotated[float, quantity("deg/s", "600 deg/s"), Field(gt=0), schema("600 deg/s")]
PositiveAngularAcceleration = Annotated[
    float, quantity("deg/s/s", "500 deg/s/s"), Field(gt=0), schema("500 deg/s/s")
]
Angle = Annotated[float, quantity("deg", "90 deg"), schema("90 deg")]
NonNegativeAngle = Annotated[float, quantity("deg", "0.02 deg"), Field(ge=0), schema("0.02 deg")]
PositiveAngle = Annotated[float, quantity("deg", "0.1 deg"), Field(gt=0), schema("0.1 deg")]
NonNegativeRatio = Annotated[float, quantity("ppm", "20 ppm"), Field(ge=0), schema("20 ppm")]
Acceleration = Annotated[float, quantity("g", "50 g"), schema("50 g")]
PositiveAcceleration = Annotated[float, quantity("g", "100 g"), Field(gt=0), schema("100 g")]
Metres = Annotated[float, quantity("m", "1.5 m"), schema("1.5 m")]
NonNegativeMetres = Annotated[float, quantity("m", "10 m"), Field(ge=0), schema("10 m")]
PositiveMetres = Annotated[float, quantity("m", "1.5 m"), Field(gt=0), schema("1.5 m")]
AnyQuantity = Annotated[Quantity, BeforeValidator(_quantity), schema("0.002 deg/s")]
Count = Annotated[int, BeforeValidator(_count), Field(ge=1, le=MOST_COUNTED)]
CountOrNone = Annotated[int, BeforeValidator(_count), Field(ge=0, le=MOST_COUNTED)]
NumberOfPowerOns = Annotated[int, BeforeValidator(_power_ons), Field(ge=2, le=MOST_COUNTED)]
Whole = Annotated[int, BeforeValidator(_count), Field(ge=0, le=2**63 - 1)]
Number = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Switch = Annotated[bool, BeforeValidator(_switch)]
Weekday = Literal["mon", "tue", "wed", "thu", "fri", "sat", "sun"]
ClockTime = Annotated[
    float,
    BeforeValidator(_clock),
    WithJsonSchema({"type": "string", "pattern": CLOCK_PATTERN, "examples": ["08:00"]}),
]
WeekMoment = Annotated[
    float,
    BeforeValidator(_moment),
    WithJsonSchema(
        {
            "type": "string",
            "pattern": f"{MOMENT_PATTERN}|{DATED_PATTERN}",
            "examples": ["mon 08:00", "2026-12-21 08:00"],
        }
    ),
]
