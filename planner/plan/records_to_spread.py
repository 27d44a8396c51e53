"""Records of one repeat → what they add to the spread of a coefficient from power-on to power-on.

K 2.5.2 takes s, the run-to-run standard deviation, for the spread of what one repeat measures: d = q s / √n.
One repeat measures by several records (half a difference of two faces for a scale factor), and between them
the other errors do not stand still. A channel's records y (m,) of one repeat are

    y = X (θ + r) + Σ_j x_j r_j + Σ_k x_k g_k + n

X (m, p) columns of the errors that the test calibrates, r their draws of this power-on; x_j those of the
other errors, which other tests calibrate: left of them are this power-on's draw and the error of that
estimate, which in the mean over as many repeats is as large, so r_j has the variance 2 s_j²; g the in-run
drift of every error, a first-order Gauss-Markov process over the records, E g g' = σ² exp(−|Δt|/τ); n white
noise, N²/t of a record of t seconds. With weights A = (XᵀU⁻¹X)⁻¹XᵀU⁻¹ the estimate A y has the variance

    s² = s_run² + diag A V Aᵀ,   V = Σ_j 2 s_j² x_j x_jᵀ + Σ_k σ_k² x_k x_kᵀ ∘ exp(−|Δt|/τ) + diag N²/t

and d = q(n) √(s² / n). U is V without the correlations of drift and noise, as a fit weighs records whose
correlation it does not know. Without in-run drift and noise, and with other errors that the motions cancel,
it is K's s exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.plan.channel_terms import ChannelTerm, channels, columns_of, terms_on
from planner.plan.motions_to_records import RepeatRecords, repeat_records
from planner.protocols import Sensor
from planner.solvers.least_squares import factors
from planner.spec.model import Given, Spec

_FLOOR = 1e-10  # of the variances: keeps U from being singular where the spec has neither drift nor noise
DEGENERATE = 1e-10  # share of the largest singular value at which two columns are one


def with_spreads(spec: Spec, models: Sequence[ErrorModel]) -> tuple[ErrorModel, ...]:
    """The errors with what the records of every test that calibrates them add to their spread.

    With `quantile: normal` nothing is added: K's formula as published. The same where the bench's motions
    are not known, and for errors of temperature and time, whose columns one repeat does not show.
    """
    if spec.plan.quantile == "normal":
        return tuple(models)
    tests = [name for name, test in spec.tests.items() if test.calibrates]
    made = {name: records for name in tests if (records := repeat_records(spec, name)) is not None}
    found = {name: added_spread(spec, models, records) for name, records in made.items()}
    return tuple(
        replace(
            model, within={name: added[model.name] for name, added in found.items() if model.name in added}
        )
        for model in models
    )


def added_spread(spec: Spec, models: Sequence[ErrorModel], records: RepeatRecords) -> dict[str, float]:
    """Error -> sigma in SI that the records of one repeat add to its run-to-run spread, of its worst axis.

    With published coefficients one axis stands for all, so there it is the best one.
    """
    served = {m.name for m in models if m.calibrated} & set(spec.tests[records.test].calibrates)
    own: dict[str, list[float]] = {}
    for sensor, channel in channels():
        for term, sigma in _of_channel(spec, models, records, served, sensor, channel):
            own.setdefault(term.error, []).append(sigma)
    if isinstance(spec.sensitivities, Given):
        best = {error: min(sigmas) for error, sigmas in own.items()}
        return {error: sigma for error, sigma in best.items() if np.isfinite(sigma)}
    return {error: max(sigmas) for error, sigmas in own.items()}


def _of_channel(
    spec: Spec,
    models: Sequence[ErrorModel],
    records: RepeatRecords,
    served: set[str],
    sensor: Sensor,
    channel: int,
) -> list[tuple[ChannelTerm, float]]:
    terms = terms_on(sensor, channel, models)
    mine = np.array([t.error in served for t in terms], dtype=bool)
    if not mine.any():
        return []
    x = columns_of(sensor, channel, terms, records.conditions)
    by_name = {model.name: model for model in models}
    run = np.array([by_name[t.error].largest_run_to_run for t in terms])
    drift = np.array([(by_name[t.error].in_run, by_name[t.error].in_run_time) for t in terms])
    V, U = covariances(records, x, np.where(mine, 0.0, np.sqrt(2.0) * run), drift, spec.unit.white(sensor))
    sigma = estimate_sigma(x[:, mine], V, root_of(U, x, run))
    return list(zip([t for t, m in zip(terms, mine, strict=True) if m], sigma.tolist(), strict=True))


def covariances(
    records: RepeatRecords, x: Array, run: Array, drift: Array, white: float
) -> tuple[Array, Array]:
    """V and U (m, m): records with columns x (m, k), sigmas run (k,), noise density white.

    drift: (k, 2) in-run sigma and correlation time of each error
    """
    t = records.conditions.time_on
    apart = np.abs(t[:, None] - t[None, :])
    shared = (x * run**2) @ x.T
    moving = np.zeros_like(shared)
    for column, (sigma, time) in zip(x.T, drift, strict=True):
        moving += sigma**2 * np.outer(column, column) * np.exp(-apart / time)
    noise = np.diag(white**2 / records.duration)
    return shared + moving + noise, shared + np.diag(np.diag(moving)) + noise


def root_of(U: Array, x: Array, run: Array) -> Array:
    """(m, m) Cholesky factor of U, on a floor far below the run-to-run of columns x (m, k), run (k,)."""
    largest = float(np.max(run**2 * np.mean(x**2, axis=0), initial=0.0))
    floor = _FLOOR * largest if largest > 0 or U.any() else 1.0  # where nothing scatters all weigh alike
    return np.asarray(np.linalg.cholesky(U + floor * np.eye(len(U))), dtype=np.float64)


def estimate_sigma(X: Array, V: Array, root: Array) -> Array:
    """(p,) √diag A V Aᵀ, A the weights by U = root rootᵀ; infinite for what is unobservable in X."""
    found = factors(np.asarray(np.linalg.solve(root, X), dtype=np.float64), DEGENERATE)
    A = np.linalg.solve(root.T, (found.to_coefficients @ found.basis.T).T).T
    variance = np.einsum("ij,jk,ik->i", A, V, A)
    return np.where(found.undetermined(), np.inf, np.sqrt(np.maximum(variance, 0.0)))
