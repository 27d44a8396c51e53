"""A calibration as a binary image for the controller: little-endian float32 arrays under a CRC-32.

bytes 0-3    "IMUC"
4-5  uint16  version of this layout: 1, or 2 with curves and products;   6-7  uint16  sensors
then for every sensor
  uint16 kind (0 gyro, 1 accelerometer), uint16 number of nodes N, float32 reach K, float32 full scale,
  temperature[N], bias[N][3], plus[N][3], minus[N][3], drift[3], warm_up[3], time_constant[3],
  acceleration[3][3], nonlinearity[3], alignment[3][3]          (float32; meaning as in the C header)
and, if the version is 2, tables over load, input, rate and time, and coefficients of products:
  uint16 number of them; for each uint16 kind (1 load, 2 input, 3 scale factor over load, 4 temperature and
  its rate, 5 drift, 6 settling, 7 polynomial over the input, 8 drift over temperature and time, 9 slope over
  time, 10 products of forces, 11 of rates, 12 force by temperature, 13 misalignment by temperature), uint16
  number of its floats, and these: the C header's arrays of that kind, one after another
last 4 bytes uint32  CRC-32 (IEEE 802.3, as zlib) of everything before
"""

from __future__ import annotations

import struct
import zlib

from planner.export.firmware import FirmwareTables, firmware_tables
from planner.nouns.calibration import Calibration

MAGIC = b"IMUC"
PLAIN, WITH_CURVES = 1, 2  # versions of the layout
KINDS = ("gyro", "accelerometer")


def binary_image(calibration: Calibration) -> bytes:
    """The image. Same calibration, same bytes."""
    sensors = firmware_tables(calibration)
    version = WITH_CURVES if any(tables.curves for tables in sensors) else PLAIN
    packed = [_packed(t) + (_curves(t) if version == WITH_CURVES else b"") for t in sensors]
    body = b"".join([MAGIC, struct.pack("<HH", version, len(sensors)), *packed])
    return body + struct.pack("<I", zlib.crc32(body))


def _packed(tables: FirmwareTables) -> bytes:
    head = struct.pack(
        "<HHff", KINDS.index(tables.sensor), len(tables.temperature), tables.reach, tables.full_scale
    )
    return head + b"".join(values.astype("<f4").tobytes() for values in tables.arrays().values())


def _curves(tables: FirmwareTables) -> bytes:
    found = struct.pack("<H", len(tables.curves))
    for curve in tables.curves:
        floats = b"".join(values.astype("<f4").tobytes() for values in curve.arrays.values())
        found += struct.pack("<HH", curve.number, len(floats) // 4) + floats
    return found
