"""A calibration as a binary image for the controller: little-endian float32 arrays under a CRC-32.

bytes 0-3    "IMUC"
4-5  uint16  version of this layout: 1;   6-7  uint16  number of sensors
then for every sensor
  uint16 kind (0 gyro, 1 accelerometer), uint16 number of nodes N, float32 reach K, float32 full scale,
  temperature[N], bias[N][3], plus[N][3], minus[N][3], drift[3], warm_up[3], time_constant[3],
  acceleration[3][3], nonlinearity[3], alignment[3][3]          (float32; meaning as in the C header)
last 4 bytes uint32  CRC-32 (IEEE 802.3, as zlib) of everything before
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

from planner.errors import InputError
from planner.export.firmware import FirmwareTables, Float32, firmware_tables
from planner.nouns.calibration import Calibration

MAGIC = b"IMUC"
VERSION = 1
KINDS = ("gyro", "accelerometer")


def binary_image(calibration: Calibration) -> bytes:
    """The image. Same calibration, same bytes."""
    sensors = firmware_tables(calibration)
    body = b"".join([MAGIC, struct.pack("<HH", VERSION, len(sensors)), *map(_packed, sensors)])
    return body + struct.pack("<I", zlib.crc32(body))


def _packed(tables: FirmwareTables) -> bytes:
    head = struct.pack(
        "<HHff", KINDS.index(tables.sensor), len(tables.temperature), tables.reach, tables.full_scale
    )
    return head + b"".join(values.astype("<f4").tobytes() for values in tables.arrays().values())


def read_image(data: bytes) -> dict[str, dict[str, Float32]]:
    """Sensor -> array name -> values. Raises InputError for a damaged or foreign image."""
    if len(data) < 12 or data[:4] != MAGIC:
        raise InputError("this is no calibration image: it does not begin with IMUC")
    if struct.unpack("<I", data[-4:])[0] != zlib.crc32(data[:-4]):
        raise InputError("the calibration image is damaged: its CRC-32 does not fit")
    version, count = struct.unpack_from("<HH", data, 4)
    if version != VERSION:
        raise InputError(f"calibration image of version {version}; this planner reads version {VERSION}")
    found, at = {}, 8
    for _ in range(count):
        kind, nodes, _, _ = struct.unpack_from("<HHff", data, at)
        at += 12
        arrays: dict[str, Float32] = {}
        for name, shape in _shapes(nodes).items():
            size = int(np.prod(shape))
            arrays[name] = np.frombuffer(data, "<f4", size, at).reshape(shape)
            at += 4 * size
        found[KINDS[kind]] = arrays
    return found


def _shapes(nodes: int) -> dict[str, tuple[int, ...]]:
    return {
        "temperature": (nodes,),
        "bias": (nodes, 3),
        "plus": (nodes, 3),
        "minus": (nodes, 3),
        "drift": (3,),
        "warm_up": (3,),
        "time_constant": (3,),
        "acceleration": (3, 3),
        "nonlinearity": (3,),
        "alignment": (3, 3),
    }
