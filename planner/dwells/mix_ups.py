"""Guesses which mix-up made a table impossible: rad/s for deg/s, m/s² for g, axes swapped, signs turned."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from planner.dwells.dwell_columns import AXES
from planner.nouns.array import Array
from planner.units import STANDARD_GRAVITY_MPS2 as G

LEAST_REFERENCE = {"gyro": 5.0, "acc": 0.5}  # deg/s, g: ten times the largest bias of a MEMS sensor
EARTH_RATE_RADPS = 7.292115e-5  # WGS-84
NEAR = 0.15  # a scale factor before calibration is right to a few per cent
REFERENCE = {"gyro": "ref_rate", "acc": "ref_acc"}
UNIT = {"gyro": "deg/s", "acc": "g"}
_NO_ANSWER = 1e-5  # times the reference, below every unit that a sensor is read in
_FACTORS = {
    "gyro": (
        (math.radians(1.0), "the gyros look like rad/s"),
        (math.degrees(1.0), "the reference looks like rad/s"),
        (60.0, "the gyros look like deg/min"),
        (3600.0, "the gyros look like deg/h"),
        (1000.0, "the gyros look like mdeg/s"),
    ),
    "acc": (
        (G, "the accelerometers look like m/s²"),
        (1 / G, "the reference looks like m/s²"),
        (1000.0, "the accelerometers look like milli-g"),
    ),
}


def mix_ups(triads: Mapping[str, Array]) -> Iterator[tuple[str, str]]:
    """(columns, sentence) of every mix-up in (n, 3) values in deg/s and g, by field of the dwell table."""
    for sensor, reference in REFERENCE.items():
        if sensor in triads and reference in triads:
            yield from _against_reference(sensor, triads[sensor], triads[reference])
    if "acc" in triads and "ref_acc" not in triads:
        yield from _by_gravity("acc", triads["acc"])
    if "ref_acc" in triads:
        yield from _by_gravity("ref_acc", triads["ref_acc"])
    if "ref_rate" in triads:
        norm = np.linalg.norm(triads["ref_rate"], axis=1)
        if np.mean(np.abs(norm / EARTH_RATE_RADPS - 1) < 0.02) > 0.3:
            yield "ref_rate", "the Earth's rate stands there as 7.29e-5, so it looks like rad/s; give deg/s"


def _by_gravity(field: str, values: Array) -> Iterator[tuple[str, str]]:
    """At rest the length is 1 g; where hardly any row has it and many 9.8 or 1000, the unit is wrong."""
    norm = np.linalg.norm(values, axis=1)
    if np.mean(np.abs(norm - 1) < 0.2) > 0.1:
        return
    for factor, unit in ((G, "m/s²"), (1000.0, "milli-g")):
        if np.mean(np.abs(norm / factor - 1) < 0.1) > 0.3:
            yield field, f"most rows have the length {np.median(norm):.4g}, so they look like {unit}; give g"


def _against_reference(sensor: str, measured: Array, reference: Array) -> Iterator[tuple[str, str]]:
    slopes = response(measured, reference, LEAST_REFERENCE[sensor])
    known = np.flatnonzero(np.isfinite(slopes).all(axis=0))
    if not len(known):
        yield from _small_reference(sensor, measured, reference)
        return
    size = float(np.median(np.abs(slopes[:, known]).max(axis=0)))
    for factor, said in _FACTORS[sensor]:
        if abs(size / factor - 1) < NEAR:
            yield sensor, f"readings are {size:.4g} times {REFERENCE[sensor]}: {said}; give {UNIT[sensor]}"
            return
    if size < _NO_ANSWER:
        yield sensor, f"no reading answers to {REFERENCE[sensor]}: was the sensor connected?"
        return
    if not 0.5 < size < 2.0:
        yield sensor, f"readings are {size:.4g} times {REFERENCE[sensor]}; give both in {UNIT[sensor]}"
        return
    for axis in known.tolist():
        yield from _axis(sensor, axis, slopes[:, axis])


def _small_reference(sensor: str, measured: Array, reference: Array) -> Iterator[tuple[str, str]]:
    """A reference in another unit may be too small to be told by: then the readings are the larger ones."""
    slopes = response(reference, measured, LEAST_REFERENCE[sensor])
    known = np.flatnonzero(np.isfinite(slopes).all(axis=0))
    if not len(known):
        return
    size = float(np.median(np.abs(slopes[:, known]).max(axis=0)))
    for factor, said in _FACTORS[sensor]:
        if said.startswith("the reference") and abs(size * factor - 1) < NEAR:
            yield sensor, f"readings are {factor:.4g} times {REFERENCE[sensor]}: {said}; give {UNIT[sensor]}"


def _axis(sensor: str, axis: int, answers: Array) -> Iterator[tuple[str, str]]:
    strongest = int(np.argmax(np.abs(answers)))
    name, reference = f"{sensor}_{AXES[axis]}", f"{REFERENCE[sensor]}_{AXES[axis]}"
    # a dead channel answers to nothing, and then any other one's misalignment is the strongest
    if strongest != axis and abs(answers[axis]) < 0.3 * abs(answers[strongest]) > 0.15:
        yield f"{sensor}_{AXES[strongest]}", f"follows {reference}, not {name}: are axes swapped?"
    elif strongest == axis and answers[axis] < 0:
        yield name, f"reads {answers[axis]:.3g} times {reference}: is its sign turned?"


def response(measured: Array, reference: Array, least: float) -> Array:
    """(3, 3) how channel i answers to the reference along axis j: the median of m_i / r_j.

    Over rows in which axis j has over 0.9 of the reference's length and at least `least`; NaN without such
    rows. The bias adds b/r, a few per cent. The median, for a third of the power-ons may be labelled wrong:
    that is no other unit of measurement, and by sums a quarter upside down reads half.
    """
    length = np.linalg.norm(reference, axis=1)
    slopes = np.full((3, 3), np.nan)
    for axis in range(3):
        along = reference[:, axis]
        rows = (np.abs(along) > 0.9 * length) & (np.abs(along) >= least)
        if rows.any():
            slopes[:, axis] = np.median(measured[rows] / along[rows, None], axis=0)
    return slopes
