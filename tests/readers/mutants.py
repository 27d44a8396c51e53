"""Small good files of every format, and what damage makes of them: for the fuzz of readers and tables."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from planner.dwells.dwell_files import dwells_bytes, read_dwells
from planner.errors import PlannerError
from planner.recordings.column_map import ColumnMap
from planner.recordings.guess_map import guessed_map
from planner.recordings.recording import Recording, recordings_of
from tests.recordings.rested import table_of

ROWS = 40
NAMES = ("t", "gx", "gy", "gz", "ax", "ay", "az")
_SENSORS = {
    "gyro": {"x": "gx", "y": "gy", "z": "gz", "unit": "deg/s"},
    "acc": {"x": "ax", "y": "ay", "z": "az", "unit": "g"},
}
_NUMBERED = {
    "gyro": {"x": 2, "y": 3, "z": 4, "unit": "deg/s"},
    "acc": {"x": 5, "y": 6, "z": 7, "unit": "g"},
}
SECONDS = {"time": {"column": 1, "unit": "s"}}
MAPS = {
    "csv": ColumnMap.model_validate({**_SENSORS, **SECONDS}),
    "tsv": ColumnMap.model_validate({**_SENSORS, **SECONDS, "run": {"clock": "restarts"}}),
    "txt": ColumnMap.model_validate({**_SENSORS, "time": {"column": "t", "unit": "iso"}}),
    "log": ColumnMap.model_validate({**_SENSORS, **SECONDS, "unit": {"column": "who"}, "step": "who"}),
    "npy": ColumnMap.model_validate({**_NUMBERED, **SECONDS}),
    "npz": ColumnMap.model_validate({**_NUMBERED, **SECONDS}),
    "parquet": ColumnMap.model_validate({**_SENSORS, **SECONDS}),
    "h5": ColumnMap.model_validate({**_SENSORS, "time": {"column": "t", "unit": "s"}}),
    "mat": ColumnMap.model_validate({**_SENSORS, "time": {"column": "t", "unit": "s"}}),
}
# what damage to text is made of: signs that a table means something by
WORDS = (
    b'"', b"\r", b"\n", b"\r\n", b",", b";", b"\t", b" ", b"#", b"%", b"nan", b"inf", b"-", b"1e999", b"\0",
    b"\xff", "\u0661".encode(), "\u00bd".encode(), b"\xef\xbb\xbf", b"1_0", b"0x1F", b"1,5", b"''",
    b"sep=;\n", b".", b"e", b"+",
)  # fmt: skip


def good_files(folder: Path) -> dict[str, bytes]:
    """Suffix -> the bytes of a good file; `dwells.csv` is a dwell table."""
    rng = np.random.default_rng(5)
    sensors = rng.normal(size=(ROWS, 6)) + np.array([0, 0, 0, 0, 0, 9])
    values = np.column_stack([np.arange(ROWS) / 100.0, sensors])
    body = [",".join(f"{x:.5f}" for x in row) for row in values]
    iso = [
        f"2026-03-01T00:00:{t:06.3f},{row.partition(',')[2]}"
        for t, row in zip(values[:, 0], body, strict=True)
    ]
    words = [f'{row},"sn{k % 2}"' for k, row in enumerate(body)]
    commas = [row.replace(",", "\t").replace(".", ",") for row in body]
    names = ",".join(NAMES)
    found = {
        "csv": "\n".join([names, *body, ""]).encode(),
        "tsv": "\r\n".join(["# a comment", names.replace(",", "\t"), *commas, ""]).encode(),
        "txt": "\n".join([names, *iso, ""]).encode(),
        "log": "\n".join([f"{names},who", *words, ""]).encode(),
    }
    found |= dict(_arrays(folder, values))
    rests = [slice(8 * k, 8 * k + 8) for k in range(5)]
    found["dwells.csv"] = dwells_bytes(table_of(values[:, 4:], values[:, 1:4] * 1e-2, rests, 100.0))
    return found


def _arrays(folder: Path, values: np.ndarray) -> Iterator[tuple[str, bytes]]:
    import h5py
    import pyarrow as pa
    import pyarrow.parquet as pq
    from scipy.io import savemat

    named = dict(zip(NAMES, values.T, strict=True))
    np.save(folder / "a.npy", values)
    np.savez(folder / "a.npz", column=values)
    pq.write_table(pa.table(named), folder / "a.parquet")
    with h5py.File(folder / "a.h5", "w") as file:
        for name, column in named.items():
            file[name] = column
    savemat(folder / "a.mat", named)
    for suffix in ("npy", "npz", "parquet", "h5", "mat"):
        yield suffix, (folder / f"a.{suffix}").read_bytes()


def mutated(good: bytes, rng: np.random.Generator) -> bytes:
    """One to four damages: a byte changed, a stretch cut out, doubled, moved, a sign put in, the end cut."""
    data = bytearray(good)
    for _ in range(int(rng.integers(1, 5))):
        place = int(rng.integers(0, max(len(data), 1)))
        length = int(rng.integers(1, 60))
        kind = int(rng.integers(0, 7))
        if kind == 0 and data:
            data[place] = int(rng.integers(0, 256))
        elif kind == 1:
            del data[place : place + length]
        elif kind == 2:
            data[place:place] = data[place : place + length]
        elif kind == 3:
            piece = data[place : place + length]
            del data[place : place + length]
            other = int(rng.integers(0, len(data) + 1))
            data[other:other] = piece
        elif kind == 4 and rng.random() < 0.2:
            del data[place:]
        else:
            data[place:place] = WORDS[int(rng.integers(0, len(WORDS)))]
    return bytes(data)


def attempt(path: Path, kind: str) -> str:
    """`read`, or `refused` in words; anything else that happens is a fault of ours and is raised."""
    try:
        if kind == "dwells.csv":
            read_dwells(path)
            return "read"
        found = recordings_of(path, MAPS[kind])
        for recording in found[:3]:
            for samples in recording.samples():
                assert samples.values.shape == (len(samples), 6)
        return "read"
    except PlannerError as error:
        return "refused" if str(error) else "refused without a word"


def guess(path: Path) -> str:
    """`read` when a map is guessed that reads as a map, or `refused` in words."""
    from planner.recordings.column_map import map_of

    try:
        columns = map_of(guessed_map([path]).encode(), path)
        Recording(path, columns)
        return "read"
    except PlannerError as error:
        return "refused" if str(error) else "refused without a word"
