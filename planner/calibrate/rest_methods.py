"""Calibration without a precise table: free orientations, and the cube on a flat plate (B)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.calibrate.free_orientations import Form, FreeFit, ellipsoid, free_orientations
from planner.calibrate.held_out import rms
from planner.dwells.table_rows import level, rows_of
from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.calibration import Coefficient, Residual, SensorCalibration, Status, Tables
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import ErrorName
from planner.solvers.distributions import student_quantile
from planner.units import STANDARD_GRAVITY_MPS2

_FREE: Literal["free_orientations"] = "free_orientations"
_FITS: Mapping[str, Callable[..., FreeFit]] = {_FREE: free_orientations, "ellipsoid": ellipsoid}
_LOWER = (("yx", 1, 0), ("zx", 2, 0), ("zy", 2, 1))
FOLDS = 5
FACE = 0.85  # share of g along one axis that makes a rest a face of the cube
QUARTER = np.pi / 2.0
AGED = 0.01  # of scale factor: a calibrated gyro moves by .12 % in two months (K 2.5.3)
_SCALE = 0.2  # of a turn by which its reading may be off where its angle is said
_UNKNOWN_SCALE = 0.05  # of a gyro's scale factor where the spec does not say how far it is off
_HAND = 0.09  # rad: 5 deg by which a hand misses
_OFF = 0.35  # rad: 20 deg by which the reading of a short turn may miss its multiple of 90 deg


def accelerometers_by_free_orientations(
    table: DwellTable, form: Form = "triangular", *, by: Literal["free_orientations", "ellipsoid"] = _FREE
) -> SensorCalibration:
    """The accelerometers of a table of rests, from |f| = g alone.

    by: least squares of |f| − g, or of the ellipsoid's equation

    Raises InputError for fewer than two rests, and when the readings are no acceleration near 1 g.
    """
    if table.acc is None:
        raise InputError("free orientations need acc columns")
    a = table.acc
    size = np.linalg.norm(a, axis=1)
    if not (0.5 < np.median(size) / STANDARD_GRAVITY_MPS2 < 2.0):
        read = np.median(size) / STANDARD_GRAVITY_MPS2
        raise InputError(f"the accelerometers read {read:.3g} g at rest: wrong unit, or no rests")
    try:
        fit = _FITS[by](a, form=form)
    except ValueError as error:
        raise InputError(f"{by.replace('_', ' ')}: {error}") from error
    coefficients = tuple(_coefficients(fit))
    M = fit.K / np.diag(fit.K)[:, None]
    return SensorCalibration(
        sensor="accelerometer",
        method=by,
        coefficients=coefficients,
        covariance={"all": np.nan_to_num(fit.covariance)},
        condition={"all": fit.condition},
        tables=Tables(
            np.array([float(np.median(table.temperature_degc))]),
            fit.b[:, None],
            (np.diag(fit.K) - 1.0)[:, None],
            np.zeros(3),
            M,
        ),
        residuals=(_modulus(a, fit, form, by),),
        random=(),
        notes=tuple(_notes(fit, form, coefficients)),
    )


def _notes(fit: FreeFit, form: Form, coefficients: Sequence[Coefficient]) -> Iterator[str]:
    """What the rests do not determine, and what was taken instead."""
    names = [ErrorName(c.error).effect + "." + c.term for c in coefficients if c.status == "undetermined"]
    if names:
        yield f"accelerometer: {len(fit.residual)} rests cannot tell {', '.join(names)}"
    if form == "symmetric":
        yield "the body's axes are those that make the matrix symmetric"
    else:
        yield "the body's axes are those of the accelerometers: only y and z are found misaligned"
    if fit.square and not fit.undetermined[[0, 1, 2, 6, 7, 8]].any():
        yield (
            "accelerometer: misalignment needs rests on edges too; here the axes are taken as square to each "
            "other within 1 deg, and the intervals of scale factor and bias hold that"
        )
    if fit.freedom < 1:
        yield "accelerometer: as many unknowns as rests, so no interval: measure more orientations"


def _modulus(a: Array, fit: FreeFit, form: Form, by: str) -> Residual:
    """RMS of |f| − g before and after, the latter on rests that were left out of the fit."""
    before = np.linalg.norm(a, axis=1) - STANDARD_GRAVITY_MPS2
    own = rms(fit.residual)
    if len(a) < 9 + FOLDS or fit.undetermined.any():
        return Residual(
            "modulus", rms(before), own, own, False, len(a), len(a), "of the rests that were fitted"
        )
    left = np.zeros(len(a))
    for k in range(FOLDS):
        out = np.arange(len(a)) % FOLDS == k
        other = _FITS[by](a[~out], form=form)
        f = (a[out] - other.b) @ np.linalg.inv(other.K).T
        left[out] = np.linalg.norm(f, axis=1) - STANDARD_GRAVITY_MPS2
    how = f"|f| − g on rests left out, {FOLDS} folds"
    return Residual("modulus", rms(before), rms(left), own, True, len(a), len(a), how)


def _coefficients(fit: FreeFit) -> list[Coefficient]:
    K = fit.K
    value = np.concatenate([np.diag(K) - 1.0, [K[i, j] / K[i, i] for _, i, j in _LOWER], fit.b])
    to = np.eye(9)  # derivative of what is reported by the unknowns
    for row, (_, i, j) in enumerate(_LOWER, start=3):
        to[row, row], to[row, i] = 1.0 / K[i, i], -K[i, j] / K[i, i] ** 2
    error = np.sqrt(np.maximum(np.diag(to @ fit.covariance @ to.T), 0.0))
    names = [("scale_factor", x, "1") for x in "xyz"]
    names += [("misalignment", term, "deg") for term, _, _ in _LOWER]
    names += [("bias", x, "g") for x in "xyz"]
    return [
        coefficient(
            f"accelerometer.{effect}", term, unit, float(value[k]), float(error[k]), fit.freedom,
            undetermined=bool(fit.undetermined[k]),
        )
        for k, (effect, term, unit) in enumerate(names)
    ]  # fmt: skip


def coefficient(
    error: str, term: str, unit: str, value: float, standard: float, freedom: float, *, undetermined: bool
) -> Coefficient:
    """One of the channel that its term names first, with its interval by Student's t where it has one."""
    half = float(student_quantile(0.975, freedom) * standard) if freedom > 0 else np.inf
    half = half if np.isfinite(half) else np.inf
    status: Status = "undetermined" if undetermined else "determined" if half < np.inf else "weak"
    return Coefficient(
        error, term[0], term, None, unit, value, standard, freedom, value - half, value + half, status
    )


# ---------------------------------------------------------------- cube


def cube_references(
    table: DwellTable, turn: float | None = None, scale: float = 0.0
) -> tuple[DwellTable, list[str]]:
    """The table with the references that a cube on a flat plate gives; other rows are left out.

    A rest on a face: f = ± g along the axis that reads most. A turn: by `turn` (rad) where the reading is
    within a fifth of it, else by the nearest multiple of 90 deg, about the axis that turned, over the
    record's duration. scale: by how much of itself the gyros' scale factor may be off, 0: nobody says.

    Raises InputError when no row is either, and for turns so long that several multiples may be meant.
    """
    if table.acc is None:
        raise InputError("the cube needs acc columns")
    unit = table.acc / STANDARD_GRAVITY_MPS2
    axis = np.argmax(np.abs(unit), axis=1)
    rows = np.arange(len(table))
    force = np.zeros_like(unit)
    force[rows, axis] = np.sign(unit[rows, axis]) * STANDARD_GRAVITY_MPS2
    on_face = np.abs(unit[rows, axis]) > FACE
    rate, turned, odd = _turns(table, turn, scale or _UNKNOWN_SCALE)
    keep = (on_face & ~turned & ~odd) | turned
    if not keep.any():
        raise InputError("no row is a rest on a face of the cube, or a turn by a multiple of 90 deg")
    notes = [f"{int((~keep).sum())} rows are neither: left out"] if not keep.all() else []
    if odd.any():
        notes.append(
            f"{int(odd.sum())} of them turned, as the gyros read, by no multiple of 90 deg, with up to "
            f"{100 * (scale or _UNKNOWN_SCALE):g} % of scale factor; if they did, say by how much: --turn DEG"
        )
    if turned.any():
        notes.append(
            "turns are taken as whole multiples of 90 deg: a hand that is 1 deg off in 360 deg "
            "errs by 0.28 % of scale factor, which no interval shows"
        )
    return rows_of(replace(table, ref_acc=force, ref_rate=rate), keep), notes


def _turns(
    table: DwellTable, turn: float | None, scale: float
) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Reference rate (n, 3), which rows turned by a known angle (n,), and which by one that is not known."""
    rate = np.zeros((len(table), 3))
    if table.gyro is None:
        nothing = np.zeros(len(table), dtype=bool)
        return rate, nothing, nothing
    rate_read = table.gyro - level(table.gyro)  # a zero of 1 deg/s would turn by 16 deg in a slow turn
    angle = rate_read * table.duration[:, None]
    axis = np.argmax(np.abs(angle), axis=1)
    rows = np.arange(len(table))
    most = angle[rows, axis]
    moved = (np.abs(most) > QUARTER / 2.0) & (np.abs(rate_read[rows, axis]) > np.radians(2.0))
    known = np.round(most / QUARTER) * QUARTER
    said = np.zeros(len(table), dtype=bool)
    if turn is not None:
        said = moved & (np.abs(np.abs(most) - turn) < _SCALE * turn)
        known = np.where(said, np.sign(most) * turn, known)
    may_miss = scale * np.abs(known) + _HAND
    _refuse_several_meanings(
        np.degrees(np.abs(most[moved & ~said & (may_miss >= QUARTER / 2.0)])), scale, turn
    )
    near = np.abs(most - known) < np.maximum(may_miss, _OFF)
    sure = said | (moved & near & (known != 0))
    rate[rows[sure], axis[sure]] = known[sure] / table.duration[sure]
    return rate, sure, moved & ~sure


def _refuse_several_meanings(read_deg: Array, scale: float, turn: float | None) -> None:
    """Raises InputError for turns (n,), deg as read, whose angle a scale factor `scale` off leaves open.

    Four turns that gyros 6.4 % off read as 1532 deg would pass as 1530, at 0.14 % of scale factor.
    """
    if not len(read_deg):
        return
    read = float(read_deg[0])
    below = 90.0 * np.floor(read / 90.0)
    beyond = "" if turn is None else f", further than a fifth from --turn {np.degrees(turn):g},"
    raise InputError(
        f"{len(read_deg)} turns are too long to know from the gyros how far they went: the first reads "
        f"{read:.0f} deg{beyond} which scale factors up to {100 * scale:g} % off cannot tell to be {below:g} "
        f"or {below + 90.0:g} deg; say by how much the cube was turned, e.g. --turn 1440 for four turns, or, "
        "if the gyros are known better, unit.gyro.scale_factor.systematic in the spec"
    )


def modulus_check(a: Array, corrected: Array) -> str:
    """The check of A: spread and mean error of |g| over the orientations, before and after."""
    figures = [np.linalg.norm(x, axis=1) - STANDARD_GRAVITY_MPS2 for x in (a, corrected)]
    (s0, m0), (s1, m1) = ((float(np.std(x, ddof=1)), float(np.mean(x))) for x in figures)
    return f"|g| over {len(a)} orientations: σ {s0:.3g} → {s1:.3g} m/s², mean error {m0:.3g} → {m1:.3g} m/s²"
