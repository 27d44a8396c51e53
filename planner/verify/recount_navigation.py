"""The requirements counted again: sensitivities on the spec's flight, what the allowances make of them.

The columns come from the error equations, each effect's forcing on the flight's readings; worst cases add
moduli, rss adds squares, a percentile is found on the distribution of the length itself (Imhof 1961).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from planner import catalog
from planner.physics.error_dynamics import propagate_errors
from planner.protocols import SENSORS
from planner.records import Array, Trajectory
from planner.sensor import ErrorName
from planner.spec.model import NAVIGATION_ERRORS, Given, PercentileRule, Requirement, Spec
from planner.units import unit_factor
from planner.verify.findings import Findings
from planner.verify.flights import COMPONENTS, conditions_of

Document = Mapping[str, Any]
Vectors = Mapping[str, Array]  # error -> (terms, k), SI


def check_navigation(document: Document, spec: Spec, trajectory: Trajectory | None) -> list[Findings]:
    """Requirements, sensitivities and shares."""
    found = Findings("requirements", "limits are the spec's, what is achieved is what the allowances make")
    columns = Findings("sensitivities", "metres per unit of every error are those of the spec's flight")
    found.same("requirements", len(document["requirements"]), len(spec.requirement))
    history = _Columns(document, spec, trajectory)
    for i, (wanted, figures) in enumerate(zip(spec.requirement, document["requirements"], strict=False)):
        _check_words(found, i, wanted, figures)
        vectors, achieved = _achieved(document, wanted, history.at(wanted))
        unit = NAVIGATION_ERRORS[wanted.error]
        factor = unit_factor(unit)[0]
        where = f"requirements {i}"
        found.same(f"{where}, achieved", figures["achieved"], achieved / factor, 1e-7)
        found.same(f"{where}, met", figures["met"], achieved <= wanted.limit.si * (1 + 1e-9))
        if not figures["met"]:
            found.fault(where, "is not met by the plan's own figures")
        shares = _shares(document, wanted, vectors)
        found.same(f"{where}, shares", sorted(figures["shares"]), sorted(shares))
        for name, share in shares.items():
            found.same(f"{where}, shares, {name}", figures["shares"].get(name), share, 1e-7)
        _check_columns(columns, document, i, vectors, factor, unit)
    return [found, columns]


def _check_words(found: Findings, i: int, wanted: Requirement, figures: Document) -> None:
    at = wanted.at if isinstance(wanted.at, str) else f"{wanted.at:g} s"
    rule = wanted.rule
    said = f"percentile {100 * rule.percentile:g} %" if isinstance(rule, PercentileRule) else rule
    unit = NAVIGATION_ERRORS[wanted.error]
    for key, value in (
        ("error", wanted.error),
        ("at", at),
        ("rule", said),
        ("unit", unit),
        ("limit", wanted.limit.si / unit_factor(unit)[0]),
    ):
        found.same(f"requirements {i}, {key}", figures[key], value)


class _Columns:
    """Vectors of every error at the instants of a requirement."""

    def __init__(self, document: Document, spec: Spec, trajectory: Trajectory | None) -> None:
        self.spec, self.trajectory = spec, trajectory
        self.errors = [(sensor, effect) for sensor in SENSORS for effect in getattr(spec.unit, sensor)]
        self.history = None
        if not isinstance(spec.sensitivities, Given) and trajectory is not None:
            times = [float(r.at) for r in spec.requirement if not isinstance(r.at, str)]
            self.history = propagate_errors(trajectory, self._forcing, instants=times)

    def _forcing(self, start: int, stop: int) -> tuple[list[Array], list[Array]]:
        assert self.trajectory is not None
        c = conditions_of(self.trajectory, start, stop)
        gyro, accelerometer = (
            [catalog.effects()[e].regressors(sensor, c) for s, e in self.errors if s == sensor]
            for sensor in SENSORS
        )
        return gyro, accelerometer

    def at(self, wanted: Requirement) -> list[Vectors]:
        """The vectors at every instant at which it holds."""
        if isinstance(self.spec.sensitivities, Given):
            given = self.spec.sensitivities.given
            return [{name: np.array([[quantity.si]]) for name, quantity in given.items()}]
        assert self.history is not None
        field, components = COMPONENTS[wanted.error]
        values: Array = getattr(self.history, field)[:, components]
        time = self.history.time_s
        if wanted.at == "any":
            return [self._named(v) for v in values]
        if wanted.at == "end":
            return [self._named(values[-1])]
        flat = values.reshape(len(time), -1)
        row = np.array([np.interp(float(wanted.at), time, column) for column in flat.T])
        return [self._named(row.reshape(values.shape[1:]))]

    def _named(self, components: Array) -> Vectors:
        found, first = {}, 0
        for sensor, effect in self.errors:
            count = len(catalog.effects()[effect].terms(sensor))
            found[f"{sensor}.{effect}"] = components[:, first : first + count].T
            first += count
        return found


def _achieved(document: Document, wanted: Requirement, instants: Sequence[Vectors]) -> tuple[Vectors, float]:
    """The instant at which most of the limit is used, and how much, SI."""
    values = [_combined(document, wanted, vectors) for vectors in _likely(document, wanted, instants)]
    worst = int(np.argmax(values))
    return _likely(document, wanted, instants)[worst], values[worst]


def _likely(document: Document, wanted: Requirement, instants: Sequence[Vectors]) -> Sequence[Vectors]:
    """For a percentile at any moment: the dozen instants of largest variance, for each costs an integral."""
    if not isinstance(wanted.rule, PercentileRule) or len(instants) <= 12:
        return instants
    traces = [float(np.trace(_covariance(document, v))) for v in instants]
    return [instants[i] for i in sorted(np.argsort(traces)[-12:])]


def _size(document: Document, name: str, adds: bool) -> float:
    """SI size of an error by the rule of a requirement, from its parts."""
    a = document["allowances"].get(name)
    if a is None:
        return 0.0
    parts = np.array(list(a["parts"].values())) * unit_factor(a["unit"])[0]
    return float(parts.sum() if adds else np.sqrt((parts**2).sum()))


def _combined(document: Document, wanted: Requirement, vectors: Vectors) -> float:
    if isinstance(wanted.rule, PercentileRule):
        return length_quantile(_covariance(document, vectors), wanted.rule.percentile)
    adds = wanted.rule == "worst_case"
    terms = [np.linalg.norm(v, axis=1) * _size(document, name, adds) for name, v in vectors.items()]
    every = np.concatenate(terms) if terms else np.zeros(1)
    return float(every.sum() if adds else np.sqrt((every**2).sum()))


def _covariance(document: Document, vectors: Vectors) -> Array:
    k = next(iter(vectors.values())).shape[1]
    total = np.zeros((k, k))
    for name, v in vectors.items():
        total += _size(document, name, False) ** 2 * v.T @ v
    return total


def length_quantile(covariance: Array, probability: float) -> float:
    """r with P(|x| < r) = p for a Gaussian x: Σ λ z² by Imhof's inversion (Biometrika 48, 1961)."""
    from scipy.optimize import brentq
    from scipy.special import ndtri

    variances = np.linalg.eigvalsh(covariance)
    variances = variances[variances > 1e-12 * variances.max(initial=0.0)]
    if len(variances) == 0:
        return 0.0
    if len(variances) == 1:
        return float(np.sqrt(variances[0]) * ndtri(0.5 + probability / 2))
    scale = float(variances.sum())
    share = variances / scale
    low, high = 1e-6, 60.0
    rule = np.polynomial.legendre.leggauss(96)
    root = brentq(lambda x: _beyond(share, x, rule) - (1.0 - probability), low, high, xtol=1e-12, rtol=1e-13)
    return float(np.sqrt(root * scale))


def _beyond(variances: Array, x: float, rule: tuple[Array, Array]) -> float:
    """P(Σ λ z² > x) of two or three λ by conditioning: the last direction integrated out by Gauss-Legendre.

    Polar in the first two: P(λ₁z₁² + λ₂z₂² > y) = mean over θ of exp(−y / 2(λ₁cos² + λ₂sin²)).
    """
    # periodic and smooth: 1e-13 of the length for variances from 1 : 1 to 1 : 1e-6
    angle = (np.arange(128) + 0.5) * (np.pi / 2.0) / 128
    pair = np.sort(variances)[::-1][:2]
    width = pair[0] * np.cos(angle) ** 2 + pair[1] * np.sin(angle) ** 2

    def two(y: Array) -> Array:
        return np.asarray(np.exp(-np.maximum(y, 0.0)[:, None] / (2.0 * width)).mean(axis=1))

    if len(variances) == 2:
        return float(two(np.array([x]))[0])
    third = float(np.sort(variances)[0])
    node, weight = rule
    most = min(np.sqrt(x / third), 12.0)
    z = 0.5 * most * (node + 1.0)
    density = np.exp(-(z**2) / 2.0) / np.sqrt(2.0 * np.pi)
    inside = float(np.sum(weight * density * two(x - third * z**2)) * most)  # both signs: 2 · most/2
    from scipy.special import erfc

    return inside + float(erfc(most / np.sqrt(2.0)))


def _shares(document: Document, wanted: Requirement, vectors: Vectors) -> dict[str, float]:
    adds = wanted.rule == "worst_case"
    parts = {}
    for name in document["allowances"]:
        lengths = np.linalg.norm(vectors[name], axis=1) if name in vectors else np.zeros(1)
        size = _size(document, name, adds)
        parts[name] = float((lengths * size).sum() if adds else ((lengths * size) ** 2).sum())
    total = sum(parts.values())
    return {name: (value / total if total > 0 else 0.0) for name, value in parts.items()}


def _check_columns(
    found: Findings, document: Document, i: int, vectors: Vectors, factor: float, unit: str
) -> None:
    """One coefficient for every term: length per display unit."""
    wanted = []
    for name, a in document["allowances"].items():
        sensor, effect = ErrorName(name).parts
        lengths = np.linalg.norm(vectors[name], axis=1) if name in vectors else np.zeros(0)
        terms = [t.name for t in catalog.effects()[effect].terms(sensor)]
        axes = terms if len(terms) == len(lengths) else ["all"] * len(lengths)
        per = unit_factor(a["unit"])[0] / factor
        shown = unit if a["unit"] == "1" else f"{unit}/({a['unit']})"
        wanted += [
            (name, axis, float(length) * per, shown) for axis, length in zip(axes, lengths, strict=True)
        ]
    mine = [s for s in document["sensitivities"] if s["requirement"] == i]
    found.same(f"sensitivities of requirement {i}", len(mine), len(wanted))
    for s, (name, axis, value, shown) in zip(mine, wanted, strict=False):
        where = f"sensitivities of requirement {i}, {name} {axis}"
        found.same(where, [s["error"], s["axis"], s["unit"]], [name, axis, shown])
        found.same(f"{where}, value", s["value"], value, 1e-6)
