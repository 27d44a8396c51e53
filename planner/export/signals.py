"""Simulated signals as files: 34-byte packets (K 3.1, fig 3.4), or Parquet; one map for all power-ons."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from typing import Literal, get_args

import numpy as np

from planner.errors import InputError
from planner.nouns.array import Array
from planner.readers.packets import PACKET, PREFIX, READY, crc8
from planner.simulate.signals import Signals
from planner.units import from_si

Form = Literal["parquet", "packets"]
FORMS: tuple[str, ...] = get_args(Form)
DEGC = 0.01  # in one count of T1 … T3
UNIT = "u1"  # as of the dwell tables that are simulated
_COLUMNS = (
    "# the map of these recordings: power-ons of one unit\n"
    f"unit: {UNIT}\n"
    "time: {column: time_s, unit: s}\n"
    "gyro: {x: gyro_x_dps, y: gyro_y_dps, z: gyro_z_dps, unit: deg/s}\n"
    "acc: {x: acc_x_g, y: acc_y_g, z: acc_z_g, unit: g}\n"
    "temperature: {column: temp_degc, unit: degC}\n"
)
_SUFFIX = {"parquet": ".parquet", "packets": ".bin"}


def form_named(word: str) -> Form:
    """`parquet` or `packets`. Raises InputError for another word."""
    if word not in FORMS:
        raise InputError(f"--signals must be {' or '.join(FORMS)}, not {word!r}")
    return "parquet" if word == "parquet" else "packets"


def signal_files(signals: Signals, form: Form) -> Mapping[str, str | bytes]:
    """Name -> content of one power-on: the recording; of Parquet the map that `reduce` needs, too."""
    name = f"run_{signals.run:04d}"
    if form == "parquet":
        labelled = bool((signals.step != "").any())
        return {name + _SUFFIX[form]: _parquet(signals), "map.yaml": _COLUMNS + "step: step\n" * labelled}
    return {name + _SUFFIX[form]: packet_bytes(signals)}


def packet_bytes(signals: Signals) -> bytes:
    """The stream: W in deg/s, A in g, T in 0.01 degC, L 1 within records, C 1 (ready), CRC-8."""
    rows = np.zeros(len(signals.time), dtype=PACKET)
    rows["P"], rows["C"] = PREFIX, READY[0]
    rows["W"], rows["A"] = _shown(signals.gyro, "deg/s"), _shown(signals.acc, "g")
    rows["T"] = np.clip(np.round(signals.temperature_degc / DEGC), -32768, 32767)[:, None]
    rows["L"] = signals.step != ""
    plain = rows.view(np.uint8).reshape(len(rows), -1)
    rows["CS"] = crc8(plain[:, :33])
    return rows.tobytes()


def packets_map(starts: Mapping[str, float], rate: float) -> str:
    """The map of all power-ons' packets; starts: file -> s on the plan's clock."""
    times = "".join(f"  {name}: {start:.6f} s\n" for name, start in starts.items())
    return (
        "# the map of these packets, a file a power-on; --plan with it names the records\n"
        f"unit: {UNIT}\n"
        f"rate: {rate:g} Hz\n"
        f"plan_time:\n{times}"
        "gyro: {x: W1, y: W2, z: W3, unit: deg/s}\n"
        "acc: {x: A1, y: A2, z: A3, unit: g}\n"
        f"temperature: {{column: T1, unit: degC, scale: {DEGC}}}\n"
    )


def _parquet(signals: Signals) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns: dict[str, object] = {"time_s": signals.time}
    for axis, (rate, force) in zip("xyz", zip(signals.gyro.T, signals.acc.T, strict=True), strict=True):
        columns[f"gyro_{axis}_dps"] = _shown(rate, "deg/s")
        columns[f"acc_{axis}_g"] = _shown(force, "g")
    columns["temp_degc"] = signals.temperature_degc
    if (signals.step != "").any():
        columns["step"] = signals.step
    buffer = BytesIO()
    pq.write_table(pa.table(columns), buffer)
    return buffer.getvalue()


def _shown(values: Array, unit: str) -> Array:
    return np.asarray(values * from_si(1.0, unit))
