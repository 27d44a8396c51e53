"""One recording as many labs would write it: the same six attitudes in every form, and the map for each."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.recordings.recordings import Array, G, tumbled

RATE = 100.0
RECORDED = tumbled(rate=RATE, rest=3.0, turns=(0, 1, 2, 0, 1))
RESTS = len(RECORDED.rests)
COLUMNS = ("t", "gx", "gy", "gz", "ax", "ay", "az")
SENSORS = "gyro: {x: gx, y: gy, z: gz, unit: deg/s}\nacc: {x: ax, y: ay, z: az, unit: g}\n"
PLAIN = SENSORS + "time: {column: t, unit: s}\n"


def readings(seed: int = 1) -> Array:
    """(n, 7) t s, gyro deg/s, acc g, with noise."""
    return RECORDED.readings(0.05, 0.002, seed)[:, :7]


def runs(count: int) -> Array:
    """(count, n, 7) power-ons, each with noise of its own."""
    return np.array([readings(seed) for seed in range(count)])


def rows(values: Array, sign: str = ",", digits: int = 6) -> list[str]:
    return [sign.join(f"{x:.{digits}f}" for x in row) for row in values]


def text(path: Path, lines: list[str], end: str = "\n") -> Path:
    path.write_bytes((end.join(lines) + end).encode())
    return path


Lab = Callable[[Path], tuple[Path, str]]


def decimal_commas(folder: Path) -> tuple[Path, str]:
    body = [line.replace(".", ",") for line in rows(readings(), ";")]
    return text(folder / "a.csv", ["Zeit;gx;gy;gz;ax;ay;az", *body], "\r\n"), PLAIN.replace("n: t", "n: Zeit")


def decimal_commas_and_tabs(folder: Path) -> tuple[Path, str]:
    body = [line.replace(".", ",") for line in rows(readings(), "\t")]
    return text(folder / "a.tsv", ["\t".join(COLUMNS), *body]), PLAIN


def names_in_a_comment(folder: Path) -> tuple[Path, str]:
    return text(folder / "a.txt", ["# our lab", "# " + " ".join(COLUMNS), *rows(readings(), " ")]), PLAIN


def numbered_names_in_comments(folder: Path) -> tuple[Path, str]:
    head = [f"% {i}: {name}" for i, name in enumerate(COLUMNS, 1)]
    return text(folder / "a.dat", [*head, *rows(readings(), "  ")]), PLAIN


def preamble_and_units(folder: Path) -> tuple[Path, str]:
    head = ["Device: X 12", "Rate, 100 Hz", "", ",".join(COLUMNS), "[s],[deg/s],[deg/s],[deg/s],[g],[g],[g]"]
    return text(folder / "a.csv", [*head, *rows(readings())]), PLAIN


def line_ends_of_old_computers(folder: Path) -> tuple[Path, str]:
    return text(folder / "a.csv", [",".join(COLUMNS), *rows(readings())], "\r"), PLAIN


def a_comma_at_the_end(folder: Path) -> tuple[Path, str]:
    return text(folder / "a.csv", [",".join(COLUMNS), *(row + "," for row in rows(readings()))]), PLAIN


def told_by_excel(folder: Path) -> tuple[Path, str]:
    body = [";".join(f'"{x:.6f}"' for x in row) for row in readings()]
    return text(folder / "a.csv", ["sep=;", ";".join(COLUMNS), *body]), PLAIN


def the_same_names_twice(folder: Path) -> tuple[Path, str]:
    columns = "gyro: {x: 2, y: 3, z: 4, unit: deg/s}\nacc: {x: 5, y: 6, z: 7, unit: g}\n"
    columns += "time: {column: t, unit: s}\n"
    return text(folder / "a.csv", ["t,X,Y,Z,X,Y,Z", *rows(readings())]), columns


def counts(folder: Path) -> tuple[Path, str]:
    values = readings()
    gyro, acc = (
        np.round(values[:, 1:4] * 16.4 + 32768),
        np.round(values[:, 4:] * [2048, 2050, 2046] + [9, -8, 7]),
    )
    body = np.column_stack([values[:, 0], gyro, acc])
    columns = (
        "time: {column: t, unit: s}\n"
        "gyro: {x: gx, y: gy, z: gz, unit: dps, zero: 32768, sensitivity: 16.4}\n"
        "acc: {x: ax, y: ay, z: az, unit: g, zero: [9, -8, 7], sensitivity: {x: 2048, y: 2050, z: 2046}}\n"
    )
    return text(folder / "a.csv", [",".join(COLUMNS), *rows(body, digits=4)]), columns


def offsets_in_units(folder: Path) -> tuple[Path, str]:
    values = readings() * [1, 1, 1, 1, 1e3, -1e3, 1e3] + [0, 5, 5, 5, 0, 0, 0]
    columns = (
        "time: {column: t, unit: s}\n"
        "gyro: {x: gx, y: gy, z: gz, unit: deg/s, offset: -5}\n"
        "acc: {x: ax, y: -ay, z: az, unit: m/s2, scale: 9.80665e-3}\n"
    )
    return text(folder / "a.csv", [",".join(COLUMNS), *rows(values)]), columns


def of_ros(folder: Path) -> tuple[Path, str]:
    values = readings()
    names = [f"field.{kind}.{axis}" for kind in ("angular_velocity", "linear_acceleration") for axis in "xyz"]
    head = "%time,field.header.frame_id," + ",".join(names)
    stamps = 1_600_000_000_000_000_000 + np.round(values[:, 0] * 1e9).astype(np.int64)
    si = np.hstack([np.radians(values[:, 1:4]), values[:, 4:] * G])
    body = [f"{stamp},imu_link,{row}" for stamp, row in zip(stamps, rows(si, digits=8), strict=True)]
    columns = "time: {column: time, unit: ns}\n" + "".join(
        f"{key}: {{x: field.{kind}.x, y: field.{kind}.y, z: field.{kind}.z, unit: {unit}}}\n"
        for key, kind, unit in (
            ("gyro", "angular_velocity", "rad/s"),
            ("acc", "linear_acceleration", "m/s^2"),
        )
    )
    return text(folder / "imu.csv", [head, *body]), columns


def seconds_and_nanoseconds(folder: Path) -> tuple[Path, str]:
    values = readings()
    ns = 1_600_000_000_000_000_000 + np.round(values[:, 0] * 1e9).astype(np.int64)
    body = [
        f"{n // 10**9},{n % 10**9},{row}" for n, row in zip(ns.tolist(), rows(values[:, 1:]), strict=True)
    ]
    columns = SENSORS + "time: {column: secs, unit: s, plus: {column: nsecs, unit: ns}}\n"
    return text(folder / "a.csv", ["secs,nsecs,gx,gy,gz,ax,ay,az", *body]), columns


def moment(seconds: float) -> dt.datetime:
    return dt.datetime(2026, 3, 1, 23, 59, 50) + dt.timedelta(seconds=seconds)


def written(shown: Callable[[float], str], unit: str) -> Lab:
    def lab(folder: Path) -> tuple[Path, str]:
        values = readings()
        body = [
            f"{shown(t)},{row}" for t, row in zip(values[:, 0].tolist(), rows(values[:, 1:]), strict=True)
        ]
        path = text(folder / "a.csv", [",".join(COLUMNS), *body])
        return path, PLAIN.replace("unit: s}", f"unit: {unit}}}")

    return lab


def wrapping(folder: Path) -> tuple[Path, str]:
    values = readings()
    ticks = (np.round(values[:, 0] * 1e6).astype(np.int64) + 2**32 - 7_000_000) % 2**32
    body = [f"{tick},{row}" for tick, row in zip(ticks.tolist(), rows(values[:, 1:]), strict=True)]
    columns = SENSORS + "time: {column: t, unit: us, wraps: 4294967296}\n"
    return text(folder / "a.csv", [",".join(COLUMNS), *body]), columns


def apart_and_called_mat(folder: Path) -> tuple[Path, str]:
    """Accelerometers and gyros in texts called .mat, raw counts about a zero, clocks 2 ms apart."""
    values = readings()
    acc = np.round(values[:, 4:] * 4065 + [33124, 33276, 32360])
    gyro = np.round(values[:, 1:4] * 83.4 + 32768)
    np.savetxt(folder / "xsens_acc.mat", np.column_stack([values[:, 0], acc]), fmt="%.7e")
    np.savetxt(folder / "xsens_gyro.mat", np.column_stack([values[:, 0] + 0.002, gyro]), fmt="%.7e")
    columns = (
        "time: {column: 1, unit: s}\n"
        "acc: {x: 2, y: 3, z: 4, unit: g, zero: [33124, 33276, 32360], sensitivity: 4065}\n"
        "gyro: {file: {acc: gyro}, x: 2, y: 3, z: 4, unit: deg/s, zero: 32768, sensitivity: 83.4}\n"
    )
    return folder / "xsens_acc.mat", columns


def apart_at_other_rates(folder: Path) -> tuple[Path, str]:
    """Accelerometers at half the rate, times in ms, in a folder of the run."""
    values = readings()
    text(folder / "gyro.csv", ["t,gx,gy,gz", *rows(values[:, :4])])
    slow = values[::2, [0, 4, 5, 6]] * [1e3, 1, 1, 1]
    text(folder / "acc.csv", ["ms,ax,ay,az", *rows(slow)])
    columns = (
        "time: {column: t, unit: s}\ngyro: {file: gyro.csv, x: gx, y: gy, z: gz, unit: deg/s}\n"
        "acc: {file: acc.csv, x: ax, y: ay, z: az, unit: g, time: {column: ms, unit: ms}}\n"
    )
    return folder, columns


def rows_in_turn(folder: Path) -> tuple[Path, str]:
    lines = ["time,sensor,x,y,z"]
    for t, gx, gy, gz, ax, ay, az in readings():
        lines.append(f"{t:.4f},ACC,{ax:.6f},{ay:.6f},{az:.6f}")
        lines.append(f"{t + 0.0013:.4f},GYRO,{gx:.6f},{gy:.6f},{gz:.6f}")
    columns = (
        "time: {column: time, unit: s}\nacc: {where: {sensor: ACC}, x: x, y: y, z: z, unit: g}\n"
        "gyro: {where: {sensor: GYRO}, x: x, y: y, z: z, unit: deg/s}\n"
    )
    return text(folder / "a.csv", lines), columns


ONE_RUN: dict[str, Lab] = {
    lab.__name__: lab
    for lab in (
        decimal_commas, decimal_commas_and_tabs, names_in_a_comment, numbered_names_in_comments,
        preamble_and_units, line_ends_of_old_computers, a_comma_at_the_end, told_by_excel,
        the_same_names_twice, counts, offsets_in_units, of_ros, seconds_and_nanoseconds, wrapping,
        apart_and_called_mat, apart_at_other_rates, rows_in_turn,
    )
} | {
    "iso": written(lambda t: moment(t).isoformat(timespec="milliseconds") + "+01:00", "iso"),
    "iso_with_a_blank": written(lambda t: moment(t).isoformat(" ", "milliseconds") + "Z", "iso"),
    "time_of_day": written(lambda t: moment(t).isoformat(timespec="milliseconds")[11:], "clock"),
    "a_pattern": written(lambda t: moment(t).strftime("%d.%m.%Y %H:%M:%S.%f"), '"%d.%m.%Y %H:%M:%S.%f"'),
}  # fmt: skip


# ---------------------------------------------------------------- several power-ons in one file


def by_a_column(folder: Path) -> tuple[Path, str]:
    body = [f"{row},trial {k}" for k, values in enumerate(runs(3)) for row in rows(values)]
    return text(folder / "a.csv", [",".join(COLUMNS) + ",run", *body]), PLAIN + "run: {column: run}\n"


def by_the_clock(folder: Path) -> tuple[Path, str]:
    body = [row for values in runs(3) for row in rows(values)]
    return text(folder / "a.csv", [",".join(COLUMNS), *body]), PLAIN + "run: {clock: restarts}\n"


def by_a_gap(folder: Path) -> tuple[Path, str]:
    body = [row for k, values in enumerate(runs(3)) for row in rows(values + np.eye(1, 7) * 900.0 * k)]
    return text(folder / "a.csv", [",".join(COLUMNS), *body]), PLAIN + "run: {gap: 60 s}\n"


def n_3_m(folder: Path) -> tuple[Path, str]:
    values = runs(3)
    arrays = {key: np.moveaxis(values[:, :, part], 0, 2) for key, part in _PARTS.items()}
    np.savez(folder / "a.npz", t=values[0, :, 0], **arrays)
    return folder / "a.npz", _arrays("time: {column: t, unit: s}\n")


def m_n_3(folder: Path) -> tuple[Path, str]:
    values = runs(3)
    for key, part in _PARTS.items():
        np.save(folder / f"{key}.npy", values[:, :, part])
    columns = (
        "rate: 100 Hz\nacc: {x: 1, y: 2, z: 3, unit: g}\n"
        "gyro: {file: gyro.npy, x: 1, y: 2, z: 3, unit: deg/s}\n"
    )
    return folder / "acc.npy", columns


def of_matlab(folder: Path) -> tuple[Path, str]:
    from scipy.io import savemat

    values = runs(3)
    arrays = {key: np.moveaxis(values[:, :, part], 0, 2) for key, part in _PARTS.items()}
    savemat(folder / "a.mat", {"t": values[0, :, 0], **arrays})
    return folder / "a.mat", _arrays("time: {column: t, unit: s}\n")


def of_hdf5(folder: Path) -> tuple[Path, str]:
    import h5py

    values = runs(3)
    with h5py.File(folder / "a.h5", "w") as file:
        for key, part in _PARTS.items():
            file[key] = values[:, :, part]
    return folder / "a.h5", _arrays("rate: 100 Hz\n")


_PARTS = {"gyro": slice(1, 4), "acc": slice(4, 7)}


def _arrays(clock: str) -> str:
    gyro = "gyro: {x: gyro_1, y: gyro_2, z: gyro_3, unit: deg/s}\n"
    return f"{clock}{gyro}acc: {{x: acc_1, y: acc_2, z: acc_3, unit: g}}\n"


THREE_RUNS: dict[str, Lab] = {
    lab.__name__: lab for lab in (by_a_column, by_the_clock, by_a_gap, n_3_m, m_n_3, of_matlab, of_hdf5)
}
