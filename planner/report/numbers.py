"""Numbers as people read them: display units, at most four significant digits, one minus sign."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from decimal import Decimal
from itertools import groupby, pairwise

from planner.units import from_si

SPACE = "\u202f"  # narrow no-break space: groups digits, keeps a number and its unit on one line
NOTHING = "–"
_PLAIN = str.maketrans({SPACE: " ", "\u2007": " ", "\u2008": " ", "\u200b": None})


def digits(value: float, significant: int = 4) -> str:
    """`value` with at most `significant` digits: 0.0035, 12.5, 643 200, −3; powers of ten if they help."""
    if not math.isfinite(value):
        return "∞" if value == math.inf else NOTHING
    if value == 0:
        return "0"
    rounded = Decimal(f"{value:.{significant - 1}e}")
    exponent = rounded.adjusted()
    if exponent < -5 or exponent > 8:
        mantissa = rounded.scaleb(-exponent).normalize()
        return _signed(f"{mantissa:f}·10{_superscript(exponent)}")
    plain = f"{rounded.normalize():f}"
    return _signed(_grouped(plain))


def display_unit(unit: str) -> str:
    """As people read it: a bare ratio in per cent, powers raised."""
    return "%" if unit in ("", "1") else unit.replace("**2", "²").replace("**3", "³")


def in_unit(si: float, unit: str) -> float:
    """SI value in the display unit of `unit`."""
    return from_si(si, display_unit(unit))


def quantity(si: float, unit: str, significant: int = 4) -> str:
    """SI value with its display unit: `0.0035 deg/s`."""
    return f"{digits(in_unit(si, unit), significant)}{SPACE}{display_unit(unit)}"


def hours(seconds: float) -> str:
    """Seconds as hours with two decimals, which is 36 s: finer than any campaign is planned."""
    value = seconds / 3600.0
    return NOTHING if not math.isfinite(value) else _signed(_grouped(f"{value:.2f}"))


def days(seconds: float) -> str:
    """`7.74 days` for what takes longer than one, else nothing."""
    return f"{digits(seconds / 86400.0, 3)} days" if seconds > 86400.0 else ""


def percent(share: float, decimals: int = 1) -> str:
    """A share as `12.3 %`."""
    return NOTHING if not math.isfinite(share) else _signed(f"{100 * share:.{decimals}f}{SPACE}%")


def level(share: float) -> str:
    """A chosen probability as the spec writes it: `95 %`, `99.73 %`."""
    return f"{digits(100 * share, 6)}{SPACE}%"


def when(at: str) -> str:
    """When a requirement holds, in words: `at the end`, `at any time`, `at 300 s`."""
    return {"end": "at the end", "any": "at any time"}.get(at, f"at {at}")


def degrees_celsius(value: float) -> str:
    """A temperature without its unit, to a tenth: `−40`, `8.6`; chambers hold ±2 °C."""
    return digits(round(value, 1))


def degrees(values: Sequence[float]) -> str:
    """One temperature alone, `3: −60, 0, 60`, or `15: −60 to 60, even`."""
    apart = [b - a for a, b in pairwise(values)]
    if len(values) > 4 and max(apart) - min(apart) < 0.01:  # the spec's even spreads are rounded to 1e-6 K
        return f"{len(values)}: {degrees_celsius(values[0])} to {degrees_celsius(values[-1])}, even"
    text = ", ".join(degrees_celsius(t) for t in values)
    return f"{len(values)}: {text}" if len(values) > 1 else text


def runs(values: Sequence[str]) -> str:
    """`8` for eight everywhere, `8, 5 ×3, 6` for runs of equal numbers."""
    found = [(value, len(list(group))) for value, group in groupby(values)]
    if len(found) == 1:
        return found[0][0]
    return ", ".join(value if count == 1 else f"{value}{SPACE}×{count}" for value, count in found)


_TABLE_IN_NAME = re.compile(r"(?<=scatter_over_input)_at_[0-9p_]+_of_[0-9p_]+")


def plain(text: str) -> str:
    """The same for a terminal: no narrow, figure or zero-width spaces, which its font may lack."""
    return short_names(text.translate(_PLAIN))


def short_names(text: str) -> str:
    """Names of errors that carry a spec's table without it: `gyro.scatter_over_input`."""
    return _TABLE_IN_NAME.sub("", text)


def _signed(text: str) -> str:
    return text.replace("-", "−")


def _grouped(text: str) -> str:
    whole, point, rest = text.partition(".")
    sign = "-" if whole.startswith("-") else ""
    whole = whole.lstrip("-")
    if len(whole) > 4:
        whole = f"{int(whole):,}".replace(",", SPACE)
    return f"{sign}{whole}{point}{rest}"


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def counted(number: int, one: str, many: str | None = None) -> str:
    """`1 unit`, `3 units`."""
    return f"{number} {one if number == 1 else many or f'{one}s'}"


def names_are(names: Sequence[str]) -> str:
    """`u1 is`, `u1 and u2 are`, `u1, u2, u3 and 7 more are`."""
    if len(names) == 1:
        return f"{names[0]} is"
    if len(names) > 4:
        return f"{', '.join(names[:3])} and {len(names) - 3} more are"
    return f"{', '.join(names[:-1])} and {names[-1]} are"
