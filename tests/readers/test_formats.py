"""The same samples in every format give the same recording; what is no recording is refused in words."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from planner.errors import InputError
from planner.readers._delimited import layout_of, text_blocks
from planner.recordings.column_map import ColumnMap
from planner.recordings.recording import Recording
from planner.recordings.samples import Account, joined

RNG = np.random.default_rng(1)
N = 500
TIME = np.arange(N) / 100
GYRO = RNG.normal(size=(N, 3))
ACC = RNG.normal(size=(N, 3)) + np.array([0, 0, 9.8])
NAMES = ("t", "g1", "g2", "g3", "a1", "a2", "a3")
TABLE = np.column_stack([TIME, GYRO, ACC])


def column_map(time: str | int, gyro: tuple[str | int, ...], acc: tuple[str | int, ...]) -> ColumnMap:
    return ColumnMap.model_validate(
        {
            "time": {"column": time, "unit": "s"},
            "gyro": dict(zip("xyz", gyro, strict=True)) | {"unit": "rad/s"},
            "acc": dict(zip("xyz", acc, strict=True)) | {"unit": "m/s^2"},
        }
    )


NAMED = column_map("t", ("g1", "g2", "g3"), ("a1", "a2", "a3"))
NUMBERED = column_map(1, (2, 3, 4), (5, 6, 7))


def text(path: Path, delimiter: str, header: bool = True, comment: str = "", point: str = ".") -> Path:
    lines = [comment] if comment else []
    lines += [delimiter.join(NAMES)] if header else []
    lines += [delimiter.join(repr(x).replace(".", point) for x in row) for row in TABLE.tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path


def hdf5(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        file["t"] = TIME
        file["imu/g"], file["imu/a"] = GYRO, ACC
    return path


def mat_73(path: Path) -> Path:
    """As MATLAB lays out v7.3: 512 bytes of text, then HDF5, matrices with turned axes and MATLAB_class."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("t", TIME[:, None]), ("g", GYRO), ("a", ACC)):
            file.create_dataset(name, data=values.T).attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + b"\0" * 8 + b"\0\2IM")
    return path


def parquet(path: Path) -> Path:
    pq.write_table(pa.table(dict(zip(NAMES, TABLE.T, strict=True))), path, row_group_size=77)
    return path


def mat_5(path: Path, struct: bool = False) -> Path:
    inner = {"g": GYRO, "a": ACC}
    savemat(path, {"t": TIME, "imu": inner} if struct else {"t": TIME, **inner})
    return path


def npy(path: Path, structured: bool = False) -> Path:
    if structured:
        np.save(path, np.rec.fromarrays(TABLE.T, names=list(NAMES)))
    else:
        np.save(path, TABLE)
    return path


IN_GROUP = column_map("t", ("imu/g_1", "imu/g_2", "imu/g_3"), ("imu/a_1", "imu/a_2", "imu/a_3"))
IN_MATRIX = column_map("t", ("g_1", "g_2", "g_3"), ("a_1", "a_2", "a_3"))
IN_STRUCT = column_map("t", ("imu.g_1", "imu.g_2", "imu.g_3"), ("imu.a_1", "imu.a_2", "imu.a_3"))
FORMATS = {
    "csv": (lambda p: text(p / "a.csv", ","), NAMED),
    "tsv": (lambda p: text(p / "a.tsv", "\t"), NAMED),
    "spaces": (lambda p: text(p / "a.txt", "   ", header=False), NUMBERED),
    "semicolons with decimal commas": (lambda p: text(p / "a.csv", ";", point=","), NAMED),
    "comments on top": (lambda p: text(p / "a.dat", ",", comment="# unit 7\n% at noon"), NAMED),
    "no suffix": (lambda p: text(p / "recording", ","), NAMED),
    "parquet": (lambda p: parquet(p / "a.parquet"), NAMED),
    "hdf5": (lambda p: hdf5(p / "a.h5"), IN_GROUP),
    "hdf5 under another name": (lambda p: hdf5(p / "a.bin"), IN_GROUP),
    "mat v5": (lambda p: mat_5(p / "a.mat"), IN_MATRIX),
    "mat v5 struct": (lambda p: mat_5(p / "a.mat", struct=True), IN_STRUCT),
    "mat v7.3": (lambda p: mat_73(p / "a.mat"), IN_MATRIX),
    "npy matrix": (lambda p: npy(p / "a.npy"), NUMBERED),
    "npy fields": (lambda p: npy(p / "a.npy", structured=True), NAMED),
}


@pytest.mark.parametrize("form", FORMATS)
def test_every_format_gives_the_same_samples(tmp_path, form):
    write, columns = FORMATS[form]
    account = Account()
    samples = joined(list(Recording(write(tmp_path), columns).samples(account)))
    np.testing.assert_array_equal(samples.time, TIME)
    np.testing.assert_array_equal(samples.values, np.hstack([GYRO, ACC]))
    assert samples.good.all()
    assert dict(account.counts) == {"read": N}


@pytest.mark.parametrize("form", ["parquet", "hdf5", "mat v5", "mat v7.3", "npy matrix"])
@pytest.mark.parametrize("share", [0.02, 0.5, 0.98])
def test_a_cut_binary_file_is_refused_or_whole(tmp_path, form, share):
    write, columns = FORMATS[form]
    path = write(tmp_path)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(InputError) as said:
        list(Recording(path, columns).samples())
    assert path.name in str(said.value)


def test_a_pickle_is_not_opened(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match="not a whole"):
        Recording(tmp_path / "a.npy", NUMBERED)


# ---------------------------------------------------------------- text


@settings(deadline=None, max_examples=40)
@given(
    rows=st.integers(1, 60),
    size=st.integers(10, 900),
    bad=st.sets(st.integers(0, 59), max_size=5),
    seed=st.integers(0, 9),
)
def test_the_size_of_the_chunks_changes_nothing(tmp_path_factory, rows, size, bad, seed):
    values = np.random.default_rng(seed).normal(size=(rows, 3))
    lines = [",".join(map(repr, row)) for row in values.tolist()]
    for number in bad:
        if number < rows:
            lines[number] = ("1,2", "1,2,x", "1,2,3,4", "1,,2,")[number % 4]
    path = tmp_path_factory.mktemp("t") / "a.csv"
    path.write_text("a,b,c\n" + "\n".join(lines) + "\n")
    layout = layout_of(path)
    blocks = list(text_blocks(path, layout, ["a", "c"], chunk_bytes=size))
    kept = [k for k in range(rows) if k not in bad]
    found = np.concatenate([block.columns["c"] for block in blocks])
    np.testing.assert_array_equal(found, values[kept, 2])
    assert [n for block in blocks for n in block.lines.tolist()] == [k + 2 for k in kept]
    assert sorted(f.line for block in blocks for f in block.bad) == [k + 2 for k in sorted(bad) if k < rows]


def test_windows_line_ends_and_a_byte_order_mark(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbf" + text(path, ",").read_bytes().replace(b"\n", b"\r\n"))
    samples = joined(list(Recording(path, NAMED).samples()))
    np.testing.assert_array_equal(samples.values, np.hstack([GYRO, ACC]))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty"),
        (b"  \n\n", "is empty"),
        (b"# only\n# comments\n", "no rows"),
        (b"t,g1,g2,g3,a1,a2,a3", "header and no rows"),
        (b"t,g1,g2,g3,a1,a2,a3\n", "no samples"),
        (b"t,g1,g2,g3,a1,a2,a3\n\n\n", "no samples"),
        ("t,g1\n1,2\n".encode("utf-16"), "UTF-16"),
        (b"t,g1,g1,g3,a1,a2,a3\n1,2,3,4,5,6,7\n", "no column 'g2'"),
        (b"t,g1,g2,g2,g3,a1,a2,a3\n1,2,3,4,5,6,7,8\n", "more than once"),
        (b"\x00\x01\x02\x03" * 50, "no format"),
    ],
)
def test_what_is_no_recording_is_refused_in_words(tmp_path, content, said):
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    with pytest.raises(InputError, match=said):
        list(Recording(path, NAMED).samples())
