"""A dwell table of rests and turns without references → accelerometers by |f| = g, gyros by Poisson (B)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.calibrate.correction import true_input
from planner.calibrate.held_out import rms
from planner.calibrate.poisson_gyro import PoissonFit, Turn, carried, poisson_gyro
from planner.calibrate.rest_methods import accelerometers_by_free_orientations, coefficient
from planner.dwells.table_rows import MOTION, by_run, level, rows_of
from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.calibration import Coefficient, Residual, SensorCalibration, Status, Tables
from planner.nouns.dwell_table import DwellTable
from planner.solvers.distributions import student_quantile

FOLDS = 5
LEAST_TURNS = 10  # four fifths of them have 16 equations for the nine numbers
TURNING = np.radians(3.0)  # rad/s; biases of MEMS gyros lie below
_NAMES = [
    ("scale_factor", f"{a}{a}") if a == b else ("misalignment", f"{a}{b}") for a in "xyz" for b in "xyz"
]


def by_rests_and_turns(table: DwellTable) -> list[SensorCalibration]:
    """Gyros, then accelerometers.

    A row that turns is the mean rate of one turn about a fixed axis over its duration; rows that rest stand
    before and after it in the same power-on. Raises InputError without gyros, accelerometers or such turns.
    """
    if table.gyro is None or table.acc is None:
        raise InputError("--method rests_and_turns needs gyro and acc columns")
    ordered, starts = by_run(table)
    moves = _moves(ordered)
    if moves.all():
        raise InputError("--method rests_and_turns: no row rests; it needs rests before and after every turn")
    accelerometers = accelerometers_by_free_orientations(rows_of(ordered, ~moves))
    assert ordered.acc is not None  # the table has them
    f = true_input(ordered.acc, accelerometers.tables, "accelerometer", ordered.conditions())
    turns = _turns(ordered, starts, moves, f)
    try:
        fit = poisson_gyro(turns)
    except ValueError as error:
        raise InputError(
            f"--method rests_and_turns: {error}; it needs rows that rest, turn and rest again in one power-on"
        ) from error
    return [_gyros(ordered, moves, fit, turns), accelerometers]


def _moves(table: DwellTable) -> NDArray[np.bool_]:
    """(n,) rows that turn: those that the table calls motions, else those whose gyros read a rate."""
    if table.kind is not None:
        return np.asarray(table.kind == MOTION)
    return np.asarray(np.linalg.norm(table_gyro(table) - level(table_gyro(table)), axis=1) > TURNING)


def table_gyro(table: DwellTable) -> Array:
    """(n, 3) gyro readings of a table that has them."""
    return np.zeros((len(table), 3)) if table.gyro is None else table.gyro


def _turns(table: DwellTable, starts: NDArray[np.int64], moves: NDArray[np.bool_], f: Array) -> list[Turn]:
    gyro, found = table_gyro(table), []
    for run in np.split(np.arange(len(table)), starts[1:]):
        rests = run[~moves[run]]
        for a, b in pairwise(rests):
            if b > a + 1:
                found.append(Turn(gyro[a + 1 : b], table.duration[a + 1 : b], gyro[a], f[a], f[b]))
    return found


def _gyros(
    table: DwellTable, moves: NDArray[np.bool_], fit: PoissonFit, turns: list[Turn]
) -> SensorCalibration:
    rest = table_gyro(table)[~moves]
    bias = rest.mean(axis=0)
    after = rms(fit.residual) * np.sqrt(3.0)
    alone = poisson_residual_before(turns)
    scale = np.diag(fit.K) - 1.0
    coefficients = [*_biases(rest, bias), *_coefficients(fit)]
    lost = [f"{c.error.split('.')[1]}.{c.term}" for c in coefficients if c.status == "undetermined"]
    notes = [
        f"gravity after {len(turns)} turns is missed by {alone:.3g} rad before and {after:.3g} rad after"
    ]
    notes += [f"gyro: the turns cannot tell {', '.join(lost)}"] if lost else []
    notes.append("the Earth's rate, up to 0.0042 deg/s, is in the bias")
    return SensorCalibration(
        sensor="gyro",
        method="rests_and_turns",
        coefficients=tuple(coefficients),
        covariance={"all": np.nan_to_num(fit.covariance)},
        condition={"all": fit.condition},
        tables=Tables(
            np.array([float(np.median(table.temperature_degc))]),
            bias[:, None],
            scale[:, None],
            np.zeros(3),
            fit.K / np.diag(fit.K)[:, None],
        ),
        residuals=(
            *(
                Residual(x, rms(rest[:, i]), s, s, False, len(rest), 1, "rests that were fitted")
                for i, x in enumerate("xyz")
                for s in [rms(rest[:, i] - bias[i])]
            ),
            _turned(turns, fit),
        ),
        random=(),
        notes=tuple(notes),
    )


def _turned(turns: list[Turn], fit: PoissonFit) -> Residual:
    """RMS over the turns of the angle by which gravity is missed, for the turn's time, rad/s.

    After: by gyros that were calibrated from other turns, where there are enough of them (B, task 7).
    """
    before, own = _missed_rate(turns, np.eye(3)), _missed_rate(turns, fit.K)
    n = len(turns)
    if n < LEAST_TURNS or fit.undetermined.any():
        how = "gravity missed after the turns that were fitted, for their time"
        return Residual("turns", rms(before), rms(own), rms(own), False, n, n, how)
    left = np.zeros(n)
    for k in range(FOLDS):
        others = poisson_gyro([turn for i, turn in enumerate(turns) if i % FOLDS != k])
        left[k::FOLDS] = _missed_rate(turns[k::FOLDS], others.K)
    how = f"gravity missed after turns left out, for their time, {FOLDS} folds"
    return Residual("turns", rms(before), rms(left), rms(own), True, n, n, how)


def _missed_rate(turns: list[Turn], K: Array) -> Array:
    """(n,) angle of gravity as gyros with ω_m − b = K ω carry it to what it is, over the turn's time."""
    S = np.asarray(np.linalg.inv(K), dtype=float)
    off = [carried(t, S) - t.after / np.linalg.norm(t.after) for t in turns]
    return np.asarray(np.linalg.norm(off, axis=1) / [t.spacing.sum() for t in turns])


def poisson_residual_before(turns: list[Turn]) -> float:
    """RMS angle (rad) by which uncalibrated gyros miss gravity after the turns."""
    missed = [carried(t, np.eye(3)) - t.after / np.linalg.norm(t.after) for t in turns]
    return float(np.sqrt(np.mean(np.sum(np.square(missed), axis=1))))


def _biases(rest: Array, bias: Array) -> list[Coefficient]:
    n = len(rest)
    error = rest.std(axis=0, ddof=1) / np.sqrt(n) if n > 1 else np.full(3, np.inf)
    half = student_quantile(0.975, n - 1) * error if n > 1 else error
    status: Status = "determined" if n > 1 else "weak"
    return [
        Coefficient(
            "gyro.bias", x, x, None, "deg/s", float(bias[i]), float(error[i]), float(n - 1),
            float(bias[i] - half[i]), float(bias[i] + half[i]), status,
        )
        for i, x in enumerate("xyz")
    ]  # fmt: skip


def _coefficients(fit: PoissonFit) -> list[Coefficient]:
    """Scale factors K_ii − 1 and misalignment K_ij/K_ii, with intervals by Student's t."""
    error = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
    found = []
    for k, (effect, term) in enumerate(_NAMES):
        i, j = divmod(k, 3)
        value = float(fit.K[i, j] / (1.0 if i == j else fit.K[i, i]) - (i == j))
        found.append(
            coefficient(
                f"gyro.{effect}", term if i != j else term[0], "1" if i == j else "deg", value,
                float(error[k]), float(fit.freedom), undetermined=bool(fit.undetermined[k]),
            )
        )  # fmt: skip
    return found
