"""What a user may set of a simulated campaign: `key: value` of a YAML file, or KEY=VALUE on the command line.

case, signs                                             random|worst, random|plus
white_gyro, white_accelerometer                         noise of a record of 1 s, e.g. 0.003 deg/s, 0.1 mg
in_run_time                                             correlation time of all in-run processes, e.g. 10 min
temperature_jitter, temperature_error                   of the chamber, of the unit's thermometer, e.g. 0.05 K
run_to_run, in_run, storage, temperature_residual       on|off: whether the budget's part is drawn
references                                              on|off: whether the bench's accuracy is drawn
spikes, spike_size                                      share of readings struck, e.g. 0.1 %; sigma, e.g. 40
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from planner.errors import InputError
from planner.protocols import SENSORS
from planner.simulate.campaign import Settings
from planner.spec.model import Spec
from planner.units import UnitError, to_si

_ON = {"on": True, "true": True, "yes": True, "off": False, "false": False, "no": False}
_MOST_SIGMA = 1e6


def settings_from(written: Mapping[str, object], start: Settings | None = None) -> Settings:
    """Settings with what was written in place of the defaults.

    Raises InputError for an unknown key and a value that cannot be, with what is expected.
    """
    found = start or Settings()
    for key, value in written.items():
        if key not in _READERS:
            close = difflib.get_close_matches(str(key), _READERS, 1)
            hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(_READERS)}"
            raise InputError(f"simulation setting {key!r}: not known; {hint}")
        try:
            found = _READERS[key](found, value)
        except (UnitError, ValueError) as error:
            raise InputError(f"simulation setting {key}: {error}") from error
    return found


def settings_of(spec: Spec) -> Settings:
    """Settings with the spec's noise in place of the default; a sensor for which it has none keeps it."""
    return Settings(white={s: spec.unit.white_of_records(s) for s in SENSORS})


def pairs(texts: list[str] | tuple[str, ...]) -> dict[str, object]:
    """KEY=VALUE texts as a mapping. Raises InputError for one without an equals sign."""
    found: dict[str, object] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"--set {text!r}: write KEY=VALUE, e.g. in_run=off")
        found[key.strip()] = value.strip()
    return found


_Reader = Callable[[Settings, Any], Settings]


def _word(name: str, *words: str) -> _Reader:
    def read(settings: Settings, value: object) -> Settings:
        if value not in words:
            raise ValueError(f"must be {' or '.join(words)}, not {value!r}")
        return replace(settings, **{name: value})  # type: ignore[arg-type]  # the name is one of its fields

    return read


def _switch(name: str) -> _Reader:
    def read(settings: Settings, value: object) -> Settings:
        known = value if isinstance(value, bool) else _ON.get(str(value).lower())
        if known is None:
            raise ValueError(f"must be on or off, not {value!r}")
        return replace(settings, **{name: known})  # type: ignore[arg-type]  # the name is one of its fields

    return read


def _size(name: str, unit: str, most: float = math.inf, least: float = 0.0) -> _Reader:
    def read(settings: Settings, value: object) -> Settings:
        number = _number(value, unit)
        if not least <= number <= most:
            raise ValueError(f"{value!r} lies outside {least:g} … {most:g} (SI)")
        return replace(settings, **{name: number})  # type: ignore[arg-type]  # the name is one of its fields

    return read


def _white(sensor: str, unit: str) -> _Reader:
    def read(settings: Settings, value: object) -> Settings:
        number = _number(value, unit)
        if number < 0.0:
            raise ValueError(f"{value!r} is less than zero")
        return replace(settings, white={**settings.white, sensor: number})  # type: ignore[dict-item]  # `sensor` is one of SENSORS

    return read


def _number(value: object, unit: str) -> float:
    """SI; a number without a unit where none is needed."""
    if unit == "1":
        text = str(value).strip()
        number = float(text[:-1]) / 100.0 if text.endswith("%") else float(text)
    else:
        number = to_si(value, unit)
    if not math.isfinite(number):
        raise ValueError(f"{value!r} is no finite number")
    return number


_READERS: Mapping[str, _Reader] = {
    "case": _word("case", "random", "worst"),
    "signs": _word("signs", "random", "plus"),
    "white_gyro": _white("gyro", "deg/s"),
    "white_accelerometer": _white("accelerometer", "g"),
    "in_run_time": _size("in_run_time", "s", least=1e-3),
    "temperature_jitter": _size("temperature_jitter", "K", 50.0),
    "temperature_error": _size("temperature_error", "K", 50.0),
    "run_to_run": _switch("run_to_run"),
    "in_run": _switch("in_run"),
    "storage": _switch("storage"),
    "temperature_residual": _switch("temperature_residual"),
    "references": _switch("references"),
    "spikes": _size("spikes", "1", 1.0),
    "spike_size": _size("spike_size", "1", _MOST_SIGMA),
}
