"""Which column of a file is what: by its name, else by how its numbers behave.

At rest gyros read the same in every attitude and accelerometers do not; a clock rises.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array
from planner.recordings.glimpse import Glimpse, bare_name, unit_of_name

_NO_SENSOR = re.compile(r"mag|quat|orient|euler|cov|ref|pos|bias|std|_err|baro|press|gps|roll|pitch|yaw|^m$")
_GYRO = re.compile(
    r"gyr|omega|angular|ang_?vel|angvel|rotat|rot_?rate|rate|turn|^w$|^g$|^r$|^om$|winkel|dreh"
)
_ACC = re.compile(r"acc|linear|force|grav|^a$|^f$|^sf$|beschl")
_TIME = re.compile(r"time|stamp|epoch|utc|^t$|^ts$|secs?$|zeit|clock|^date")
_COUNTER = re.compile(r"count|index|sample|seq|packet|^n$|^#$|^i$|number|frame$")
_DEGREES = re.compile(r"temp|^t\d?$|therm|degc|celsius")
_RUN = re.compile(r"run|session|trial|power|repeat|experiment|turn_?on|segment|file")
_LABEL = re.compile(r"part|label|position|pose|orientation|step|state|activity|test|phase|section|id$")
_AXIS = re.compile(r"^(.*?)[\s._\-\[/]*(?:axis)?[\s._\-]*([xyz]|[0-3])\]?$", re.IGNORECASE)
WINDOW = 20


@dataclass(frozen=True)
class Roles:
    """Column names by what they are; how: key -> by what it was told. Keys as in a map.

    runs: the column that tells power-ons apart; labels: columns of words that name stretches
    """

    time: str | None
    nanoseconds: str | None
    gyro: tuple[str, str, str] | None
    acc: tuple[str, str, str] | None
    temperature: str | None
    runs: str | None
    labels: tuple[str, ...]
    how: Mapping[str, str]


def roles_of(seen: Glimpse) -> Roles:
    """What each column is."""
    how: dict[str, str] = {}
    time, nanoseconds = _time(seen, how)
    taken = {time, nanoseconds, _counter(seen)}
    triads = _triads([name for name in seen.numbers if name not in taken])
    gyro = _named(triads, _GYRO)
    acc = _named([t for t in triads if t[1] != gyro], _ACC)
    how |= {key: "by name" for key, found in (("gyro", gyro), ("acc", acc)) if found}
    if gyro is None or acc is None:
        free = [n for n in seen.numbers if n not in {*taken, *(gyro or ()), *(acc or ())}]
        gyro, acc = _by_numbers(seen, free, gyro, acc, how)
    taken |= {*(gyro or ()), *(acc or ())}
    temperature = next(
        (n for n in seen.numbers if n not in taken and _DEGREES.search(_plain(n)) and _like_degrees(seen, n)),
        None,
    )
    words = [*seen.texts, *(n for n in seen.numbers if n not in taken and n != temperature)]
    few = [n for n in words if n != time and 1 < _kinds(seen, n) <= max(2, len(seen) // 50)]
    runs = next((n for n in few if _RUN.search(_plain(n))), None)
    labels = tuple(n for n in few if n != runs and (n in seen.texts or _LABEL.search(_plain(n))))
    return Roles(time, nanoseconds, gyro, acc, temperature, runs, labels, how)


def _plain(name: str) -> str:
    return bare_name(name).lower()


# ---------------------------------------------------------------- time


def _time(seen: Glimpse, how: dict[str, str]) -> tuple[str | None, str | None]:
    """The column of the time, and that of its nanoseconds where they stand apart."""
    rising = [n for n, values in seen.numbers.items() if _rises(values)]
    seconds = [n for n in seen.numbers if re.search(r"(^|[._ ])secs?$", _plain(n))]
    fine = [n for n in seen.numbers if re.search(r"(^|[._ ])n(ano)?_?secs?$", _plain(n))]
    if seconds and fine and 1e6 < np.nanmax(seen.numbers[fine[0]]) < 1e9:
        how["time"] = "by name"
        return seconds[0], fine[0]
    for name in rising:
        if _TIME.search(_plain(name)):
            how["time"] = "by name"
            return name, None
    for name, values in seen.texts.items():
        if _TIME.search(_plain(name)) or re.match(r"\d{1,4}[-:./T]\d", str(values[0])):
            how["time"] = "by its words"
            return name, None
    for name in rising:
        steps = np.diff(seen.numbers[name])
        if not _COUNTER.search(_plain(name)) and not (steps == 1).all():
            how["time"] = "it rises"
            return name, None
    return None, None


def _rises(values: Array) -> bool:
    """Nearly always: power-ons one behind the other begin again, and a row may be out of order."""
    steps = np.diff(values[np.isfinite(values)])
    return len(steps) > 0 and (steps > 0).mean() > 0.5 and (steps < 0).mean() < 0.02


def _counter(seen: Glimpse) -> str | None:
    found = (n for n, v in seen.numbers.items() if _COUNTER.search(_plain(n)) and _rises(v))
    return next(found, None)


def kinds_of_rows(seen: Glimpse) -> tuple[str, dict[str, str]] | None:
    """A column that says of each row which sensor it is of: its name, and `gyro`, `acc` -> what it says."""
    for name, values in seen.texts.items():
        kinds = [str(kind) for kind in np.unique(values[:2000])]
        gyro = [kind for kind in kinds if _GYRO.search(kind.lower())]
        acc = [kind for kind in kinds if _ACC.search(kind.lower())]
        if len(gyro) == len(acc) == 1 and gyro != acc:
            return name, {"gyro": gyro[0], "acc": acc[0]}
    return None


# ---------------------------------------------------------------- triads


def _triads(names: Sequence[str]) -> list[tuple[str, tuple[str, str, str]]]:
    """(stem, columns x y z) of names that differ by their axis alone."""
    stems: dict[tuple[str, str], dict[str, str]] = {}
    for name in names:
        plain = _without_unit(name)
        told = _AXIS.match(plain)
        if told:
            kind = "letter" if told[2].lower() in "xyz" else "digit"
            stems.setdefault((told[1].lower().strip(" ._-"), kind), {})[told[2].lower()] = name
        led = re.match(r"^([xyz])[\s._\-]+(.+)$", plain, re.IGNORECASE)
        if led:  # `x acc`
            stems.setdefault((led[2].lower(), "led"), {})[led[1].lower()] = name
    found = []
    for (stem, _), axes in stems.items():
        for signs in ("xyz", "123", "012"):
            if set(signs) <= set(axes):
                found.append((stem, (axes[signs[0]], axes[signs[1]], axes[signs[2]])))
                break
    return found


def _without_unit(name: str) -> str:
    """`gyro_x_dps` -> `gyro_x`; the unit is the last part or the last two."""
    plain = bare_name(name)
    unit = unit_of_name(plain)
    for count in (1, 2):
        parts = re.split(r"(?<=[_\s.])", plain)
        shorter = "".join(parts[:-count]).rstrip("_ .")
        if unit and _AXIS.match(shorter) and shorter:
            return shorter
    return plain


def _named(
    triads: Sequence[tuple[str, tuple[str, str, str]]], pattern: re.Pattern[str]
) -> tuple[str, str, str] | None:
    for stem, columns in triads:
        last = re.split(r"[./]", stem)[-1] or stem
        if not _NO_SENSOR.search(stem) and (pattern.search(last) or pattern.search(stem)):
            return columns
    return None


def _by_numbers(
    seen: Glimpse,
    free: Sequence[str],
    gyro: tuple[str, str, str] | None,
    acc: tuple[str, str, str] | None,
    how: dict[str, str],
) -> tuple[tuple[str, str, str] | None, tuple[str, str, str] | None]:
    """Triads of neighbouring columns by their behaviour: at rest gyros read the same in every attitude."""
    order = [
        n
        for n in seen.names
        if n in free and not _NO_SENSOR.search(_plain(n)) and np.ptp(seen.numbers[n]) > 0
    ]
    triads = [(order[i], order[i + 1], order[i + 2]) for i in range(0, len(order) - 2, 3)]
    if not triads:
        return gyro, acc
    change = {t: attitude_change(np.column_stack([seen.numbers[n] for n in t])) for t in triads}
    name = seen.path.stem.lower()
    if gyro is None and acc is None and len(triads) == 1:
        (lone,) = triads
        is_gyro = bool(re.search(r"gyr|omega|rate", name)) or (
            not re.search(r"acc", name) and not _near_gravity(seen, lone) and change[lone] < 10.0
        )
        how["gyro" if is_gyro else "acc"] = (
            "by the file's name" if re.search(r"gyr|acc", name) else "by their numbers"
        )
        return (lone, None) if is_gyro else (None, lone)
    ranked = sorted(triads, key=lambda t: (_near_gravity(seen, t), change[t]), reverse=True)
    if acc is None:
        acc = ranked.pop(0)
        how["acc"] = "by numbers that change with attitude"
    if gyro is None and ranked:
        gyro = next(t for t in triads if t in ranked)
        how["gyro"] = "by numbers that are the same at every rest"
    return gyro, acc


def attitude_change(values: Array) -> float:
    """How far the means of quiet windows lie apart, over the scatter within them; (n, 3) readings."""
    means, scatter = quiet_windows(values)
    within = np.maximum(np.median(scatter, axis=0), 1e-12 * np.abs(means).max(initial=1e-300))
    return float((np.std(means, axis=0) / within).max()) if len(means) > 1 else 0.0


def quiet_windows(values: Array) -> tuple[Array, Array]:
    """(m, k) means and standard deviations of the quieter half of windows of 20 samples of (n, k) values."""
    rows = len(values) // WINDOW
    if rows < 1:
        return values.mean(axis=0, keepdims=True), values.std(axis=0, keepdims=True)
    cut = values[: rows * WINDOW].reshape(rows, WINDOW, values.shape[1])
    means, scatter = cut.mean(axis=1), cut.std(axis=1)
    usual = np.maximum(np.median(scatter, axis=0), 1e-300)
    loudness = np.nan_to_num((scatter / usual).max(axis=1), nan=np.inf)
    quiet = loudness <= np.median(loudness)
    return means[quiet], scatter[quiet]


def _near_gravity(seen: Glimpse, triad: tuple[str, str, str]) -> bool:
    """Whether |v| at rest is that of gravity in m/s^2, g or mg."""
    means, _ = quiet_windows(np.column_stack([seen.numbers[n] for n in triad]))
    size = float(np.median(np.linalg.norm(means, axis=1)))
    return any(abs(size / one - 1) < 0.1 for one in (9.80665, 1.0, 1000.0))


# ---------------------------------------------------------------- the rest


def _like_degrees(seen: Glimpse, name: str) -> bool:
    values = seen.numbers[name]
    known = values[np.isfinite(values)]
    return len(known) > 0 and not (_rises(values) and np.ptp(known) > 500)


def _kinds(seen: Glimpse, name: str) -> int:
    """The number of different values of a column that stays the same for long stretches, else 0."""
    values = seen.texts[name] if name in seen.texts else seen.numbers[name]
    return len(np.unique(values[:: max(1, len(values) // 20_000)]))


def others(seen: Glimpse, roles: Roles) -> Iterator[str]:
    """Columns that no role took."""
    taken = {
        roles.time,
        roles.nanoseconds,
        roles.temperature,
        roles.runs,
        *(roles.gyro or ()),
        *(roles.acc or ()),
    }
    return (name for name in seen.names if name not in {*taken, *roles.labels})
