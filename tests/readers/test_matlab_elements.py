"""A damaged .mat file is refused in words before scipy, which would end the process, sees it."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import InputError
from planner.readers.matlab import READER

INT8, INT32, UINT32, DOUBLE, MATRIX, PACKED = 1, 5, 6, 9, 14, 15
CELL, STRUCT, CHAR, NUMBERS = 1, 2, 4, 6  # classes of arrays
NUMBER = struct.pack("<d", 1.5)


def element(kind: int, data: bytes, order: str = "<") -> bytes:
    return struct.pack(f"{order}II", kind, len(data)) + data + bytes(-len(data) % 8)


def array(
    kind: int, *parts: bytes, sides: tuple[int, ...] = (1, 1), name: bytes = b"x", order: str = "<"
) -> bytes:
    flags = element(UINT32, struct.pack(f"{order}II", kind, 0), order)
    shape = element(INT32, struct.pack(f"{order}{len(sides)}i", *sides), order)
    return element(MATRIX, b"".join([flags, shape, element(INT8, name, order), *parts]), order)


def write(path: Path, variable: bytes, packed: bool = False, order: str = "<") -> None:
    sign = b"\x00\x01IM" if order == "<" else b"\x01\x00MI"
    if packed:
        data = zlib.compress(variable)
        variable = struct.pack(f"{order}II", PACKED, len(data)) + data
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + sign + variable)


GOOD = array(NUMBERS, element(DOUBLE, 3 * NUMBER), sides=(3, 1))
LENGTH, FIELD = element(INT32, struct.pack("<i", 8)), element(INT8, b"field\0\0\0")
DEEP = GOOD
for _ in range(200):
    DEEP = array(CELL, DEEP)
DAMAGED = {
    "numbers of type 0": (array(NUMBERS, element(0, NUMBER)), "an element of type 0 stands where numbers"),
    "numbers of type 4711": (array(NUMBERS, element(4711, NUMBER)), "an element of type 4711 stands"),
    "an array for numbers": (array(NUMBERS, GOOD), "an element of type 14 stands where numbers should"),
    "letters of type 255": (array(CHAR, element(255, b"a")), "type 255 stands where letters should"),
    "letters without sides": (array(CHAR, element(INT8, b"a"), sides=()), "an array with the sides ()"),
    "a side below zero": (array(NUMBERS, element(DOUBLE, NUMBER), sides=(1, -1)), "the sides (1, -1)"),
    "blanks without end": (array(CHAR, element(INT8, b""), sides=(1 << 15, 1 << 15)), "without a byte"),
    "a struct that has no fields, without end": (
        array(STRUCT, LENGTH, element(INT8, b""), sides=(1 << 15, 1 << 15)),
        "an array of 1073741824 members without a byte for them",
    ),
    "names of no length": (
        array(STRUCT, element(INT32, bytes(4)), FIELD, GOOD),
        "names of fields have the lengths (0,)",
    ),
    "a field of type 4711": (
        array(STRUCT, LENGTH, FIELD, array(NUMBERS, element(4711, NUMBER))),
        "an element of type 4711 stands where numbers should",
    ),
    "more cells than there are": (array(CELL, GOOD, sides=(1 << 15, 1 << 15)), "ends within an element"),
    "a number in a cell's place": (array(CELL, element(DOUBLE, NUMBER)), "stands where an array should"),
    "an unknown class": (array(200, element(DOUBLE, NUMBER)), "an array of class 200, which there is not"),
    "an end within numbers": (array(NUMBERS, element(DOUBLE, NUMBER))[:-4], "it ends within an element"),
    "cells in cells": (DEEP, "more than 100 deep"),
    "no variable": (element(DOUBLE, NUMBER), "an element of type 9 and 8 bytes is no variable"),
}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("fault", DAMAGED)
def test_damage_is_refused_before_scipy_reads_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: str, packed: bool
) -> None:
    """scipy 1.17 dies of signal 11 by such types, by letters without sides, and by 20 000 cells in cells."""
    variable, said = DAMAGED[fault]
    path = tmp_path / "a.mat"
    write(path, variable, packed)
    monkeypatch.setattr("scipy.io.loadmat", lambda *_, **__: pytest.fail("scipy saw it"))
    with pytest.raises(InputError) as caught:
        READER.names(path)
    assert str(caught.value).startswith(f"{path} is not a whole MATLAB file: ")
    assert said in str(caught.value) or (packed and fault == "no variable")


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("packed", [False, True])
def test_files_of_both_orders_are_read(tmp_path: Path, order: str, packed: bool) -> None:
    numbers = element(DOUBLE, struct.pack(f"{order}3d", 1.0, 2.0, 3.0), order)
    path = tmp_path / "a.mat"
    write(path, array(NUMBERS, numbers, sides=(3, 1), name=b"gx", order=order), packed, order)
    (block,) = READER.blocks(path, ("gx",))
    assert block.columns["gx"].tolist() == [1.0, 2.0, 3.0]


def test_padding_may_lack_at_the_end(tmp_path: Path) -> None:
    """Others leave it out, and scipy reads it."""
    whole = array(NUMBERS, element(2, bytes([4, 5, 6])), sides=(3, 1), name=b"gx")
    path = tmp_path / "a.mat"
    write(path, whole[:-5])
    assert READER.names(path) == ("gx",)


@pytest.mark.parametrize("packed", [False, True])
def test_every_class_that_scipy_writes_is_read(tmp_path: Path, packed: bool) -> None:
    from scipy.io import savemat
    from scipy.sparse import csc_array

    rng = np.random.default_rng(3)
    cells = np.empty(2, dtype=object)
    cells[:] = ["words", {"deeper": np.arange(3.0)}]
    variables: dict[str, Any] = {
        "t": np.arange(9.0),
        "imu": {"gyro": rng.normal(size=(9, 3)), "name": "north", "no": {}},
        "counts": np.arange(9, dtype=np.int16),
        "flags": np.arange(9) > 3,
        "complex": np.arange(9) * 1j,
        "sparse": csc_array(np.eye(3)),
        "letters": np.array(["ab", "cd"]),
        "cells": cells,
        "nothing": np.zeros((0, 0)),
    }
    path = tmp_path / "a.mat"
    savemat(path, variables, do_compression=packed)
    names = READER.names(path)
    assert {"t", "imu.gyro_1", "imu.gyro_2", "imu.gyro_3", "counts", "flags", "complex"} <= set(names)
    (block,) = READER.blocks(path, ("imu.gyro_2",))
    assert block.columns["imu.gyro_2"].tolist() == variables["imu"]["gyro"][:, 1].tolist()
