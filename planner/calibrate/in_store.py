"""Recalibration in store: a few rests and turns renew an old calibration (K 2.7).

    u₁ = old correction of y,   u₁ = (1 + Δκ) u + Δb   (general estimator, constant over temperature)
    b' = b + (1 + κ) M Δb,   1 + κ'_i = (1 + κ_i)(1 + Δκ_i),   M'_ij = M_ij (1 + Δκ_j)/(1 + Δκ_i)

What the records do not determine keeps its old value and is named. Curves over temperature, asymmetry and the
other effects stay as they were: storage moves bias and scale factor (K 2.5.3).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from planner.calibrate.correction import corrected
from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.calibration import SensorCalibration, Tables
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import ErrorName
from planner.protocols import Sensor

EFFECTS = ("bias", "scale_factor")


def by_the_old(table: DwellTable, prior: Mapping[Sensor, Tables]) -> DwellTable:
    """The table with readings corrected by the old calibration. Raises InputError if it has none."""
    have = [
        s for s, r in (("gyro", table.gyro), ("accelerometer", table.acc)) if r is not None and s in prior
    ]
    if not have:
        raise InputError("--prior: the old calibration has no sensor that this table measures")
    lone = replace(
        table,
        gyro=table.gyro if "gyro" in have else None,
        acc=table.acc if "accelerometer" in have else None,
    )
    return corrected(lone, prior)


def renewed(change: SensorCalibration, old: Tables) -> SensorCalibration:
    """The calibration with whole tables: the old ones and the change on top of them."""
    bias, scale = np.zeros(3), np.zeros(3)
    for c in change.coefficients:
        target = {"bias": bias, "scale_factor": scale}[ErrorName(c.error).effect]
        if c.status != "undetermined":
            target["xyz".index(c.term)] = c.value
    note = "the coefficients are the changes against the old calibration; the tables are whole, both together"
    return replace(
        change, method="recalibration", tables=combined(old, bias, scale), notes=(note, *change.notes)
    )


def combined(old: Tables, bias: Array, scale: Array) -> Tables:
    """The tables of the old correction followed by u = (u₁ − bias)/(1 + scale); bias SI (3,), scale (3,)."""
    slope = 1.0 + scale
    return replace(
        old,
        bias=old.bias + (1.0 + old.scale) * (old.misalignment @ bias)[:, None],
        scale=(1.0 + old.scale) * slope[:, None] - 1.0,
        asymmetry=old.asymmetry * slope,
        misalignment=old.misalignment * slope[None, :] / slope[:, None],
    )
