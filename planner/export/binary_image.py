"""A calibration as a binary image for the controller: little-endian float32 arrays under a CRC-32.

bytes 0-3    "IMUC"
4-5  uint16  version of this layout: 2;   6-7  uint16  number of sensors
then for every sensor
  uint16 kind (0 gyro, 1 accelerometer), uint16 number of nodes N, float32 reach K, float32 full scale,
  uint16 R, Q, P (temperatures, rates and times of the table over the rate of temperature; 0 without one),
  uint16 0,
  temperature[N], bias[N][3], plus[N][3], minus[N][3], drift[3], warm_up[3], time_constant[3],
  acceleration[3][3], nonlinearity[3], alignment[3][3], ramp_temperature[R], ramp_rate[Q], ramp_time[P],
  ramp_bias[P][R][Q][3]                                          (float32; meaning as in the C header)
last 4 bytes uint32  CRC-32 (IEEE 802.3, as zlib) of everything before
"""

from __future__ import annotations

import struct
import zlib

from planner.export.firmware import FirmwareTables, firmware_tables
from planner.nouns.calibration import Calibration

MAGIC = b"IMUC"
VERSION = 2  # 1 had no table over the rate of temperature
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
    ramp = tables.ramp
    nodes = (0, 0, 0) if ramp is None else (len(ramp.temperature), len(ramp.rate), len(ramp.time))
    head += struct.pack("<HHHH", *nodes, 0)
    return head + b"".join(values.astype("<f4").tobytes() for values in tables.arrays().values())
