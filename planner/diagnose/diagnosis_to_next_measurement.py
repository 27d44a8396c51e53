"""Rivals that the data cannot tell apart → the bench run that separates them best per hour.

If A with its coefficients c is the truth, B beside the declared model mimics it but for

    Δ = ‖(I − P) V^(−1/2) G_A c‖²,   P the projector on V^(−1/2) [J, G_B],

and √Δ is how many sigma the data hold for A against B. A new run adds its whitened rows to the triangular
factor of [J, G_B, G_A c]; the last entry of the diagonal is then √Δ with the run made.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner import catalog
from planner.diagnose.channels.parameters import grid, ranges
from planner.diagnose.diagnosis_to_residual import ChannelFits, UnitFits
from planner.diagnose.update.bench_runs import BenchRun, bench_runs
from planner.diagnose.weighed_fit import linear_jacobian
from planner.measurement import AXES, evaluate
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.diagnosis import FoundEffect, NextMeasurement
from planner.nouns.dwell_table import DwellTable
from planner.solvers.random_effects import RandomEffects, covariance
from planner.spec.model import Spec

ENOUGH = 6.0  # sigma that the new run shall bring by itself: a rival is then refused for good
REPEATS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)  # tried in turn: after two, never more than half again
LEAST_GAIN = 0.1  # sigma; a run that adds less separates nothing
_FAINT = 1e-6  # of a column's length: a prior that no data notice
_SHAPES = 16  # points of a rival's parameters: it may take the one that mimics best


@dataclass(frozen=True)
class _Problem:
    """One channel: triangular factors of what is known, and how a run's rows extend them.

    shapes: points of the rival's parameters, with a factor each; it may take what mimics best
    """

    fits: ChannelFits
    found: FoundEffect
    rival: str
    shapes: tuple[Mapping[str, float], ...]
    factors: tuple[Array, ...]
    record: float


def next_measurements(
    found: tuple[FoundEffect, ...], fits: UnitFits, spec: Spec
) -> tuple[NextMeasurement, ...]:
    """For every found effect and each rival of the library the run that tells them apart best per hour."""
    runs: list[BenchRun] = []
    made: dict[tuple[str, str], NextMeasurement] = {}
    for effect, rival in _pairs(found):
        runs = runs or bench_runs(spec, fits.table.temperature_degc.tolist(), float(fits.table.day.max()))
        shapes = shapes_of(rival, effect, fits.table)
        problems = [
            _problem(c, effect, rival, shapes, float(np.mean(fits.table.duration)))
            for c in fits.channels
            if effect in c.found
        ]
        best = min((_priced(problems, run) for run in runs), key=lambda p: p.rank, default=None)
        if best is not None and best.gain > LEAST_GAIN**2:
            wanted = _measurement(effect.effect, rival, best, fits)
            same = made.get(wanted.separates)
            if same is None or same.time_s < wanted.time_s:  # the hardest channel's serves the others too
                made[wanted.separates] = wanted
    return tuple(made.values())


def _pairs(found: tuple[FoundEffect, ...]) -> Iterator[tuple[FoundEffect, str]]:
    for effect in found:
        for rival in effect.rivals:
            known = catalog.effects().get(rival.effect)
            if known is not None and effect.sensor in known.sensors:
                yield effect, rival.effect


# ---------------------------------------------------------------- what is known


def _problem(
    fits: ChannelFits,
    found: FoundEffect,
    rival: str,
    shapes: tuple[Mapping[str, float], ...],
    record: float,
) -> _Problem:
    factors = tuple(_known(fits, found, rival, shape) for shape in shapes)
    return _Problem(fits, found, rival, shapes, factors, max(record, 1.0))


def _known(fits: ChannelFits, found: FoundEffect, rival: str, shape: Mapping[str, float]) -> Array:
    white = fits.after.v.whiten(_columns(fits, found, rival, shape, fits.before.model.conditions))
    length = np.linalg.norm(white, axis=0)
    faint = np.diag(_FAINT * np.where(length > 0, length, 1.0))[:-1]  # keeps what nobody knows well-defined
    return _triangle(np.concatenate([white, faint]))


def _triangle(rows: Array) -> Array:
    """(q, q) the triangular factor of rows (n, q)."""
    return np.asarray(np.linalg.qr(rows, mode="r"))


def _columns(
    fits: ChannelFits, found: FoundEffect, rival: str, shape: Mapping[str, float], conditions: Conditions
) -> Array:
    """(n, p + q + 1): the declared model's derivative, the rival's columns, and what was found."""
    axis = AXES.index(fits.channel[-1])
    model = replace(fits.before.model, conditions=conditions)
    J = linear_jacobian(model, fits.before.theta, evaluate(model, fits.before.theta))
    effect = catalog.effects()[found.effect]
    own = effect.regressors(found.sensor, conditions, found.nonlinear)[:, axis, :]
    names = [t.name for t in effect.terms(found.sensor)]
    added = sum(
        (
            t.value * own[:, names.index(t.name)]
            for t in found.terms
            if not t.parameter and (t.channel[-1] == fits.channel[-1] or t.channel == "all")
        ),
        np.zeros(len(conditions.day)),
    )
    other = catalog.effects()[rival].regressors(found.sensor, conditions, shape)[:, axis, :]
    return np.column_stack([J, other, added])


def shapes_of(rival: str, found: FoundEffect, table: DwellTable) -> tuple[Mapping[str, float], ...]:
    """Points of the rival's parameters as far as the data show them; what was found where names agree."""
    effect = catalog.effects()[rival]
    points = grid(ranges(effect, table), _SHAPES)
    same = {p: found.nonlinear[p] for p in effect.nonlinear if p in found.nonlinear}
    return (*points, *([{**effect.nonlinear, **same}] if same else []))


# ---------------------------------------------------------------- what a run adds


@dataclass(frozen=True)
class _Priced:
    """A run made so often, what separation it reaches, and its time."""

    run: BenchRun
    repeats: int
    separation: float
    gain: float
    time_s: float

    @property
    def rank(self) -> tuple[bool, float]:
        """First those that suffice, the shortest first; then by what an hour gains."""
        enough = self.gain >= ENOUGH**2
        return (not enough, self.time_s if enough else -self.gain / self.time_s)


def _priced(problems: list[_Problem], run: BenchRun) -> _Priced:
    before = float(sum(min(map(_squared, p.factors)) for p in problems))
    rows = [_run_rows(p, run) for p in problems]
    total, repeats = before, 0
    for repeats in REPEATS:
        total = float(sum(_with(p, r, repeats) for p, r in zip(problems, rows, strict=True)))
        if total - before >= ENOUGH**2:
            break
    time = run.once_s + repeats * run.repeat_s
    return _Priced(run, repeats, float(np.sqrt(total)), float(total - before), time)


def _with(problem: _Problem, rows: Sequence[Array], repeats: int) -> float:
    """Δ of a channel with a run made so often, the rival at the shape that then mimics best."""
    weight = np.sqrt(repeats)
    return min(
        _squared(_triangle(np.concatenate([factor, weight * more])))
        for factor, more in zip(problem.factors, rows, strict=True)
    )


def _squared(factor: Array) -> float:
    return float(factor[-1, -1] ** 2) if factor.shape[0] >= factor.shape[1] else 0.0


def _run_rows(problem: _Problem, run: BenchRun) -> list[Array]:
    """Whitened rows of one power-on for every shape of the rival: its own offset costs it a row."""
    fit = problem.fits.after.spreads
    u = columns_input(problem.fits, run.conditions)
    diagonal = fit.white**2 * problem.record / run.duration + (fit.rate * u) ** 2
    effects = RandomEffects(
        np.zeros(1, dtype=np.int64), diagonal[None, :], np.ones((1, len(u))) * (fit.run > 0)
    )
    v = covariance(effects, np.array([1.0, fit.run**2]))
    return [
        v.whiten(_columns(problem.fits, problem.found, problem.rival, shape, run.conditions))
        for shape in problem.shapes
    ]


def columns_input(fits: ChannelFits, conditions: Conditions) -> Array:
    """(m,) true input along the channel under other conditions."""
    sensed = conditions.rate if fits.sensor == "gyro" else conditions.specific_force
    return sensed[:, AXES.index(fits.channel[-1])]


# ---------------------------------------------------------------- in words


def _measurement(found: str, rival: str, best: _Priced, fits: UnitFits) -> NextMeasurement:
    return NextMeasurement(
        separates=(found, rival),
        bench=best.run.bench,
        test=best.run.test or best.run.what,
        condition=_condition(best, float(fits.table.day.max())),
        separation=best.separation,
        time_s=best.time_s,
    )


def _condition(best: _Priced, last_day: float) -> dict[str, float | str]:
    c = best.run.conditions
    said: dict[str, float | str] = {
        "do": _words(best.run),
        "temperature_degc": round(float(np.mean(c.temperature_degc)), 1),
        "records": float(len(best.run.duration)),
        "record_s": round(float(best.run.duration.max()), 3),
        "time_on_s": round(float(c.time_on.max()), 1),
        "repeats": float(best.repeats),
    }
    if np.any(c.temperature_rate):
        said["temperature_rate_k_min"] = round(float(c.temperature_rate.mean()) * 60.0, 3)
    if c.day.max() > last_day + 1.0:
        said["days_later"] = round(float(c.day.max()) - last_day, 1)
    for name in sorted({key for motion in best.run.motions for key in motion}):
        levels = sorted({motion[name] for motion in best.run.motions if name in motion})
        said[name] = ", ".join(f"{x:g}" for x in levels)
    return said


def _words(run: BenchRun) -> str:
    if run.test:
        return f"the spec's test {run.test}"
    return {
        "rests": "rests on all faces",
        "turns": "turns at all rates about every axis, both directions",
        "loads": "loads of the centrifuge in every mounting",
        "watch": "one rest for an hour from power-on",
        "ramp": "a rest while the chamber passes through the temperature",
    }[run.what]
