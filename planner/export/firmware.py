"""A calibration as the arrays that firmware holds: float32, deg/s and g, temperature nodes in degC."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.effects import sensed
from planner.effects._dependence import IN_USE_DEGC, random_conditions
from planner.effects._shaped import plain_name
from planner.effects.scale_factor_nonlinearity import REFERENCE_INPUT
from planner.export.extra_terms import ExtraTerms
from planner.export.firmware_curves import FirmwareCurve, firmware_curves
from planner.export.firmware_products import firmware_products
from planner.nouns.array import Array
from planner.nouns.calibration import Calibration, SensorCalibration, Tables
from planner.nouns.conditions import Conditions
from planner.units import STANDARD_GRAVITY_MPS2, from_si, unit_factor

Float32 = NDArray[np.float32]
# what the layout has arrays and equations for; whatever else a calibration holds is left out, and said
HELD = {"temperature_rate", "warm_up", "g_sensitivity", "scale_factor_nonlinearity"}
ROWS = 2000
LOAD_MPS2 = 50.0 * STANDARD_GRAVITY_MPS2
RATE_RADPS = float(np.radians(500.0))
OUTPUT_UNIT = {"gyro": "deg/s", "accelerometer": "g"}


@dataclass(frozen=True)
class LeftOut:
    """An effect of the calibration that the arrays have no place for.

    size: the most that it adds to a channel, in the sensor's output unit, or as a share of the input
    """

    effect: str
    size: float
    unit: str

    def __str__(self) -> str:
        return f"{self.effect}, up to {self.size:.2g} {self.unit}"


@dataclass(frozen=True)
class FirmwareTables:
    """One sensor's arrays. N nodes; output unit is deg/s or g.

    temperature: (N,) degC; bias: (N, 3); plus, minus: (N, 3) slopes for + and − input
    drift: (3,) per K/min of temperature rate; warm_up: (3,) at power-on; time_constant: (3,) s
    acceleration: (3, 3) bias per g of body axes (zero for accelerometers)
    nonlinearity: (3,) cubic, at the input `full_scale`; alignment: (3, 3) inverse of the misalignment matrix
    left_out: what these arrays have no place for; curves: tables and products of conditions, if any
    fallback: degC of the tables that correct while the temperature sensor is dead
    """

    sensor: str
    reach: np.float32
    full_scale: np.float32
    temperature: Float32
    bias: Float32
    plus: Float32
    minus: Float32
    drift: Float32
    warm_up: Float32
    time_constant: Float32
    acceleration: Float32
    nonlinearity: Float32
    alignment: Float32
    left_out: tuple[LeftOut, ...]
    curves: tuple[FirmwareCurve, ...] = ()
    fallback: np.float32 = field(default_factory=lambda: np.float32(20.0))

    def arrays(self) -> dict[str, Float32]:
        """The arrays by name, in the order of the binary image."""
        names = (
            "temperature",
            "bias",
            "plus",
            "minus",
            "drift",
            "warm_up",
            "time_constant",
            "acceleration",
            "nonlinearity",
            "alignment",
        )
        return {name: getattr(self, name) for name in names}


def firmware_tables(calibration: Calibration) -> tuple[FirmwareTables, ...]:
    """The arrays of every calibrated sensor."""
    return tuple(_of_sensor(_plain(sensor)) for sensor in calibration.sensors)


def _plain(found: SensorCalibration) -> SensorCalibration:
    """The same with an effect at one unit's parameters under its own name: its terms have the parameters."""
    extra = []
    for e in found.tables.extra:
        usual = catalog.effects()[e.effect].nonlinear
        extra.append(replace(e, effect=plain_name(e.effect), nonlinear={**usual, **e.nonlinear}))
    return replace(found, tables=replace(found.tables, extra=tuple(extra)))


def _of_sensor(found: SensorCalibration) -> FirmwareTables:
    t, unit = found.tables, OUTPUT_UNIT[found.sensor]
    half = t.asymmetry[:, None] / 2.0
    sorted_out = ExtraTerms(t.extra)
    warm, tau = sorted_out.warm_up()
    return FirmwareTables(
        sensor=found.sensor,
        reach=np.float32(t.reach),
        full_scale=np.float32(from_si(REFERENCE_INPUT[found.sensor], unit)),
        temperature=t.temperature_degc.astype(np.float32),
        bias=_shown(t.bias, unit).T,
        plus=(1.0 + t.scale + half).T.astype(np.float32),
        minus=(1.0 + t.scale - half).T.astype(np.float32),
        drift=_shown(sorted_out.channels("temperature_rate"), f"{unit}/(K/min)"),
        warm_up=_shown(warm, unit),
        time_constant=tau.astype(np.float32),
        acceleration=_shown(sorted_out.matrix("g_sensitivity"), f"{unit}/g"),
        nonlinearity=sorted_out.channels("scale_factor_nonlinearity").astype(np.float32),
        alignment=np.linalg.inv(t.misalignment).astype(np.float32),
        left_out=_left_out(found),
        curves=_tables_and_products(found),
        fallback=np.float32(t.fallback_degc),
    )


def _tables_and_products(found: SensorCalibration) -> tuple[FirmwareCurve, ...]:
    given = found.sensor, found.tables.extra, OUTPUT_UNIT[found.sensor]
    return (*firmware_curves(*given), *firmware_products(*given))


def _shown(values: Array, unit: str) -> Float32:
    """SI values in a unit."""
    return np.asarray(values / unit_factor(unit)[0], dtype=np.float32)


# ---------------------------------------------------------------- what has no place


def _left_out(found: SensorCalibration) -> tuple[LeftOut, ...]:
    held = HELD.union(*(curve.effects for curve in _tables_and_products(found)))
    names = sorted({e.effect for e in found.tables.extra} - held)
    return tuple(_size(found, name) for name in names)


def _size(found: SensorCalibration, name: str) -> LeftOut:
    """The largest over the table's temperatures, 2 h of power-on, a year, up to 500 deg/s and 50 g."""
    effect, unit = catalog.effects()[name], OUTPUT_UNIT[found.sensor]
    conditions = _in_use(found.tables)
    terms = [t.name for t in effect.terms(found.sensor)]
    added = np.zeros((ROWS, 3))
    for e in found.tables.extra:
        if e.effect == name:
            regressors = effect.regressors(found.sensor, conditions, e.nonlinear)
            added += e.value * regressors[:, :, terms.index(e.term)]
    if effect.group == "bias":
        return LeftOut(name, float(from_si(float(np.abs(added).max()), unit)), unit)
    u = np.linalg.norm(sensed(found.sensor, conditions), axis=1, keepdims=True)
    share = np.divide(np.abs(added), u, out=np.zeros_like(added), where=u > 0.0)
    return LeftOut(name, 100.0 * float(share.max()), "% of the input")


def _in_use(tables: Tables) -> Conditions:
    nodes = tables.temperature_degc
    degc = (float(nodes[0]), float(nodes[-1])) if len(nodes) > 1 else IN_USE_DEGC
    rows = random_conditions(np.random.default_rng(0), ROWS, degc)  # the same every time
    rate = rows.rate * (RATE_RADPS / max(float(np.linalg.norm(rows.rate, axis=1).max()), 1e-300))
    force = np.linalg.norm(rows.specific_force, axis=1, keepdims=True)
    return replace(rows, rate=rate, specific_force=rows.specific_force * np.minimum(1.0, LOAD_MPS2 / force))


def left_out_notes(calibration: Calibration) -> list[str]:
    """A sentence for each sensor of which the C header and the binary image do not hold all."""
    return [
        f"calibration.h and calibration.bin have no place for {'; '.join(map(str, t.left_out))} of the "
        f"{t.sensor}s: firmware leaves that uncorrected; calibration.json and `planner apply` have it"
        for t in firmware_tables(calibration)
        if t.left_out
    ]
