"""Units: scaling laws, round trips, what is refused and in which words."""

from __future__ import annotations

import math
import random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.units import (
    Quantity,
    UnitError,
    check_unit,
    dimension_of,
    from_si,
    parse,
    to_degc,
    to_si,
    unit_factor,
)

# A chain of conversions has at most a handful of roundings of half a unit in the last place (1.1e-16) each.
ROUNDING = 1e-15

UNITS = [
    *("s", "ms", "min", "h", "day", "m", "km", "cm", "deg", "rad", "mrad", "arcsec", "arcmin", "turn", "K"),
    *("g", "mg", "ug", "m/s", "km/h", "knot", "m/s^2", "deg/s", "deg/h", "deg/s/s", "rpm", "Hz", "%", "ppm"),
    *("deg/s/g", "deg/h/g^2", "%/K", "ppm/g", "K/min", "deg/s/(K/min)", "g/day", "m/(deg/s)", "m/g", "m/%"),
]

numbers = st.floats(1e-6, 1e6, allow_nan=False).map(lambda x: float(f"{x:.6g}"))


@given(numbers, st.sampled_from(UNITS))
@settings(deadline=None, max_examples=300)
def test_from_si_undoes_to_si(number: float, unit: str) -> None:
    assert from_si(to_si(f"{number!r} {unit}", unit), unit) == pytest.approx(number, rel=ROUNDING)


@given(numbers, st.sampled_from(UNITS), st.integers(2, 1000))
@settings(deadline=None, max_examples=100)
def test_a_quantity_is_linear_in_its_number(number: float, unit: str, times: int) -> None:
    one, many = parse(f"{number!r} {unit}"), parse(f"{number * times!r} {unit}")
    assert many.si == pytest.approx(times * one.si, rel=ROUNDING)
    assert parse(f"-{number!r} {unit}").si == -one.si


@pytest.mark.parametrize(
    ("large", "times", "small"),
    [
        ("deg/s", 60, "deg/min"),
        ("deg/s", 3600, "deg/h"),
        ("deg/s", 3600, "arcsec/s"),
        ("turn", 360, "deg"),
        ("rpm", 6, "deg/s"),
        ("h", 60, "min"),
        ("day", 24, "h"),
        ("g", 1000, "mg"),
        ("mg", 1000, "ug"),
        ("ug", 1, "µg"),  # the micro sign, U+00B5
        ("ug", 1, "μg"),  # the Greek letter, U+03BC
        ("mg", 1, "milli-g"),
        ("ug", 1, "micro-g"),
        ("g", 9.80665, "m/s^2"),
        ("g", 9.80665, "m/s²"),
        ("g", 9.80665, "m/s**2"),
        ("g", 9.80665, "m/s/s"),
        ("%", 10_000, "ppm"),
        ("1/s", 1, "Hz"),
        ("K/min", 60, "K/h"),
        ("K/min", 1, "degC/min"),
        ("K/min", 1, "°C/min"),
        ("deg/s", 1, "°/s"),
        ("km", 1000, "m"),
        ("knot", 1.852, "km/h"),
        ("m/(deg/s)", 1, "m s/deg"),
        ("deg/s/g", 1, "deg/(s g)"),
        ("deg/s/g^2", 1, "(deg/s)/g^2"),
    ],
)
def test_one_unit_is_so_many_of_another(large: str, times: float, small: str) -> None:
    assert unit_factor(large)[0] == pytest.approx(times * unit_factor(small)[0], rel=ROUNDING)
    assert dimension_of(large) == dimension_of(small)


@pytest.mark.parametrize(
    ("text", "unit", "si"),
    [
        ("95 %", "%", 0.95),
        ("99.9 %", "%", 0.999),
        ("0.002 %", "1", 0.00002),
        ("30 ppm", "1", 30e-6),
        ("4 K/min", "K/s", 4 / 60),
        ("15 min", "s", 900.0),
        ("500 h", "s", 1_800_000.0),
        ("1 g", "m/s^2", 9.80665),
        ("1 000 m", "m", 1000.0),
        ("1_000 m", "m", 1000.0),
        ("1e3m", "m", 1000.0),
        ("  .5   km ", "m", 500.0),
        ("+5 m", "m", 5.0),
    ],
)
def test_decimal_numbers_stay_exact(text: str, unit: str, si: float) -> None:
    assert to_si(text, unit) == si


def test_angle_is_a_dimension() -> None:
    assert parse("1 deg").si == math.pi / 180
    assert dimension_of("deg") != dimension_of("%")
    with pytest.raises(UnitError, match="wrong unit"):
        to_si("0.1 deg", "%")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("3 kg", "gravity"),
        ("3 kg/s", "gravity"),
        ("3 furlong", "unknown"),
        ("3 V", "unknown"),
        ("3 deg/sqrt(h)", "cannot be read"),
        ("3 m**9**9", "cannot be read"),
        ("3 m^99", "cannot be read"),
        ("3 2 m", "cannot be read"),
        ("3 m + m", "cannot be read"),
        ("3 __class__", "unknown"),
        ("3 m/s/", "cannot be read"),
        ("2 min 30 s", "cannot be read"),
        ("3 degC", "difference"),
        ("0,5 m", "point"),
        ("nan m", "finite"),
        ("-inf m", "finite"),
        ("1e400 m", "finite"),
        (float("nan"), "finite"),
        (float("inf"), "finite"),
        ("1e300 m", "too large"),
        ("1e-300 m", "too small"),
        (10**90, "too large"),
        ("m", "not a number"),
        ("", "not a number"),
        ("٣ m", "not a number"),
        (True, "not a number"),
        (None, "nothing is not"),
        ([1], "a list is not"),
        ({}, "a mapping is not"),
        ("1" * 5000, "too long"),
        ("3 " + "m" * 5000, "too long"),
    ],
)
def test_what_is_no_quantity(text: object, words: str) -> None:
    with pytest.raises(UnitError, match=words):
        parse(text)


def test_a_missing_unit_is_refused_with_an_example() -> None:
    with pytest.raises(UnitError, match=r"'10' has no unit; write e\.g\. '10 m'"):
        to_si(10, "m")
    with pytest.raises(UnitError, match=r"write e\.g\. '0\.03 %'"):
        check_unit(parse("0.03"), "1")
    assert to_si("0.03", "1") == 0.03  # a pure number where nothing else can be meant


@pytest.mark.parametrize(
    ("text", "degc"),
    [
        ("-55 degC", -55.0),
        ("-55 °C", -55.0),
        ("-55°C", -55.0),
        ("218.15 K", -55.0),
        ("20 C", 20.0),
        ("0 K", -273.15),
    ],
)
def test_temperatures(text: str, degc: float) -> None:
    assert to_degc(text) == degc


@pytest.mark.parametrize(
    "text", ["-55", -55, "5 deg", "-300 degC", "-1 K", "1e5 degC", "nan degC", None, [], "cold"]
)
def test_what_is_no_temperature(text: object) -> None:
    with pytest.raises(UnitError):
        to_degc(text)


@given(st.text(max_size=40) | st.from_regex(r"[0-9.e+-]{1,6} [a-z/*^()0-9°%µ-]{0,12}", fullmatch=True))
@settings(deadline=None, max_examples=500)
def test_any_text_is_a_quantity_or_a_unit_error(text: str) -> None:
    for read in (parse, to_degc):
        try:
            found = read(text)
        except UnitError:
            continue
        assert math.isfinite(found.si if isinstance(found, Quantity) else found)


# ---------------------------------------------------------------- the same as pint

# The definitions that `planner.units` has as a table, for a parser that is none of ours.
DEFINITIONS = """
nano- = 1e-9 = n-
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
degree = 0.017453292519943295 radian = deg
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
NAMES = sorted(
    {
        name.strip("- ")
        for line in DEFINITIONS.strip().splitlines()
        for name in [line.split("=")[0].strip(), *line.split(" = ")[2:]]
        if not name.strip().endswith("-")
    }
)
PREFIXES = ["", "nano", "n", "micro", "u", "µ", "μ", "milli", "m", "centi", "c", "kilo", "k"]


@pytest.fixture(scope="module")
def registry() -> Any:
    import pint

    return pint.UnitRegistry(DEFINITIONS.strip().splitlines(), cache_folder=None)


def by_pint(registry: Any, text: str) -> tuple[float, dict[str, float]] | None:
    """SI value and dimensions, or None for what it does not know."""
    try:
        base = registry.parse_expression(text.replace("^", "**")).to_base_units()
    except Exception:  # pint raises many kinds, from its own to AttributeError
        return None
    return float(base.magnitude), {name: power for name, power in base.dimensionality.items() if power}


def by_us(text: str) -> tuple[float, dict[str, float]] | None:
    try:
        value, dimension = unit_factor(text)
    except UnitError:
        return None
    above, *below = dimension.split(" / ")
    signed = [(part, 1) for part in above.split(" * ")] + [(part, -1) for part in below]
    found = [(part.partition(" ** "), sign) for part, sign in signed if part.startswith("[")]
    return value, {name: sign * float(power or 1) for (name, _, power), sign in found}


def test_every_spelling_with_every_prefix_is_what_pint_says(registry: Any) -> None:
    spellings = [p + name + plural for p in PREFIXES for name in NAMES for plural in ("", "s")]
    assert len(spellings) > 900
    for text in spellings:
        theirs, ours = by_pint(registry, text), by_us(text)
        if text.startswith("kg"):  # refused: pint is told nothing of mass
            continue
        assert (ours is None) == (theirs is None), text
        if ours and theirs:
            assert ours[0] == pytest.approx(theirs[0], rel=ROUNDING), text
            assert ours[1] == theirs[1], text


def compound(rng: random.Random) -> str:
    """A product, quotient or power of our units, as the grammar allows it; without kg, which is refused."""

    def atom() -> str:
        prefix, name = rng.choice(["", "", "m", "micro", "k"]), rng.choice(NAMES)
        return f"{prefix if name[0] != 'g' or prefix != 'k' else ''}{name}{rng.choice(['', '', '^2', '^-1'])}"

    def term() -> str:
        product = rng.choice("* ").join(atom() for _ in range(rng.choice([1, 1, 2, 3])))
        below = "".join(f"/{atom()}" for _ in range(rng.choice([0, 1, 2])))
        return product if rng.random() < 0.7 else f"({product}{below})"

    return "/".join([rng.choice(["1", term()]), *(term() for _ in range(rng.choice([0, 1, 2])))])


def test_products_quotients_and_powers_are_what_pint_says(registry: Any) -> None:
    rng = random.Random(19)
    for text in (compound(rng) for _ in range(400)):
        theirs, ours = by_pint(registry, text), by_us(text)
        if text == "1":
            continue
        assert ours is not None, text
        assert theirs is not None, text
        assert ours[0] == pytest.approx(theirs[0], rel=20 * ROUNDING), text  # up to a dozen factors
        assert ours[1] == theirs[1], text
