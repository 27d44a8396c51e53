"""A commented column map from what a file shows: roles, units, rate, zeros, gravity."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.nouns.array import Array
from planner.readers._arrays import RUN
from planner.recordings.clocks import clock_of, written_seconds
from planner.recordings.column_map import AXES, plain_unit
from planner.recordings.glimpse import Glimpse, glimpse
from planner.recordings.guess_roles import Roles, kinds_of_rows, others, roles_of
from planner.recordings.guess_units import (
    Guess,
    acceleration,
    carried_by,
    rate,
    rests_of,
    whole_numbers,
    windows_of,
)
from planner.recordings.recording import DWELL_NAMES, already_dwells
from planner.units import UnitError, dimension_of, unit_factor

CHECK = "CHECK"
POSSIBLE_HZ, USUAL_HZ = (0.5, 20_000.0), (10.0, 2_500.0)
FASTEST_K_S = 2.0  # of an inertial unit's temperature: chambers do 0.1 K/s
EPOCHS = (("s", 1e9), ("ms", 1e12), ("us", 1e15), ("ns", 1e18))  # since 1970, in 2001 to 2286
_PLAIN_NAME = re.compile(r"[A-Za-z_][\w.\-]*")


@dataclass(frozen=True)
class _Time:
    """The line of the map, and the times (n,) s that it gives."""

    line: str
    seconds: Array
    restarts: bool = False


@dataclass(frozen=True)
class _Seen:
    """A file, or the rows of it of one kind of sensor, with roles and times; where: what tells those rows."""

    seen: Glimpse
    roles: Roles
    time: _Time
    where: str = ""


def guessed_map(paths: Sequence[Path]) -> str:
    """The text of a map of one recording, given by its file or files. It reads as a map as it stands.

    Raises InputError when a file cannot be read, or shows neither gyros nor accelerometers.
    """
    files = [one for path in paths for one in _looked_at(Path(path))]
    for one in files:
        if set(DWELL_NAMES) <= set(one.seen.names):
            raise InputError(already_dwells(paths[0]))
    acc = next((f for f in files if f.roles.acc), None)
    gyro = next((f for f in files if f.roles.gyro), None)
    first = next((f for f in files if f is gyro or f is acc), None)
    if first is None:
        shown = ", ".join(files[0].seen.names[:30])
        raise InputError(
            f"{paths[0]}: no three columns look like gyros or accelerometers; it has {shown}; "
            "`planner reduce --map-help` tells how to write a map"
        )
    guesses = _units(gyro, acc)
    lines = [*_head(first, paths), *_time_lines(first)]
    for key, file in (("gyro", gyro), ("acc", acc)):
        if file is not None:
            lines += _triad(key, file, first, guesses[key])
    lines += _temperature(first)
    lines += _rest(first, gyro is None, acc is None)
    return "\n".join([*lines, ""])


def _looked_at(path: Path) -> list[_Seen]:
    seen = glimpse(path)
    kinds = kinds_of_rows(seen)
    if kinds is None:
        roles = roles_of(seen)
        return [_Seen(seen, roles, _time(seen, roles))]
    column, texts = kinds
    found = []
    for key, text in texts.items():
        mine = _rows_of(seen, seen.texts[column] == text)
        roles = roles_of(mine)
        triad = roles.gyro or roles.acc
        lone = replace(roles, gyro=None, acc=None, labels=(), how={key: "by what their rows are called"})
        roles = replace(lone, gyro=triad) if key == "gyro" else replace(lone, acc=triad)
        where = f"where: {{{_quoted(seen, column)}: {json.dumps(text, ensure_ascii=False)}}}"
        found.append(_Seen(mine, roles, _time(mine, roles), where))
    return found


def _rows_of(seen: Glimpse, keep: NDArray[np.bool_]) -> Glimpse:
    numbers = {name: values[keep] for name, values in seen.numbers.items()}
    return replace(seen, numbers=numbers, texts={name: values[keep] for name, values in seen.texts.items()})


# ---------------------------------------------------------------- time


def _time(seen: Glimpse, roles: Roles) -> _Time:
    name = roles.time
    if name is None:
        hz, by = _rate_of_comments(seen)
        line = f"rate: {hz:g} Hz    # {by}"
        return _Time(line, np.arange(len(seen)) / hz)
    if name in seen.texts:
        return _written(seen, name)
    values = seen.numbers[name]
    unit, why = _time_unit(values, seen.units.get(name, ""), _kelvin(seen, roles))
    factor = unit_factor(unit)[0]
    seconds, plus = values * factor, ""
    if roles.nanoseconds is not None:
        seconds = seconds + seen.numbers[roles.nanoseconds] * 1e-9
        plus = f", plus: {{column: {_quoted(seen, roles.nanoseconds)}, unit: ns}}"
        unit, why = "s", "seconds and nanoseconds apart"
    restarts = bool((np.diff(seconds) < 0).any())
    wraps = _wraps(values) if restarts else None
    if wraps:
        plus, restarts = f"{plus}, wraps: {wraps}", False
        seconds = np.cumsum(np.diff(values, prepend=values[0]) % wraps) * factor
    line = f"time: {{column: {_quoted(seen, name)}, unit: {unit}{plus}}}    # {why}; {_clock_words(seconds)}"
    return _Time(line, seconds, restarts)


def _wraps(values: Array) -> int | None:
    """The count at which a counter begins again, where it falls from just under it to nearly nothing."""
    falls = np.flatnonzero(np.diff(values) < 0)
    for bits in (16, 24, 32):
        top = 2.0**bits
        if ((values[falls] > 0.98 * top) & (values[falls] < top) & (values[falls + 1] < 0.02 * top)).all():
            return int(top)
    return None


def _written(seen: Glimpse, name: str) -> _Time:
    texts = seen.texts[name]
    for unit in ("iso", "clock", "%d.%m.%Y %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S", "%d/%m/%Y %H:%M:%S.%f",
                 "%m/%d/%Y %H:%M:%S.%f", "%Y/%m/%d %H:%M:%S.%f", "%Y-%m-%d_%H:%M:%S.%f"):  # fmt: skip
        seconds = written_seconds(texts[:2000], unit)
        if np.isfinite(seconds).mean() > 0.9:
            seconds = written_seconds(texts, unit)
            if unit == "clock":  # midnight is no power-on
                seconds = seconds + 86400.0 * np.cumsum(np.diff(seconds, prepend=seconds[0]) < -43200.0)
            shown = f'"{unit}"' if "%" in unit else unit
            line = f"time: {{column: {_quoted(seen, name)}, unit: {shown}}}    # {_clock_words(seconds)}"
            return _Time(line, seconds, bool((np.diff(seconds) < 0).any()))
    line = (
        f'time: {{column: {_quoted(seen, name)}, unit: "%Y-%m-%d %H:%M:%S.%f"}}    # {CHECK} the pattern: '
        f"the first is {str(texts[0])[:40]!r}"
    )
    return _Time(line, np.arange(len(seen)) / 100.0)


def _kelvin(seen: Glimpse, roles: Roles) -> float:
    """By how much the temperature moves; 0 where it is not known."""
    if roles.temperature is None:
        return 0.0
    low, high = np.nanpercentile(seen.numbers[roles.temperature], [5, 95])
    return float(high - low)


def _time_unit(values: Array, said: str, kelvin: float) -> tuple[str, str]:
    """Unit of the times and why; kelvin: by which the temperature moves in them."""
    unit = plain_unit(said) if said else ""
    if unit and _is_of(unit, "s"):
        return unit, "its name says the unit"
    steps = np.diff(values)
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
    start = float(np.nanmedian(values))
    for one, size in EPOCHS:
        if 1.0 <= start / size < 10.0:
            return one, "since 1970"
    rates = {one: 1.0 / (step * unit_factor(one)[0]) for one in ("s", "ms", "us", "ns")}
    span = float(np.nanmax(values) - np.nanmin(values))
    fit = [
        one
        for one, hz in rates.items()
        if POSSIBLE_HZ[0] <= hz <= POSSIBLE_HZ[1] and kelvin <= FASTEST_K_S * span * unit_factor(one)[0]
    ]
    fit.sort(key=lambda one: not USUAL_HZ[0] <= rates[one] <= USUAL_HZ[1])
    if len(fit) == 1:
        return fit[0], "by its step"
    if fit:
        told = " or ".join(f"{one} ({rates[one]:.4g} Hz)" for one in fit)
        return fit[0], f"{CHECK} the unit: by its step it may be {told}"
    slow = min(rates, key=lambda one: abs(np.log(rates[one])))
    return slow, f"{CHECK} the unit: by its step"


def _clock_words(seconds: Array) -> str:
    clock = clock_of(seconds[np.isfinite(seconds)][:100_000])
    if clock is None:
        return "too few samples to tell the rate"
    jitter = (
        f", jittering by {1e3 * clock.deviation:.3g} ms: the samples are taken together in even steps"
        if clock.jitters
        else ""
    )
    return f"{1 / clock.mean:.5g} Hz{jitter}"


def _rate_of_comments(seen: Glimpse) -> tuple[float, str]:
    """A rate that the lines above the table tell, else 100 Hz to be checked."""
    if seen.reader == "text":
        head = seen.path.read_bytes()[:20_000].decode("utf-8", "replace")
        rows = "\n".join(line for line in head.splitlines()[:60] if re.search(r"[A-Za-z]{2}", line))
        told = re.search(
            r"(?:rate|freq\w*|fs|odr)\D{0,20}?([0-9]+(?:\.[0-9]+)?)\s*(k?)Hz?\b", rows, re.IGNORECASE
        )
        if told and float(told[1]) > 0:
            return float(told[1]) * (1000.0 if told[2] else 1.0), "as the file's head says"
    return 100.0, f"{CHECK}: no column of times; write the sampling rate"


# ---------------------------------------------------------------- sensors


def _units(gyro: _Seen | None, acc: _Seen | None) -> dict[str, Guess]:
    found: dict[str, Guess] = {}
    values = {key: _values(f, getattr(f.roles, key)) for key, f in (("gyro", gyro), ("acc", acc)) if f}
    together = gyro is acc and gyro is not None
    rests = {key: rests_of(np.hstack(list(values.values())) if together else v) for key, v in values.items()}
    windows = {key: windows_of(v) for key, v in values.items()}
    if acc is not None and len(windows["acc"]):
        said = _said(acc, "acc", "m/s^2")
        found["acc"] = acceleration(rests["acc"].means(windows["acc"]), said)
    elif acc is not None:
        found["acc"] = Guess(_said(acc, "acc", "m/s^2") or "m/s^2", sure=False, why="too few samples to tell")
    if gyro is None:
        return found
    carried = None
    if acc is not None and len(windows["gyro"]) > 4 and found["acc"].sure:
        times = windows_of(gyro.time.seconds[:, None])[:, 0]
        force = found["acc"].applied(windows["acc"])
        same = len(values["gyro"]) == len(values["acc"])
        if not together:
            force = _at(times, windows_of(acc.time.seconds[:, None])[:, 0], force)
        if together or same or np.isfinite(force).all():
            carried = carried_by(windows["gyro"], force, times, rests["gyro"])
    at_rest = rests["gyro"].means(windows["gyro"]) if len(windows["gyro"]) else values["gyro"]
    with_si = acc is not None and found["acc"].unit == "m/s^2"
    is_whole = whole_numbers(values["gyro"])
    found["gyro"] = rate(at_rest, _said(gyro, "gyro", "deg/s"), carried, is_whole, with_si)
    return found


def _at(times: Array, other: Array, values: Array) -> Array:
    return np.column_stack([np.interp(times, other, values[:, i]) for i in range(3)])


def _values(file: _Seen, names: Sequence[str]) -> Array:
    """(n, 3) readings, those that are no numbers as the one before."""
    values = np.column_stack([file.seen.numbers[name] for name in names])
    bad = ~np.isfinite(values).all(axis=1)
    if bad.any() and not bad.all():
        place = np.maximum.accumulate(np.where(bad, int(np.argmin(bad)), np.arange(len(values))))
        values = values[place]
    return np.asarray(np.nan_to_num(values))


def _said(file: _Seen, key: str, like: str) -> str:
    """The unit that the names say, where it is one of the kind; ROS' messages are in rad/s and m/s^2."""
    columns = getattr(file.roles, key)
    units = {plain_unit(file.seen.units.get(name, "")) for name in columns}
    if len(units) == 1 and (unit := units.pop()) and _is_of(unit, like):
        return unit
    name = columns[0].lower()
    if re.search(r"angular_velocity|linear_acceleration", name):
        return "rad/s" if key == "gyro" else "m/s^2"
    return ""


def _is_of(unit: str, like: str) -> bool:
    try:
        return dimension_of(unit) == dimension_of(like)
    except UnitError:
        return False


# ---------------------------------------------------------------- text


def _head(file: _Seen, paths: Sequence[Path]) -> Iterator[str]:
    names = " ".join(path.name for path in paths)
    yield f"# Column map of {names}, guessed from the first {len(file.seen)} rows by planner reduce --guess."
    yield f"# Lines that say {CHECK} are not told by the file; `planner reduce --map-help` explains the keys."
    if file.seen.skipped:
        yield f"# {file.seen.skipped} lines above the table are no rows of it and are passed over."
    yield f"format: {file.seen.reader}"
    yield f"# unit: {file.seen.path.stem}    # name of the inertial unit; without it the file's name"


def _time_lines(file: _Seen) -> Iterator[str]:
    yield file.time.line
    if RUN in file.seen.names:
        yield "# the runs of the array are power-ons, one after the other"
    elif file.roles.runs is not None:
        column = _quoted(file.seen, file.roles.runs)
        yield f"run: {{column: {column}}}    # {CHECK}: every value is a power-on of its own"
    elif file.time.restarts:
        yield "run: {clock: restarts}    # the time begins again: power-ons one behind the other"


def _triad(key: str, file: _Seen, first: _Seen, guess: Guess) -> Iterator[str]:
    columns = getattr(file.roles, key)
    axes = ", ".join(f"{axis}: {_quoted(file.seen, name)}" for axis, name in zip(AXES, columns, strict=True))
    parts = [axes, f"unit: {guess.unit}"]
    if any(guess.zero):
        parts.append(f"zero: {_numbers(guess.zero)}")
    if guess.sensitivity is not None:
        parts.append(f"sensitivity: {_numbers(guess.sensitivity)}")
    if file.where:
        parts.append(file.where)
    if file.seen.path != first.seen.path:
        parts.append(f"file: {_file(first.seen.path, file.seen.path)}")
        if file.time.line != first.time.line and file.roles.time is not None:
            parts.append(file.time.line.partition("    #")[0])
    said = f"columns {file.roles.how.get(key, 'by their place')}; unit: {guess.why}"
    yield f"{key}: {{{', '.join(parts)}}}"
    yield f"#    {'' if guess.sure else CHECK + ': '}{said}"


def _numbers(values: tuple[float, float, float]) -> str:
    if len(set(values)) == 1:
        return f"{values[0]:.10g}"
    return "[" + ", ".join(f"{value:.10g}" for value in values) + "]"


def _file(first: Path, other: Path) -> str:
    """The other file by the words in which the names differ, so that the map serves all runs; or by name."""
    for old, new in (("gyro", "acc"), ("gyr", "acc"), ("Gyro", "Acc"), ("Gyroscope", "Accelerometer"),
                     ("gyroscope", "accelerometer"), ("GYRO", "ACC"), ("gyr", "accel")):  # fmt: skip
        for a, b in ((old, new), (new, old)):
            if a in first.name and first.name.replace(a, b) == other.name:
                return f"{{{a}: {b}}}"
    return json.dumps(other.name, ensure_ascii=False)


def _temperature(file: _Seen) -> Iterator[str]:
    name = file.roles.temperature
    if name is None:
        return
    values = file.seen.numbers[name]
    middle = float(np.nanmedian(values))
    said = plain_unit(file.seen.units.get(name, ""))
    unit = said if said in ("degC", "K", "degF") else "K" if 200 < middle < 400 else "degC"
    sure = -90.0 < middle - (273.15 if unit == "K" else 0.0) < 150.0
    why = f"{middle:.4g} in the middle" + (
        "" if sure else f"; {CHECK} scale, offset and zero: no such temperature"
    )
    yield f"temperature: {{column: {_quoted(file.seen, name)}, unit: {unit}}}    # {why}"


def _rest(file: _Seen, no_gyro: bool, no_acc: bool) -> Iterator[str]:
    for label in file.roles.labels:
        quoted = _quoted(file.seen, label)
        yield f"# step: {quoted}    # if it names records; or run: {{column: {quoted}}} if power-ons"
    if no_gyro or no_acc:
        lacking = "gyros" if no_gyro else "accelerometers"
        yield f"# no {lacking} here; if they stand in another file: file: NAME within its line"
    left = list(others(file.seen, file.roles))
    if left:
        yield f"# not used: {', '.join(left[:40])}"


def _quoted(seen: Glimpse, name: str) -> str:
    """A name as YAML and the map read it; its number where the name alone would not do."""
    again = any(other.startswith(f"{name} (column ") for other in seen.names)
    if again or " (column " in name or re.match(r"[-+\d.]", name) or name.startswith("column_"):
        return str(seen.names.index(name) + 1)
    return name if _PLAIN_NAME.fullmatch(name) else json.dumps(name, ensure_ascii=False)
