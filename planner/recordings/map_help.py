"""What a column map can say, for people: an example of every key, and the keys from the model itself."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from planner.recordings.column_map import (
    AxisColumns,
    ColumnMap,
    FullScale,
    OneColumn,
    PowerOns,
    TimeColumn,
    UnitColumn,
)

_INTRODUCTION = """\
A column map says what a recording holds: a YAML file for `planner reduce`, `apply` and `look` (--columns).
`planner reduce --guess FILE -o map.yaml` writes one from what the file shows; what it cannot tell says CHECK.

    value = ± ((reading − zero) · scale + offset) in `unit`        sensitivity = 1 / scale, counts in one unit

A column is named as in the file's header, or by its number from 1; a minus turns its sign. A constant is a
quantity: `x: 0 deg/s`. Inside, x, y, z are the body's axes: swap and turn here until they are.

One file, times in microseconds, accelerometers in counts of 1/2048 g with the z axis pointing the other way:

    time: {column: timestamp, unit: us}
    gyro: {x: gx, y: gy, z: gz, unit: deg/s}
    acc: {x: ax, y: ay, z: -az, unit: g, zero: [12, -30, 5], sensitivity: 2048}
    temperature: {column: T, unit: degC, scale: 0.01}

No times: give the rate.                      rate: 100 Hz
Times in words.                               time: {column: stamp, unit: iso}
  hours:minutes:seconds                       time: {column: stamp, unit: clock}
  any pattern                                 time: {column: stamp, unit: "%d.%m.%Y %H:%M:%S.%f"}
ROS, seconds and nanoseconds apart.           time: {column: secs, unit: s, plus: {column: nsecs, unit: ns}}
A counter that begins again.                  time: {column: ticks, unit: us, wraps: 4294967296}

Accelerometers and gyros in files of their own, joined by time; RAW is the first of them, or their folder:

    time: {column: 1, unit: s}
    acc: {x: 2, y: 3, z: 4, unit: m/s^2}
    gyro: {file: {acc: gyro}, x: 2, y: 3, z: 4, unit: rad/s}      # run1_acc.txt takes run1_gyro.txt along
    gyro: {file: gyro.txt, x: 2, y: 3, z: 4, unit: rad/s}         # or by its name
    gyro: {file: gyro.csv, x: gx, y: gy, z: gz, unit: rad/s, time: {column: t_ms, unit: ms}}

Rows of both kinds in one file:

    acc: {where: {sensor: ACC}, x: x, y: y, z: z, unit: m/s^2}
    gyro: {where: {sensor: GYRO}, x: x, y: y, z: z, unit: deg/s}

Many power-ons in one file:

    run: {column: trial}        # every value of it is one
    run: {gap: 60 s}            # a longer gap in time is one
    run: {clock: restarts}      # where the time begins again
    unit: {column: serial}      # and many inertial units

Arrays (.npy, .npz, .mat, .h5): (n, k) gives columns NAME_1 … NAME_k; (n, k, m) and (m, n, k) are m power-ons.

A clock that jitters is found by itself: samples are then taken together in even steps, gaps stay, and the
account says how much it jitters. Rests are found by the recording's own noise. Hand turns between them are
kept as rows of kind `motion`, for `calibrate --method rests_and_turns`; motions: false leaves them out.
"""

_PARTS: tuple[tuple[str, type[BaseModel]], ...] = (
    ("Keys", ColumnMap),
    ("gyro, acc, ref_rate, ref_acc", AxisColumns),
    ("time", TimeColumn),
    ("temperature", OneColumn),
    ("run", PowerOns),
    ("unit", UnitColumn),
    ("full_scale", FullScale),
)
_SECONDS = ("plan_time", "shortest")
_WORDS = {
    "rate": "sampling rate, as 100 Hz; needed when no column holds the time",
    "time": "the column of the time",
    "gyro": "three columns of gyros",
    "acc": "three columns of accelerometers",
    "temperature": "the column of the unit's temperature",
    "ref_rate": "the true rate, where the bench recorded it",
    "ref_acc": "the true specific force",
    "full_scale": "readings at these are saturated",
    "x": "column of the body's x axis",
    "y": "of its y axis",
    "z": "of its z axis",
    "unit": "of the value, as deg/s, rad/s, g, m/s^2",
    "scale": "units in one count",
    "offset": "added after the scale, in the unit",
    "file": "another file of the same run: its name, or {_acc: _gyro} to replace in the recording's",
    "planner": "version of the map's form",
    "column": "name or number of the column",
}


def map_help_text() -> str:
    """The whole help."""
    lines = [_INTRODUCTION]
    for title, model in _PARTS:
        lines.append(f"{title}:")
        for key, field in model.model_fields.items():
            unit = " s" if key in _SECONDS else ""
            default = (
                "" if field.is_required() or field.default in (None, {}) else _default(field.default, unit)
            )
            lines.append(f"    {key:<12} {field.description or _WORDS.get(key, '')}{default}")
        lines.append("")
    lines.append("`planner schema --of column-map` prints the JSON Schema, for editors.")
    return "\n".join([*lines, ""])


def _default(value: Any, unit: str) -> str:
    if isinstance(value, BaseModel) or repr(value).startswith("PydanticUndefined"):
        return ""
    if isinstance(value, tuple):
        value = value[0]
    shown = (
        str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else value
    )
    return f" [{shown}{unit}]"
