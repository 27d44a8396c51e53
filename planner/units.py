"""Quantities at the border: text with a unit in, SI and radians inside, display units out.

The table below holds only the units of this field. Angle is a dimension here, so that `0.1 deg` is refused
where a scale factor is expected, and `g` is gravity, `mg` milli-gravity. pint with the same definitions says
the same of every spelling (`tests/test_units.py`), but takes longer to import than a spec takes to check.
Temperatures are carried as degrees Celsius everywhere (`_degc` in every name): that is what benches and
dwell tables speak, and a difference of one kelvin is one degree.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache

from planner.errors import PlannerError

STANDARD_GRAVITY_MPS2 = 9.80665  # 3rd CGPM (1901); interfaces: 1 g of every file
ZERO_CELSIUS_K = 273.15

_TURN_RAD = 2 * math.pi
_Dimensions = tuple[tuple[str, int], ...]
_LENGTH, _TIME, _ANGLE = (("length", 1),), (("time", 1),), (("angle", 1),)
_UNITS: dict[str, tuple[float, _Dimensions]] = {  # spellings -> SI value, dimensions
    spelling: (value, dimensions)
    for spellings, value, dimensions in (
        ("second s sec", 1.0, _TIME),
        ("minute min", 60.0, _TIME),
        ("hour h hr", 3600.0, _TIME),
        ("day d", 86400.0, _TIME),
        ("week", 604800.0, _TIME),
        ("metre meter m", 1.0, _LENGTH),
        ("radian rad", 1.0, _ANGLE),
        ("turn revolution rev", _TURN_RAD, _ANGLE),
        ("degree deg", math.pi / 180, _ANGLE),
        ("arcminute arcmin", math.pi / 10_800, _ANGLE),
        ("arcsecond arcsec", math.pi / 648_000, _ANGLE),
        ("kelvin K", 1.0, (("temperature", 1),)),
        ("gravity g", STANDARD_GRAVITY_MPS2, (("length", 1), ("time", -2))),
        ("one", 1.0, ()),
        ("percent", 0.01, ()),
        ("ppm", 1e-6, ()),
        ("knot kn", 1852 / 3600, (("length", 1), ("time", -1))),
        ("rpm", _TURN_RAD / 60, (("angle", 1), ("time", -1))),
        ("hertz Hz", 1.0, (("time", -1),)),
    )
    for spelling in spellings.split()
}
_PREFIXES = {"": 1.0} | {
    prefix: value
    for prefixes, value in (
        ("nano n", 1e-9),
        ("micro u µ μ", 1e-6),
        ("milli m", 1e-3),
        ("centi c", 1e-2),
        ("kilo k", 1e3),
    )
    for prefix in prefixes.split()
}

_NUMBER = r"[+-]?(?:[0-9]+(?:[_ ][0-9]{3})*\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*", re.DOTALL)
# Digits stand only in `1/…` and in exponents -3..3: no unit of this field needs more.
_NAME = r"(?!\d)\w+"
_FACTOR = rf"{_NAME}(?:\^-?[1-3])?"
_PRODUCT = rf"{_FACTOR}(?:[* ]{_FACTOR})*"
_TERM = rf"(?:{_PRODUCT}|\({_PRODUCT}(?:/{_FACTOR})*\))"
_UNIT = re.compile(rf"(?:1|{_TERM})(?:/{_TERM})*")
_PART = re.compile(rf"([*/ ()])|({_NAME})(?:\^(-?[1-3]))?")
_SPELLING = {
    "%": " percent ",
    "°": " deg ",
    "º": " deg ",
    "²": "^2",
    "³": "^3",
    "·": "*",
    "**": "^",
    "micro-g": "ug",
    "milli-g": "mg",
}
LONGEST_TEXT = 100
LARGEST = 1e18  # SI; squares and products of a few such numbers stay finite
SMALLEST = 1e-30  # SI; smaller is a slip of the exponent, and its square would vanish
HOTTEST_DEGC = 1000.0
_TEMPERATURE = {
    "degc": 0.0,
    "deg c": 0.0,
    "°c": 0.0,
    "celsius": 0.0,
    "c": 0.0,
    "k": -ZERO_CELSIUS_K,
    "kelvin": -ZERO_CELSIUS_K,
}


class UnitError(PlannerError):
    """A value is not a number with a unit of the expected dimension."""

    exit_code = 2


@dataclass(frozen=True)
class Quantity:
    """A number with its unit, converted: `si` in SI and radians; `dimension`: `[angle] / [time]`."""

    si: float
    dimension: str
    text: str

    @property
    def unit(self) -> str:
        """The unit as it was written, blanks made single: `deg/h`; empty for a bare number."""
        return " ".join(_split(self.text)[1].split())


@lru_cache(maxsize=4096)
def unit_factor(unit: str) -> tuple[float, str]:
    """SI value of one `unit`, and its dimension. Raises UnitError for a unit that we do not know."""
    if len(unit) > LONGEST_TEXT:
        raise UnitError(f"unit {unit[:40]!r}… is too long")
    if re.match(r",\d", unit):
        raise UnitError("a decimal comma cannot be read; write a point, like 0.5")
    text = _plain(unit)
    if text in ("", "1"):
        return 1.0, "dimensionless"
    if re.fullmatch(r"deg ?C|celsius", text):
        raise UnitError(f"{unit!r} is a temperature; write a difference in K")
    if re.search(r"\b(kg|kilogram)", text):  # g is gravity here, so kg would pass as a thousand g
        raise UnitError(f"unit {unit!r} is a mass; g means gravity here")
    if not _UNIT.fullmatch(text):
        raise UnitError(f"unit {unit!r} cannot be read")
    value, dimensions = 1.0, dict[str, int]()
    for name, power in _powers(text).items():
        known = _named(name)
        if known is None:
            raise UnitError(f"unit {unit!r} is unknown")
        value *= known[0] ** power
        for dimension, exponent in known[1]:
            dimensions[dimension] = dimensions.get(dimension, 0) + exponent * power
    return value, _dimension(dimensions)


def _powers(text: str) -> dict[str, int]:
    """`deg/(s K)^2`-like text of the grammar above -> power of every name; `*`, `/`, blanks from the left."""
    powers: dict[str, int] = {}
    sign = around = 1
    for operator, name, power in _PART.findall(text):
        if name:
            powers[name] = powers.get(name, 0) + around * sign * int(power or 1)
        elif operator == "(":
            around, sign = sign, 1
        elif operator == ")":
            around = 1
        else:
            sign = -1 if operator == "/" else 1
    return powers


def _named(name: str) -> tuple[float, _Dimensions] | None:
    """SI value and dimensions of `ms`, `millisecond`, `seconds`; None for what is no unit of ours."""
    for word, shortest in ((name, 1), (name.removesuffix("s"), 2)):  # plurals of words: `gs` is nothing
        for prefix, factor in _PREFIXES.items():
            rest = word.removeprefix(prefix)
            if word == prefix + rest and rest in _UNITS and len(rest) >= shortest:
                value, dimensions = _UNITS[rest]
                return factor * value, dimensions
    return None


def _dimension(powers: dict[str, int]) -> str:
    """`[angle] / [time] ** 2`, `1 / [time]`, `dimensionless`."""
    ordered = sorted(powers.items())
    above = [_power(name, power) for name, power in ordered if power > 0]
    below = [_power(name, -power) for name, power in ordered if power < 0]
    return " / ".join([" * ".join(above) or "1", *below]) if above or below else "dimensionless"


def _power(name: str, power: int) -> str:
    return f"[{name}]" if power == 1 else f"[{name}] ** {power}"


def _plain(unit: str) -> str:
    """One spelling: `°/s²` -> `deg/s^2`, `degC/min` -> `K/min` (a rate is a difference), single spaces."""
    for sign, name in _SPELLING.items():
        unit = unit.replace(sign, name)
    text = re.sub(r"\s*([*/^()])\s*", r"\1", " ".join(unit.split()))
    if re.search(r"[*/]", text):
        text = re.sub(r"\b(deg ?C|celsius)\b", "K", text)
    return text


def dimension_of(unit: str) -> str:
    """The dimension of a unit, e.g. `[angle] / [time]` of `deg/s`."""
    return unit_factor(unit)[1]


def parse(text: object) -> Quantity:
    """Read `0.002 deg/s`.

    Raises UnitError when it is not a number with a known unit, not finite, or of a size (in SI) outside
    1e-30 .. 1e18 that nothing in this field has.
    """
    number, unit = _split(text)
    factor, dimension = unit_factor(unit)
    si = _times(number, factor)
    if si != 0 and not SMALLEST <= abs(si) <= LARGEST:
        raise UnitError(f"{_shown(text)} is too {'small' if abs(si) < 1 else 'large'} to be meant")
    return Quantity(si, dimension, str(text).strip())


def to_si(text: object, unit: str) -> float:
    """SI value of a text that must have the dimension of `unit`; a bare number passes for unit `1` only.

    Raises UnitError naming the expected unit when the text has no unit or one of another dimension.
    """
    quantity = parse(text)
    if unit not in ("", "1") or quantity.dimension != "dimensionless":
        check_unit(quantity, unit)
    return quantity.si


def check_unit(quantity: Quantity, unit: str, example: str | None = None) -> None:
    """Raises UnitError unless the quantity was written with a unit of the dimension of `unit`.

    A pure number wants a unit too (`0.03 %`, `30 ppm`): nobody can tell a bare 0.03 from 0.03 %.
    """
    usual = "%" if unit in ("", "1") else unit
    text = quantity.text
    if not _split(text)[1]:
        raise UnitError(f"{text!r} has no unit; write e.g. '{example or f'{text} {usual}'}'")
    if quantity.dimension != dimension_of(unit):
        such = f" such as '{example}'" if example else ""
        raise UnitError(f"{text!r} has the wrong unit; expected one like {usual}{such}")


def to_degc(text: object) -> float:
    """Temperature in degrees Celsius from `-55 degC`, `-55 °C` or `218.15 K`.

    Raises UnitError for a missing or wrong unit, below absolute zero and above 1000 degC.
    """
    try:
        number, unit = _split(text)
    except UnitError as error:
        raise UnitError(f"{error}; write a temperature like '-55 degC'") from None
    offset = _TEMPERATURE.get(unit.lower())
    if offset is None:
        why = f"the unit {unit[:20]!r} is no temperature's" if unit else "it has no unit"
        raise UnitError(f"{_shown(text)} is not a temperature, {why}; write e.g. '{number:g} degC'")
    value = number + offset
    if not -ZERO_CELSIUS_K <= value <= HOTTEST_DEGC:
        raise UnitError(f"{_shown(text)} is not a possible temperature")
    return round(value, 9)  # 218.15 K is -55 degC, not -55.00000000000003


def from_si(value: float, unit: str) -> float:
    """The number that stands before `unit` for an SI value."""
    factor = unit_factor(unit)[0]
    parts = _whole_parts(factor)
    return value * parts if parts else value / factor


def display_factor(unit: str) -> float:
    """What one `unit` is inside: SI, but temperatures stay in degC and days in days."""
    return 1.0 if unit in ("degC", "day") else unit_factor(unit)[0]


def displayed(value: float, unit: str) -> float:
    """The number that stands before `unit` for a value as it is inside."""
    return value if unit in ("degC", "day") else from_si(value, unit)


def _times(number: float, factor: float) -> float:
    """number · factor; in decimals where the factor is 1/n, as 0.01 is: 99.9 % is 0.999."""
    parts = _whole_parts(factor)
    return float(Decimal(repr(number)) / parts) if parts else number * factor


def _whole_parts(factor: float) -> int:
    """n when factor is 1/n to the last bit, else 0."""
    parts = round(1.0 / factor) if 0 < factor < 1 else 0
    return parts if parts and 1.0 / parts == factor else 0


def _split(text: object) -> tuple[float, str]:
    """The finite number and the unit's text."""
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise UnitError(f"{_shown(text)} is not a number with a unit")
    written = str(text)
    if len(written) > LONGEST_TEXT:
        raise UnitError(f"{_shown(written)} is too long for a number with a unit")
    if re.match(r"\s*[+-]?\.?(nan|inf)", written, re.IGNORECASE):
        raise UnitError(f"{_shown(text)} is not a finite number")
    match = _QUANTITY.fullmatch(written)
    if match is None:
        raise UnitError(f"{_shown(text)} is not a number with a unit")
    number = float(re.sub(r"[_ ]", "", match[1]))
    if not math.isfinite(number):
        raise UnitError(f"{_shown(text)} is not a finite number")
    return number, match[2]


def _shown(value: object) -> str:
    kinds = {type(None): "nothing", list: "a list", tuple: "a list", dict: "a mapping"}
    if type(value) in kinds:
        return kinds[type(value)]
    if isinstance(value, str):
        return repr(value) if len(value) <= LONGEST_TEXT else f"{value[:40]!r}…"
    return str(value).lower()[:LONGEST_TEXT]
