"""Quantities at the border: text with a unit in, SI and radians inside, display units out.

A registry of our own (pint) holds only the units of this field. Angle is a dimension here, so that
`0.1 deg` is refused where a scale factor is expected, and `g` is gravity, `mg` milli-gravity.
Temperatures are carried as degrees Celsius everywhere (`_degc` in every name): that is what benches and
dwell tables speak, and a difference of one kelvin is one degree.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from planner.errors import PlannerError

STANDARD_GRAVITY_MPS2 = 9.80665  # 3rd CGPM (1901); interfaces: 1 g of every file
ZERO_CELSIUS_K = 273.15

_DEFINITIONS = """
micro- = 1e-6 = u- = µ- = μ-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
kilo- = 1e3 = k-

second = [time] = s = sec
minute = 60 second = min
hour = 3600 second = h = hr
day = 86400 second = d
week = 604800 second
metre = [length] = m = meter
radian = [angle] = rad
turn = 6.283185307179586 radian = rev = revolution
degree = 0.017453292519943295 radian = deg = °
arcminute = 0.0002908882086657216 radian = arcmin
arcsecond = 4.84813681109536e-06 radian = arcsec
kelvin = [temperature] = K
gravity = 9.80665 metre / second ** 2 = g
one = 1
percent = 0.01
ppm = 1e-6
knot = 1852 metre / hour = kn
rpm = turn / minute
hertz = 1 / second = Hz
"""

_NUMBER = r"[+-]?(?:\d+(?:[_ ]\d{3})*\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*$", re.DOTALL)
_TEMPERATURE = {
    "degc": 0.0,
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
    """A number with its unit, converted: `si` in SI and radians; `dimension` as pint writes it."""

    si: float
    dimension: str
    text: str


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint  # imported late: it costs 60 ms that `--help` does not have

    return pint.UnitRegistry(_DEFINITIONS.strip().splitlines(), cache_folder=None)


@lru_cache(maxsize=4096)
def unit_factor(unit: str) -> tuple[float, str]:
    """SI value of one `unit`, and its dimension. Raises UnitError for a unit that we do not know."""
    text = unit.replace("%", " percent ").strip()
    if len(text) > 80:
        raise UnitError(f"unit {unit[:40]!r}… is too long")
    # a grammar of our own in front of pint: its parser evaluates numbers and towers of powers
    if not re.fullmatch(r"[A-Za-zµμ°_ ()/*\d^-]*", text) or re.search(
        r"\d{2,}|(\*\*|\^)\s*-?\d*\s*(\*\*|\^)", text
    ):
        raise UnitError(f"unit {unit!r} cannot be read")
    if re.search(r"\bkg\b", text):  # g is gravity here, so kg would pass as a thousand g
        raise UnitError(f"unit {unit!r} is a mass; g means gravity here")
    text = re.sub(r"\b(micro|milli)-g\b", r"\1gravity", text).replace("^", "**")
    if not text or text == "1":
        return 1.0, "dimensionless"
    try:
        quantity = _registry().parse_expression(text)
        base = quantity.to_base_units() if hasattr(quantity, "to_base_units") else None
    except Exception as error:  # pint raises many kinds, from its own to SyntaxError
        raise UnitError(f"unit {unit!r} is unknown") from error
    if base is None:
        return float(quantity), "dimensionless"
    return float(base.magnitude), str(base.dimensionality)


def dimension_of(unit: str) -> str:
    """The dimension of a unit, e.g. `[angle] / [time]` of `deg/s`."""
    return unit_factor(unit)[1]


def parse(text: object) -> Quantity:
    """Read `0.002 deg/s`. Raises UnitError when it is not a finite number with a known unit."""
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise UnitError(f"{_shown(text)} is not a quantity")
    match = _QUANTITY.match(str(text))
    if match is None:
        raise UnitError(f"{_shown(text)} is not a number with a unit")
    number = float(re.sub(r"[_ ]", "", match[1]))
    if not math.isfinite(number):
        raise UnitError(f"{_shown(text)} is not a finite number")
    factor, dimension = unit_factor(match[2])
    si = number * factor
    if not math.isfinite(si):
        raise UnitError(f"{_shown(text)} is not a finite number")
    return Quantity(si, dimension, str(text).strip())


def to_si(text: object, unit: str) -> float:
    """SI value of a text that must have the dimension of `unit`.

    Raises UnitError naming the expected unit when the text has no unit or one of another dimension.
    """
    quantity = parse(text)
    expected = dimension_of(unit)
    if quantity.dimension != expected:
        if quantity.dimension == "dimensionless" and not _has_unit(str(text)):
            raise UnitError(f"{_shown(text)} has no unit; write e.g. '{str(text).strip()} {unit}'")
        raise UnitError(f"{_shown(text)} has the wrong dimension; expected a unit like {unit}")
    if expected == "dimensionless" and not _has_unit(str(text)) and unit not in ("", "1"):
        raise UnitError(f"{_shown(text)} has no unit; write e.g. '{str(text).strip()} {unit}'")
    return quantity.si


def to_degc(text: object) -> float:
    """Temperature in degrees Celsius from `-55 degC`, `-55 °C` or `218.15 K`.

    Raises UnitError for a missing or wrong unit and for anything below absolute zero.
    """
    match = _QUANTITY.match(text) if isinstance(text, str) else None
    if match is None:
        raise UnitError(f"{_shown(text)} is not a temperature; write e.g. '-55 degC'")
    offset = _TEMPERATURE.get(match[2].lower())
    if offset is None:
        raise UnitError(f"{_shown(text)} is not a temperature; write e.g. '-55 degC'")
    value = float(re.sub(r"[_ ]", "", match[1])) + offset
    if not math.isfinite(value) or value < -ZERO_CELSIUS_K:
        raise UnitError(f"{_shown(text)} is not a possible temperature")
    return round(value, 9)


def from_si(value: float, unit: str) -> float:
    """The number that stands before `unit` for an SI value."""
    return value / unit_factor(unit)[0]


def _has_unit(text: str) -> bool:
    match = _QUANTITY.match(text)
    return bool(match and match[2])


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "…'"
