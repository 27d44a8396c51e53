"""A data sheet's figures → a spec to start from; the table of terms is datasheet.toml beside this file.

What a sheet does not say is assumed and marked ASSUMED in the spec, by the ratios of sheets that say both:
power-on spread 10 × bias instability (STIM300: 4 and 0.5 deg/h, 0.75 and 0.05 mg), scale factor and axes from
power-on to power-on a tenth and a hundredth of their error, storage as large as the power-on spread.

    temperature_residual(N) = size · ratio(N),  N <= 5 as in K table 2.10, then ratio(5) (4/(N − 1))²
    nonlinearity e of full scale F from the best line: c = 4 e (U/F)², since |x³ − 3x/4| <= 1/4 on [−1, 1]
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from planner.effects.scale_factor_nonlinearity import REFERENCE_INPUT
from planner.errors import Fault, InputError, Unfit
from planner.protocols import SENSORS, Sensor
from planner.spec.noise_density import accelerometer_density, gyro_density
from planner.spec.places import did_you_mean
from planner.spec.starter import starter_text
from planner.units import UnitError, check_unit, parse, to_degc, to_si

POWER_ONS_TO_INSTABILITY = 10.0
OF_SCALE_FACTOR, OF_MISALIGNMENT = 0.1, 0.01  # from power-on to power-on, of the whole error
RATIOS = {  # of what N points leave to what one leaves: up to five those of K table 2.10
    "bias": {1: 1.0, 3: 0.27, 5: 0.11},
    "scale_factor": {1: 1.0, 3: 0.37, 5: 0.14},
}
SMOOTH = (7, 10, 15, 20)  # and beyond five as straight lines on a smooth curve, (4/(N − 1))² of that
NEEDED = ("bias-instability", "bias-repeatability")  # one of them of each sensor
_WORDS = ("trajectory", "name")  # `planner check` reads them
_ASSUMED = "# ASSUMED: not on the sheet"


@dataclass(frozen=True)
class Term:
    """One term of data sheets. says: in words; key: of the spec's unit; how: what is done to the figure."""

    flag: str
    says: str
    example: str
    key: str = ""
    how: str = "as_is"
    asked: bool = False


@cache
def terms() -> Mapping[str, Term]:
    """Flag without its dashes -> term, in the order of the table."""
    text = files("planner.spec").joinpath("datasheet.toml").read_text(encoding="utf-8")
    return {flag: Term(flag, **entry) for flag, entry in tomllib.loads(text).items()}


def datasheet_spec(figures: Mapping[str, str]) -> str:
    """A commented spec that has the figures of a sheet, flag -> text with unit.

    Raises InputError with every fault at once: unknown flags, wrong units, a sensor without bias figures.
    """
    faults = [*_faults(figures)]
    if faults:
        count = "1 fault" if len(faults) == 1 else f"{len(faults)} faults"
        raise InputError(f"the data sheet's figures cannot be used: {count}", faults)
    lines = {sensor: _Budgets(sensor, figures) for sensor in SENSORS}
    found = _with_unit(starter_text(), _unit(figures, lines), lines)
    first, after = found.index(" Here that is near 77 m"), found.index("#   error: position, horizontal")
    refused_too = "Too tight a limit is refused,\n# with the nearest that can be met."
    found = f"{found[:first]} {refused_too}\n{found[after:]}"
    name = figures.get("name", terms()["name"].example)
    found = _line(found, "name: ", f"name: {json.dumps(name, ensure_ascii=False)}")
    if "trajectory" in figures:
        found = _line(found, "trajectory: ", f"trajectory: {figures['trajectory']}")
    if "limit" in figures:
        found = found.replace("limit: 100 m,", f"limit: {figures['limit']},")
    low, high = _range(figures)
    return found.replace("range: [-60 degC, 60 degC] ", f"range: [{low}, {high}] ")


def _range(figures: Mapping[str, str]) -> tuple[str, str]:
    return figures.get("coldest", "-60 degC"), figures.get("hottest", "60 degC")


# ---------------------------------------------------------------- faults


_SHORT = {r"^acc(el)?-": "accelerometer-", r"^gyroscope-": "gyro-", "turn-on": "repeatability"}


def _spelt_out(flag: str) -> str:
    """Words that data sheets use, as they are said here."""
    for short, word in _SHORT.items():
        flag = re.sub(short, word, flag)
    return flag


def _faults(figures: Mapping[str, str]) -> Iterator[Fault]:
    for flag, text in figures.items():
        if flag not in terms():
            yield _fault(
                "P101", flag, f"no term of data sheets here{did_you_mean(_spelt_out(flag), terms())}"
            )
            continue
        why = refused(terms()[flag], text)
        if why is not None:
            yield _fault("P111", flag, why)
    for sensor in SENSORS:
        if not any(f"{sensor}-{term}" in figures for term in NEEDED):
            flags = " or ".join(f"--{sensor}-{term}" for term in NEEDED)
            yield _fault("P102", f"{sensor}-{NEEDED[0]}", f"is missing; give {flags}")


def refused(term: Term, text: str) -> str | None:
    """Why a figure is none of the term; None if it is one."""
    try:
        _read(term, text)
    except (UnitError, Unfit) as error:
        return str(error)
    return None


def _fault(code: str, flag: str, message: str) -> Fault:
    return Fault("data sheet", 0, 0, f"--{flag}", message, code)


def _read(term: Term, text: str) -> None:
    """Raises UnitError or Unfit for a figure that is not of the term's kind."""
    if term.flag in _WORDS:
        return
    if term.flag in ("coldest", "hottest"):
        to_degc(text)
    elif term.how == "noise":
        (gyro_density if term.key.endswith("gyro") else accelerometer_density)(text)
    else:
        found, unit = parse(text), term.example.partition(" ")[2]
        check_unit(found, unit, term.example)
        if found.si < 0:
            raise UnitError(f"{text!r} is negative; a data sheet's ±x is x")


# ---------------------------------------------------------------- the budget


class _Budgets:
    """The budget of one sensor as lines of a spec: effect -> key -> text, with what was assumed."""

    def __init__(self, sensor: Sensor, figures: Mapping[str, str]) -> None:
        self.sensor, self.figures = sensor, figures
        self.effects: dict[str, dict[str, str]] = {}
        for flag, text in figures.items():
            term = terms()[flag]
            if term.key.startswith(f"{sensor}."):
                _, effect, key = term.key.split(".")
                self._put(effect, key, *self._budgeted(term, effect, text))
        self._bias()
        self._share("scale_factor", OF_SCALE_FACTOR)
        self._share("misalignment", OF_MISALIGNMENT)

    def _put(self, effect: str, key: str, text: str, why: str) -> None:
        self.effects.setdefault(effect, {})[key] = f"{text}    {why}".rstrip()

    def _budgeted(self, term: Term, effect: str, text: str) -> tuple[str, str]:
        """What stands in the budget, and the comment behind it."""
        if term.how in ("table", "coefficient"):
            return _table(text, term.how, effect, self._half_range()), f"# {term.says}: {text}; shape ASSUMED"
        if term.how == "nonlinearity":
            return self._cubic(text), f"# {term.says.partition(' (')[0]}: {text}"
        return text, f"# {term.says}"

    def _half_range(self) -> float:
        low, high = (to_degc(text) for text in _range(self.figures))
        return 0.5 * (high - low)

    def _cubic(self, text: str) -> str:
        reference = REFERENCE_INPUT[self.sensor]
        unit = "deg/s" if self.sensor == "gyro" else "g"
        full = self.figures.get(f"{self.sensor}-range")
        ratio = 1.0 if full is None else reference / to_si(full, unit)
        number, _, name = text.strip().partition(" ")
        return f"{_three(4.0 * float(number) * ratio**2)} {name}"

    def _bias(self) -> None:
        bias = self.effects.setdefault("bias", {})
        instability = self.figures.get(f"{self.sensor}-bias-instability")
        if "run_to_run" not in bias and instability is not None:
            self._put(
                "bias",
                "run_to_run",
                _times(instability, POWER_ONS_TO_INSTABILITY),
                f"{_ASSUMED}, 10 × bias instability",
            )
        self._stored("bias", _figure(bias["run_to_run"]))

    def _share(self, effect: str, share: float) -> None:
        budget = self.effects.get(effect)
        if budget is None:
            return
        if "run_to_run" not in budget:
            if "systematic" not in budget:
                del self.effects[effect]
                return
            text = _times(_figure(budget["systematic"]), share)
            self._put(effect, "run_to_run", text, f"{_ASSUMED}, {share:g} of the error")
        self._stored(effect, _figure(budget["run_to_run"]))

    def _stored(self, effect: str, spread: str) -> None:
        if "storage" not in self.effects[effect]:
            self._put(effect, "storage", spread, f"{_ASSUMED}, as from power-on to power-on")

    @property
    def tabled(self) -> list[str]:
        """Effects with a figure over temperature."""
        return [effect for effect, keys in self.effects.items() if "temperature_residual" in keys]


_ORDER = ("systematic", "run_to_run", "in_run", "storage", "temperature_residual")


def _figure(line: str) -> str:
    return line.partition("    #")[0]


def _three(value: float) -> str:
    """Three digits without a power of ten where it is none of the very small."""
    return f"{float(f'{value:.3g}'):.10g}"


def _times(text: str, factor: float) -> str:
    number, _, unit = text.strip().partition(" ")
    return f"{_three(float(number) * factor)} {unit}"


def _table(text: str, how: str, effect: str, half_range: float) -> str:
    number, _, unit = text.strip().partition(" ")
    size = float(number)
    if how == "coefficient":
        size, unit = size * half_range, unit.rpartition("/")[0]
    ratios = RATIOS[effect] | {n: RATIOS[effect][5] * (4.0 / (n - 1)) ** 2 for n in SMOOTH}
    points = (f"{n}: {_three(size * ratio)} {unit}" for n, ratio in ratios.items())
    return "{" + ", ".join(points) + "}"


# ---------------------------------------------------------------- the spec


def _unit(figures: Mapping[str, str], lines: Mapping[Sensor, _Budgets]) -> str:
    noise = {
        s: figures[f]
        for s, f in (("gyro", "gyro-arw"), ("accelerometer", "accelerometer-vrw"))
        if f in figures
    }
    found = [
        "unit:",
        "  # From the data sheet; one sigma, or the largest where the sheet says so.",
        "  service_life: 500 h",
    ]
    if noise:
        found.append("  noise: {" + ", ".join(f"{s}: {text}" for s, text in noise.items()) + "}")
    for sensor in SENSORS:
        found.append(f"  {sensor}:")
        for effect, keys in lines[sensor].effects.items():
            found.append(f"    {effect}:")
            found += [f"      {key}: {keys[key]}" for key in _ORDER if key in keys]
    return "\n".join(found) + "\n\n"


def _with_unit(starter: str, unit: str, lines: Mapping[Sensor, _Budgets]) -> str:
    """The starter spec with another unit, and effects and tests that suit it."""
    first, after = starter.index("unit:\n"), starter.index("# The error model that calibration")
    found = starter[:first] + unit + starter[after:]
    every = [
        e for e in ("bias", "scale_factor", "misalignment") if any(e in b.effects for b in lines.values())
    ]
    tables = dict.fromkeys(f"{e}_temperature" for b in lines.values() for e in b.tabled)
    declared = ", ".join([*every, *tables])
    found = _line(found, "effects: [", f"effects: [{declared}]")
    static = [
        "gyro.bias",
        *(
            f"accelerometer.{e}"
            for e in ("bias", "scale_factor", "misalignment")
            if e in lines["accelerometer"].effects
        ),
    ]
    rates = [f"gyro.{e}" for e in ("scale_factor", "misalignment") if e in lines["gyro"].effects]
    found = _line(found, "    calibrates: [gyro.bias,", f"    calibrates: [{', '.join(static)}]")
    return _line(
        found, "    calibrates: [gyro.scale_factor]", f"    calibrates: [{', '.join(rates or ['gyro.bias'])}]"
    )


def _line(text: str, begins: str, new: str) -> str:
    return "\n".join(new if line.startswith(begins) else line for line in text.split("\n"))
