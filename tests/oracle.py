"""A campaign in dense NumPy, slow and plain: what the campaign model is held to (n ≤ 300 records or so).

    y − u = A x + noise,   x ~ (0, T diag(1/λ) Tᵀ),   V = cov(run-to-run, in-run, white)

x stacks, for every term of every error: its constant c, its curve f on a grid of temperatures, its storage
walk w on every day. Nothing comes from the planner but the effects' regressors. Rows: (n, 3) readings of one
sensor, row 3 i + channel; take `[channel::3]` for one channel. SI, temperatures in °C, days in days.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Sensor
from planner.spec.budget import ErrorBudget

STORAGE_DAYS = 60.0


@dataclass(frozen=True)
class Size:
    """Sizes of one error. constant: prior sigma (infinite: flat); run_to_run: sigma at temperatures (n,).

    correlation_k: over which the draw of one power-on stays the same, exp(−ΔT² / (2 correlation_k²))
    grid, kernel: (G,), (G, G) temperatures of the curve and its covariance; storage: sigma after 60 days
    """

    constant: float = np.inf
    run_to_run: Callable[[Array], Array] = field(default=np.zeros_like)
    correlation_k: float = np.inf
    in_run: float = 0.0
    in_run_time: float = 600.0
    storage: float = 0.0
    grid: Array | None = None
    kernel: Array | None = None


def size_of(budget: ErrorBudget, **more: object) -> Size:
    """Run-to-run, in-run and storage of a spec's budget; `more` says the rest (curve, constant)."""
    length = budget.temperature_correlation
    said = {
        "run_to_run": budget.run_to_run_sigma,
        "correlation_k": np.inf if length is None else length,
        "in_run": budget.in_run_sigma,
        "in_run_time": budget.in_run_time,
        "storage": budget.storage_sigma,
    }
    return Size(**{**said, **more})


@dataclass(frozen=True)
class Unknown:
    """One entry of x: the part of a term, at a temperature (curve) or on a day (walk)."""

    effect: str
    term: str
    part: Literal["constant", "curve", "walk"]
    at: float = float("nan")


def columns(
    sensor: Sensor, conditions: Conditions, sizes: Mapping[str, Size], flight_day: float | None = None
) -> tuple[tuple[Unknown, ...], Array]:
    """x's entries and A (3 n, p). sizes: effect -> its sizes; flight_day: the walk is told there too."""
    unknowns: list[Unknown] = []
    found: list[Array] = []
    t, day = conditions.temperature_degc, conditions.day
    for effect, size in sizes.items():
        each = catalog.effects()[effect]
        x = each.regressors(sensor, conditions)
        days = np.unique(day if flight_day is None else np.append(day, flight_day))
        parts: list[tuple[Literal["constant", "curve", "walk"], float, Array]] = [
            ("constant", float("nan"), np.ones(len(t)))
        ]
        if size.grid is not None:
            hats = np.array([np.interp(t, size.grid, row) for row in np.eye(len(size.grid))])
            parts += [("curve", float(g), hat) for g, hat in zip(size.grid, hats, strict=True)]
        if size.storage:
            parts += [("walk", float(d), (day == d).astype(float)) for d in days]
        for k, term in enumerate(each.terms(sensor)):
            unknowns += [Unknown(effect, term.name, part, at) for part, at, _ in parts]
            found += [(x[:, :, k] * share[:, None]).ravel() for _, _, share in parts]
    return tuple(unknowns), np.stack(found, axis=1)


def prior(unknowns: tuple[Unknown, ...], sizes: Mapping[str, Size]) -> tuple[Array, Array]:
    """T (p, p) and λ (p,): x = T z, z of precision diag(λ), 0 for flat. A singular kernel may be."""
    T, precision = np.eye(len(unknowns)), np.ones(len(unknowns))
    for effect, term in dict.fromkeys((u.effect, u.term) for u in unknowns):
        size = sizes[effect]
        of = {
            part: [i for i, u in enumerate(unknowns) if (u.effect, u.term, u.part) == (effect, term, part)]
            for part in ("constant", "curve", "walk")
        }
        precision[of["constant"]] = size.constant**-2.0
        if of["curve"] and size.kernel is not None:
            values, vectors = np.linalg.eigh(size.kernel)
            T[np.ix_(of["curve"], of["curve"])] = vectors * np.sqrt(np.maximum(values, 0.0))
        if of["walk"]:
            days = np.array([unknowns[i].at for i in of["walk"]])
            steps = np.diff(days, prepend=0.0) / STORAGE_DAYS
            T[np.ix_(of["walk"], of["walk"])] = np.tril(np.ones((len(days),) * 2)) * (
                size.storage * np.sqrt(steps)
            )
    return T, precision


def covariance(
    sensor: Sensor,
    conditions: Conditions,
    run: Array,
    sizes: Mapping[str, Size],
    white: Array,
) -> Array:
    """V (3 n, 3 n). run: (n,) number of the power-on; white: (n,) or (n, 3) sigma of each record's mean."""
    n = len(run)
    same = (run[:, None] == run[None, :]).astype(float)
    apart = np.abs(conditions.time_on[:, None] - conditions.time_on[None, :])
    warmer = conditions.temperature_degc[:, None] - conditions.temperature_degc[None, :]
    V = np.diag(np.broadcast_to(np.reshape(white, (n, -1)), (n, 3)).ravel() ** 2)
    for effect, size in sizes.items():
        x = catalog.effects()[effect].regressors(sensor, conditions)
        s = size.run_to_run(conditions.temperature_degc)
        drawn = np.outer(s, s) * np.exp(-0.5 * (warmer / size.correlation_k) ** 2)
        drawn = same * (drawn + size.in_run**2 * np.exp(-apart / size.in_run_time))
        V += np.einsum("ict,ij,jdt->icjd", x, drawn, x).reshape(3 * n, 3 * n)
    return V


def strayed(sensor: Sensor, conditions: Conditions, slopes: Mapping[str, Array]) -> Array:
    """(n, 3) sigma of what 0.05 K from record to record make of curves with slopes (n,), SI/K."""
    found = np.zeros((len(conditions.day), 3))
    for effect, slope in slopes.items():
        x = catalog.effects()[effect].regressors(sensor, conditions)
        found += np.sum((0.05 * slope[:, None, None] * x) ** 2, axis=2)
    return np.sqrt(found)


def posterior(A: Array, V: Array, T: Array, precision: Array) -> Array:
    """cov(x | campaign) = (Λ + AᵀV⁻¹A)⁻¹, (p, p). Raises LinAlgError where something is not told."""
    told = A @ T
    information = np.diag(precision) + told.T @ np.linalg.solve(V, told)
    return np.asarray(T @ np.linalg.inv(information) @ T.T)


def posterior_of_lines(
    A: Array, V: Array, T: Array, precision: Array, nodes: Array, seen: Array, read: Array
) -> Array:
    """(h, h) covariance of what the tables leave in flight: G Λ⁻¹ Gᵀ + R M_B⁻¹ Rᵀ, G = H − R M_B⁻¹ WᵀV⁻¹A.

    nodes: W (rows, q) the fit's columns, A B in the notation of a map B from nodes to x; seen: H (h, p) what
    the flight sees of x; read: R (h, q) what it takes from the nodes, H B. Raises LinAlgError where the
    records do not tell the nodes, ValueError where a flat constant is none that the nodes can follow.
    """
    gain = np.linalg.solve(nodes.T @ np.linalg.solve(V, nodes), np.linalg.solve(V, nodes).T)
    missed = (seen - read @ gain @ A) @ T
    flat = precision == 0.0
    if np.abs(missed[:, flat]).max(initial=0.0) > 1e-6 * np.abs(seen).max():
        raise ValueError("the nodes cannot follow a constant that has no prior")
    curve = missed[:, ~flat] / np.sqrt(precision[~flat])
    noise = read @ gain
    return np.asarray(curve @ curve.T + noise @ V @ noise.T)
