"""Many campaigns of one plan at once: measured, and calibrated by generalised least squares of verify's own.

The variances are the spec's: per power-on, the draw of every budgeted error over the records, its in-run
drift of correlation exp(−|Δt|/τ), white noise ∝ 1/duration, and what the chamber's stray makes of the curves
(slopes); references of the bench that err are
unknowns with a prior, and so are the steps of a walk in store, back from the last power-on, and the constants
of what is budgeted and not declared. Whitening and the
design's inverse are worked out once, P = (XᵀV⁻¹X)⁻¹XᵀV⁻¹; every unit then costs matrix products,
θ ← θ + P (y − ŷ(θ)), which is Gauss-Newton with the Jacobian at zero: it contracts by κ, 0.5 % a round. Where
the records hardly determine a coefficient it need not contract; such units go on with the Jacobian where
they are (`gauss_newton`), and if that does not settle either, the first, linear solution stays, which is as
useless as any that fits. `planner calibrate` finds the variances in each unit's data instead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import SENSORS, Group, Sensor
from planner.verify.chance import Chance
from planner.verify.declared import INPUT, Declared, declared, driven_by, sensed
from planner.verify.draws import DrawnError, Unit, generator
from planner.verify.gauss_newton import gauss_newton
from planner.verify.records import Records
from planner.verify.references import Direction
from planner.verify.response import Bend, is_proportional, linearised, times
from planner.verify.shared_unknowns import slopes_of, undeclared, walked
from planner.verify.smooth import LINES, Tables
from planner.verify.strays import STILL, Strays
from planner.verify.weights import Weights

_ROUNDS = 5  # 0.5 % of scale factor to the fifth is nothing
_LEAST_WHITE = 1e-8  # of what power-ons scatter: records without noise must not make V singular
_LEAST_BESIDE_WALKS = 1e-6  # of what walks add: a perfect sensor's records would tell anything from anything
_QUIET = 1e-12  # SI: what stands for the noise of records that have none
_SETTLED = 0.02  # standard errors, within which the last round leaves every coefficient
_RANK = 1e-11  # of the largest singular value of columns of unit length: below is rounding
_TOUCHED = 1e-6  # share of a coefficient in a combination that no record sees


@dataclass(frozen=True)
class Estimator:
    """Some channels' estimator: their model and P (p, n c), rows record by record.

    covariance: (p, p) by the spec's noise; undetermined: (p,) which no record tells from the others
    tables: how its tables are read; weights: V⁻¹ of its records, beside the references that err
    """

    model: Declared
    inverse: Array
    covariance: Array
    undetermined: NDArray[np.bool_]
    proportional: bool
    tables: Tables
    weights: Weights

    @property
    def error(self) -> Array:
        """(p,) standard errors."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def reads(self, effect: str, index: int, degc: Array) -> tuple[list[int], Array]:
        """Places of a term's coefficients, and their weights (..., N) at temperatures (...)."""
        mine, nodes, noise = self._places[effect, index]
        if np.isnan(nodes).any():
            return mine, np.ones((*np.shape(degc), len(mine)))
        return mine, self.tables.weights((self.model.sensor, effect), degc, nodes, noise)

    @cached_property
    def _places(self) -> dict[tuple[str, int], tuple[list[int], Array, Array]]:
        """Effect and term -> places of its coefficients, their nodes and covariance."""
        places: dict[tuple[str, int], list[int]] = {}
        for i, c in enumerate(self.model.columns):
            places.setdefault((c.effect, c.index), []).append(i)
        nodes = np.array([c.node_degc for c in self.model.columns])
        return {
            term: (mine, nodes[mine], self.covariance[np.ix_(mine, mine)]) for term, mine in places.items()
        }


def estimators(
    records: Records,
    unit: Unit,
    effects: Sequence[str],
    chance: Chance,
    off: Sequence[Direction] = (),
    tables: Tables = LINES,
    strays: Strays = STILL,
) -> dict[Sensor, tuple[Estimator, ...]]:
    """Both sensors, channels with common terms together. Raises InputError for too few records.

    off: the ways in which references err, which are unknowns of the fit with a prior of their sigma
    tables: how tables are read between their nodes; strays: what the chamber's stray makes of curves
    """
    return {
        sensor: tuple(
            _estimator(model, records, unit, chance, off, tables, strays)
            for model in declared(sensor, records.conditions, effects)
            if model.columns
        )
        for sensor in SENSORS
    }


def as_shown(
    known: Mapping[Sensor, Sequence[Estimator]],
    records: Records,
    unit: Unit,
    chance: Chance,
    off: Sequence[Direction],
    strays: Strays,
    span: tuple[float, float],
) -> dict[Sensor, tuple[Estimator, ...]]:
    """The estimators of one unit's records, at the temperatures that its own table shows.

    Records that stray around a node tell the slope of the curve there, which is not that of the table: an
    unknown of its own, as steep as a wave of the curve's size over the temperatures of use, span.
    """

    def seen(x: Estimator) -> Estimator:
        slopes = slopes_of(x.model, records, unit, span)
        return _estimator(x.model, records, unit, chance, off, x.tables, strays, slopes)

    return {sensor: tuple(map(seen, several)) for sensor, several in known.items()}


def _estimator(
    model: Declared,
    records: Records,
    unit: Unit,
    chance: Chance,
    off: Sequence[Direction],
    tables: Tables,
    strays: Strays,
    slopes: Sequence[Array] = (),
) -> Estimator:
    conditions = records.conditions
    u = sensed(model.sensor, conditions)[:, list(model.channels)]
    X = np.concatenate(
        [
            model.matrix(model.bias, conditions),
            model.scaled(conditions, u),
            model.matrix(model.misalignment, conditions),
        ],
        axis=2,
    ).reshape(u.size, -1)
    if X.shape[1] >= len(X):
        raise InputError(
            f"{len(X)} records of the plan cannot give the {X.shape[1]} coefficients of {model.sensor} "
            f"{''.join('xyz'[c] for c in model.channels)}; plan more records, or declare fewer effects"
        )
    walks = walked(model, records, unit)
    least = _LEAST_BESIDE_WALKS * sum(float(np.mean(w**2)) for w in walks)
    roots = _roots(model, records, unit, chance, strays, least)
    rows = [_rows(run, len(model.channels)) for run in records.runs]
    shared = [d.sigma * getattr(d, INPUT[model.sensor])[:, model.channels].ravel() for d in off] + walks
    shared += [*undeclared(model, records, unit), *slopes]
    both = np.column_stack([X, *(column for column in shared if column.any())])
    white = np.concatenate([np.linalg.solve(root, both[r]) for root, r in zip(roots, rows, strict=True)])
    inverse, undetermined = _inverse(white, X.shape[1])
    quiet = all(np.max(root) <= _QUIET for root in roots)  # only references that err leave anything then
    left = inverse[:, len(X) if quiet else 0 :]
    covariance = left @ left.T
    weights = Weights(tuple(roots), tuple(rows), white[:, X.shape[1] :])
    inverse = inverse[:, : len(X)]
    for root, r in zip(roots, rows, strict=True):
        inverse[:, r] = np.linalg.solve(root.T, inverse[:, r].T).T
    by_one = is_proportional(model, conditions)
    return Estimator(model, np.ascontiguousarray(inverse), covariance, undetermined, by_one, tables, weights)


def _rows(records: NDArray[np.int64], channels: int) -> NDArray[np.int64]:
    """Rows of X of some records."""
    return (records[:, None] * channels + np.arange(channels)).ravel()


def _inverse(white: Array, p: int) -> tuple[Array, NDArray[np.bool_]]:
    """Pseudo-inverse (p, rows + q) of whitened columns (rows, p + q), and which coefficients no row sees.

    The last q have a prior of unit variance: q pseudo-records below.
    """
    q = white.shape[1] - p
    white = np.vstack([white, np.hstack([np.zeros((q, p)), np.eye(q)])])
    length = np.linalg.norm(white, axis=0)
    length = np.where(length > 0, length, 1.0)
    u, s, vt = np.linalg.svd(white / length, full_matrices=False)
    seen = s > _RANK * s.max(initial=0.0)
    unseen = np.linalg.norm(vt[~seen], axis=0) > _TOUCHED
    return ((vt[seen].T / s[seen]) @ u[:, seen].T / length[:, None])[:p], unseen[:p]


# ---------------------------------------------------------------- variances by the spec


def _roots(
    model: Declared, records: Records, unit: Unit, chance: Chance, strays: Strays, beside_walks: float
) -> list[Array]:
    """Cholesky factor of every power-on's V, its rows record by record, channels side by side."""
    c = records.conditions
    columns = _scattered(model, records, unit)
    by_day = any("day" in catalog.effects()[e].needs for (s, e) in unit.budgets if s == model.sensor)
    between = sum(float(np.mean((x * s[:, None, None]) ** 2)) for x, s, _, _, _ in columns)
    least = max(_LEAST_WHITE * between, beside_walks)
    strayed = _strayed(model, records, strays)
    known: dict[bytes, Array] = {}
    found = []
    for run in records.runs:
        seen = [c.rate, c.specific_force, c.temperature_degc, c.time_on, records.duration]
        key = b"".join(np.round(x[run], 9).tobytes() for x in [*seen, *([c.day] if by_day else [])])
        if key not in known:
            white = chance.white[model.sensor] ** 2 / records.duration[run] + least
            noise = white[:, None] + strayed[run]
            V = _of_run(run, columns, records, noise, len(model.channels))
            known[key] = np.asarray(np.linalg.cholesky(V), dtype=np.float64)
        found.append(known[key])
    return found


def _strayed(model: Declared, records: Records, strays: Strays) -> Array:
    """(n, c) variance of what the chamber's stray makes of the sensor's curves."""
    found = np.zeros((len(records), len(model.channels)))
    for (sensor, effect), sigma in strays.items():
        if sensor == model.sensor:
            x = catalog.effects()[effect].regressors(sensor, records.conditions)[:, list(model.channels)]
            found += sigma[:, None] ** 2 * np.sum(x**2, axis=2)
    return found


_Scattered = tuple[Array, Array, float, float, float | None]  # x (n, c, t), s(T) (n,), in-run, its τ, L


def _scattered(model: Declared, records: Records, unit: Unit) -> list[_Scattered]:
    """What every budgeted error of the sensor adds from power-on to power-on, and within one."""
    c, found = records.conditions, []
    for (sensor, effect), b in unit.budgets.items():
        if sensor == model.sensor and (b.has_run_to_run or b.in_run_sigma > 0):
            x = catalog.effects()[effect].regressors(sensor, c)[:, list(model.channels)]
            s = b.run_to_run_sigma(c.temperature_degc)
            found.append((x, s, b.in_run_sigma, b.in_run_time, b.temperature_correlation))
    return found


def _of_run(
    run: NDArray[np.int64], columns: list[_Scattered], records: Records, noise: Array, channels: int
) -> Array:
    """V (m c, m c) of one power-on; noise: (m, c) variances of what every record has of its own."""
    c, m = records.conditions, len(run)
    later = np.abs(np.subtract.outer(c.time_on[run], c.time_on[run]))
    warmer = np.subtract.outer(c.temperature_degc[run], c.temperature_degc[run])
    V = np.zeros((m, channels, m, channels))
    for x, s, drift, time, length in columns:
        K = np.outer(s[run], s[run]) * (1.0 if length is None else np.exp(-0.5 * (warmer / length) ** 2))
        K = K + drift**2 * np.exp(-later / time)
        V += np.einsum("ict,ij,jdt->icjd", x[run], K, x[run])
    flat = V.reshape(m * channels, m * channels) + np.diag(noise.ravel())
    return flat if flat.any() else _QUIET**2 * np.eye(len(flat))


# ---------------------------------------------------------------- measuring


def readings(
    sensor: Sensor, conditions: Conditions, errors: Sequence[DrawnError], noise: Array | float
) -> Array:
    """(B n, 3) what the sensor reads: y = (1 + κ)(M u) + b + noise."""
    mine = [e for e in errors if e.sensor == sensor]
    v = sensed(sensor, conditions) + _sum("misalignment", sensor, conditions, mine)
    misaligned = replace(conditions, **{INPUT[sensor]: v})
    y = v + _sum("scale_factor", sensor, misaligned, mine) + _sum("bias", sensor, conditions, mine)
    return np.asarray(y + noise)


def _sum(group: Group, sensor: Sensor, conditions: Conditions, errors: Sequence[DrawnError]) -> Array:
    total = np.zeros((len(conditions.day), 3))
    for error in errors:
        effect = catalog.effects()[error.effect]
        if effect.group == group:
            values = error.records.reshape(len(total), -1)
            total += np.einsum("nct,nt->nc", driven_by(effect, sensor, conditions), values)
    return total


def white_noise(sensor: Sensor, records: Records, units: int, chance: Chance, key: tuple[int, int]) -> Array:
    """(B n, 3) of a record's mean."""
    sigma = chance.white[sensor] / np.sqrt(records.duration)
    draw = generator(*key, "white", sensor).normal(size=(units, len(records), 3))
    return np.asarray((sigma[None, :, None] * draw).reshape(-1, 3))


# ---------------------------------------------------------------- calibrating


def calibrated(estimator: Estimator, conditions: Conditions, y: Array, units: int) -> Array:
    """(B, p) coefficients from readings y (B n, 3) of the sensor, at conditions as the table shows them."""
    model = estimator.model
    channels = list(model.channels)
    shape = (units, -1, len(channels))
    u = sensed(model.sensor, conditions)[:, channels].reshape(shape)
    read = y[:, channels].reshape(shape)
    B, L = (model.matrix(part, conditions).reshape(*u.shape, -1) for part in (model.bias, model.misalignment))
    bend = Bend(model, conditions, u.shape, proportional=estimator.proportional)
    biases, scales = len(model.bias), len(model.scale)
    theta = first = step = (read - u).reshape(units, -1) @ estimator.inverse.T
    with np.errstate(all="ignore"):  # a design that determines nothing may run away: see below
        for _ in range(_ROUNDS):
            b, k, m = np.split(theta, [biases, biases + scales], axis=1)
            v = u + times(L, m)
            step = (read - v - bend(v, k) - times(B, b)).reshape(units, -1) @ estimator.inverse.T
            theta = theta + step
        settled = np.all(np.abs(step) <= _SETTLED * estimator.error + 1e-9, axis=1)
        if settled.all():
            return theta
        left = np.flatnonzero(~settled)

        def at(theta: Array, which: NDArray[np.int64]) -> tuple[Array, Array]:
            b, k, m = np.split(theta, [biases, biases + scales], axis=1)
            units = left[which]
            theirs, shape = _of(conditions, units, len(u)), (len(units), *u.shape[1:])
            bent = Bend(model, theirs, shape, proportional=estimator.proportional)
            return linearised(u[units], read[units], B[units], L[units], bent, (b, k, m))

        exact, ends = gauss_newton(first[left], at, estimator.weights, _SETTLED * estimator.error + 1e-9)
        theta[left] = np.where(ends[:, None], exact, first[left])
    return theta


def _of(conditions: Conditions, units: NDArray[np.int64], every: int) -> Conditions:
    """The conditions of some of the units, whose records stand one after another."""
    n = len(conditions.day) // every
    return conditions.at((units[:, None] * n + np.arange(n)).ravel())
