"""A calibration as the arrays that firmware holds: float32, deg/s and g, temperature nodes in degC."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.calibration import Calibration, ExtraTerm, SensorCalibration
from planner.effects.scale_factor_nonlinearity import REFERENCE_INPUT
from planner.records import Array
from planner.units import from_si, unit_factor

Float32 = NDArray[np.float32]
AXES = ("x", "y", "z")
HELD = {"temperature_rate", "warm_up", "g_sensitivity", "scale_factor_nonlinearity"}
OUTPUT_UNIT = {"gyro": "deg/s", "accelerometer": "g"}


@dataclass(frozen=True)
class FirmwareTables:
    """One sensor's arrays. N nodes; output unit is deg/s or g.

    temperature: (N,) degC; bias: (N, 3); plus, minus: (N, 3) slopes for + and − input
    drift: (3,) per K/min of temperature rate; warm_up: (3,) at power-on; time_constant: (3,) s
    acceleration: (3, 3) bias per g of body axes (zero for accelerometers)
    nonlinearity: (3,) cubic, at the input `full_scale`; alignment: (3, 3) inverse of the misalignment matrix
    left_out: effects of the calibration that these arrays have no place for
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
    left_out: tuple[str, ...]

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
    return tuple(_of_sensor(sensor) for sensor in calibration.sensors)


def _of_sensor(found: SensorCalibration) -> FirmwareTables:
    t, unit = found.tables, OUTPUT_UNIT[found.sensor]
    half = t.asymmetry[:, None] / 2.0
    sorted_out = _Extras(t.extra)
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
        left_out=sorted_out.others(),
    )


def _shown(values: Array, unit: str) -> Float32:
    """SI values in a unit."""
    return np.asarray(values / unit_factor(unit)[0], dtype=np.float32)


@dataclass(frozen=True)
class _Extras:
    """The terms outside the temperature tables, sorted by what they become."""

    terms: Sequence[ExtraTerm]

    def of(self, effect: str) -> list[ExtraTerm]:
        return [e for e in self.terms if e.effect == effect]

    def channels(self, effect: str) -> Array:
        found = np.zeros(3)
        for e in self.of(effect):
            found[AXES.index(e.term)] = e.value
        return found

    def matrix(self, effect: str) -> Array:
        found = np.zeros((3, 3))
        for e in self.of(effect):
            found[AXES.index(e.term[0]), AXES.index(e.term[1])] = e.value
        return found

    def warm_up(self) -> tuple[Array, Array]:
        """Amplitudes and time constants; 1 s where there is none."""
        tau = np.ones(3)
        for e in self.of("warm_up"):
            tau[AXES.index(e.term)] = e.nonlinear["time_constant"]
        return self.channels("warm_up"), tau

    def others(self) -> tuple[str, ...]:
        return tuple(sorted({e.effect for e in self.terms} - HELD))
