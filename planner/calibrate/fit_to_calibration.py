"""Channel fits → the calibration of a sensor: coefficients with intervals, tables, random characteristics."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.calibrate.profiled import profiled
from planner.calibrate.weak_coefficients import weak, within_budget
from planner.calibrate.what_would_tell import what_would_tell
from planner.campaign.estimate import Estimate
from planner.campaign.noise import Component
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.calibration import (
    Coefficient,
    ExtraTerm,
    RandomCharacteristic,
    Residual,
    SensorCalibration,
    SmoothTable,
    Status,
    Tables,
)
from planner.protocols import Sensor
from planner.solvers.distributions import chi_square_quantile, student_quantile
from planner.spec.model import Spec
from planner.spec.own_units import own_unit
from planner.temperature_table import REACH_K, hats

CONFIDENCE = 0.95
_LINEAR = ("bias", "scale_factor", "misalignment", "scale_factor_asymmetry")


def sensor_calibration(
    sensor: Sensor,
    fits: Sequence[Estimate],
    residuals: Sequence[Residual],
    spec: Spec,
    method: str,
    smooth: Sequence[SmoothTable] = (),
    remarks: Sequence[str] = (),
) -> SensorCalibration:
    """What was found for one sensor, channel by channel; smooth: tables in place of the fitted nodes."""
    drawn = [within_budget(fit, half_widths(fit), spec) for fit in fits]
    coefficients = tuple(
        c
        for fit, given in zip(fits, drawn, strict=True)
        for c in coefficients_of(
            given,
            spec,
            weak(fit, half_widths(fit), spec, half_widths(given)),
            profiled(fit, CONFIDENCE) if given is fit else {},  # what is drawn is as its covariance says
        )
    )
    notes = [f"{sensor} {AXES[fit.model.channel]}: {note}" for fit in fits for note in fit.notes]
    return SensorCalibration(
        sensor=sensor,
        method=method,
        coefficients=coefficients,
        covariance={AXES[fit.model.channel]: fit.fit.covariance for fit in drawn},
        condition={AXES[fit.model.channel]: fit.fit.factors.condition for fit in fits},
        tables=tables_of(drawn, smooth),
        residuals=tuple(residuals),
        random=tuple(r for fit in fits for r in random_of(fit, spec)),
        notes=(*notes, *_not_determined(sensor, coefficients), *_remedies(sensor, fits), *remarks),
        smooth=tuple(smooth),
    )


# ---------------------------------------------------------------- coefficients


def coefficients_of(
    fit: Estimate,
    spec: Spec,
    faint: NDArray[np.bool_] | None = None,
    shaped: Mapping[int, tuple[float, float]] | None = None,
) -> list[Coefficient]:
    """The channel's coefficients with 95 % intervals by Student's t and their own degrees of freedom.

    faint: (p,) which are weak; shaped: intervals by the profile (`profiled`); by the fit itself if not given
    """
    found = []
    half = half_widths(fit)
    if faint is None:
        faint = weak(fit, half, spec)
    if shaped is None:
        shaped = profiled(fit, CONFIDENCE)
    shapes = {(effect, p.name): p for effect, p in fit.model.fitted_parameters}
    for i, column in enumerate(fit.model.columns()):
        value, h = float(fit.theta[i]), float(half[i])
        low, high = shaped.get(i, (value - h, value + h))
        error = float(_errors(fit)[i])
        p = shapes.get((column.effect, column.parameter))
        if p is not None and p.scale == "logarithmic":  # the interval is one of the logarithm
            value, low, high = (p.value(x) for x in (value, low, high))
            error *= value
        status: Status = "undetermined" if fit.fit.undetermined[i] else "weak" if faint[i] else "determined"
        found.append(
            Coefficient(
                error=f"{fit.model.sensor}.{column.effect}",
                channel=AXES[fit.model.channel],
                term=column.parameter or column.term,
                temperature_degc=None if np.isnan(column.node_degc) else column.node_degc,
                unit=p.unit if p is not None else own_unit(spec, fit.model.sensor, column.effect),
                value=value,
                standard_error=error,
                freedom=float(fit.fit.freedom[i]),
                low=low,
                high=high,
                status=status,
            )
        )
    return found


def half_widths(fit: Estimate) -> Array:
    """(p,) of the 95 % intervals; infinite where the data tell nothing."""
    half = student_quantile((1.0 + CONFIDENCE) / 2.0, fit.fit.freedom) * _errors(fit)
    return np.where(fit.fit.undetermined, np.inf, half)


def _errors(fit: Estimate) -> Array:
    return np.sqrt(np.maximum(np.diag(fit.fit.covariance), 0.0))


def _remedies(sensor: str, fits: Sequence[Estimate]) -> list[str]:
    """What would determine what the channels do not tell."""
    return [f"{sensor} {AXES[f.model.channel]}: {said}" for f in fits for said in what_would_tell(f)]


def _not_determined(sensor: str, coefficients: Sequence[Coefficient]) -> list[str]:
    """A sentence for each channel with coefficients that the data do not determine."""
    notes = []
    for channel in AXES:
        for status, why, done in (
            ("undetermined", "the data cannot tell", ""),
            (
                "weak",
                "the data tell less than the spec's budget already says of",
                "; where they may be zero, the budget draws them to it",
            ),
        ):
            names = [_name(c) for c in coefficients if c.channel == channel and c.status == status]
            if names:
                notes.append(f"{sensor} {channel}: {why} {', '.join(names)}{done}")
    return notes


def _name(c: Coefficient) -> str:
    at = "" if c.temperature_degc is None else f" at {c.temperature_degc:.0f} degC"
    return f"{c.error.split('.')[1]}.{c.term}{at}"


# ---------------------------------------------------------------- tables


def tables_of(fits: Sequence[Estimate], smooth: Sequence[SmoothTable] = ()) -> Tables:
    """The three channels on one grid of temperatures; a table on its own nodes is exact on the union.

    Smooth tables reach as far as they are meant to: all are constant beyond the grid then.
    """
    known = {(s.error.partition(".")[2], s.channel): s for s in smooth}
    nodes = _union([x for fit in fits for x in _grids(fit, known)])
    bias, scale = np.zeros((3, len(nodes))), np.zeros((3, len(nodes)))
    asymmetry, misalignment = np.zeros(3), np.eye(3)
    extra: dict[tuple[str, str], ExtraTerm] = {}  # a term that channels share stands once
    for fit in fits:
        i = fit.model.channel
        bias[i], scale[i] = (_table(fit, e, known, nodes) for e in ("bias", "scale_factor"))
        shapes = _parameters(fit)
        apart = {c.effect.name for c in fit.model.carried if c.effect.bench_only}.union(_LINEAR)
        for column, value in zip(fit.model.columns(), fit.theta, strict=True):
            if column.effect == "scale_factor_asymmetry":
                asymmetry[i] = value
            elif column.effect == "misalignment":
                misalignment[i, AXES.index(column.term[1])] = value
            elif column.effect not in apart and not column.parameter:
                term = ExtraTerm(column.effect, column.term, float(value), shapes.get(column.effect, {}))
                extra[column.effect, column.term] = term
    return Tables(
        nodes, bias, scale, asymmetry, misalignment, tuple(extra.values()), 0.0 if smooth else REACH_K
    )


_Smooth = Mapping[tuple[str, str], SmoothTable]


def _grids(fit: Estimate, smooth: _Smooth) -> Iterator[Array]:
    """The nodes of a channel's tables; beside smooth ones also the places where those of lines end."""
    for c in fit.model.carried:
        one = smooth.get((c.effect.name, AXES[fit.model.channel]))
        if one is not None:
            yield one.temperature_degc
        elif c.nodes is not None:
            yield np.array([c.nodes[0] - REACH_K, *c.nodes, c.nodes[-1] + REACH_K]) if smooth else c.nodes


def _union(several: Sequence[Array]) -> Array:
    """All nodes, without those closer than a millikelvin to another; one at 20 degC when there is none."""
    if not several:
        return np.array([20.0])
    nodes = np.unique(np.concatenate(several))
    return np.asarray(nodes[np.append(True, np.diff(nodes) > 1e-3)])


def _table(fit: Estimate, effect: str, smooth: _Smooth, nodes: Array) -> Array:
    one = smooth.get((effect, AXES[fit.model.channel]))
    if one is not None:
        return np.asarray(hats(nodes, one.temperature_degc, 0.0) @ one.value)
    own = fit.model.nodes_of(effect)
    values = np.array(
        [
            v
            for c, v in zip(fit.model.columns(), fit.theta, strict=True)
            if c.effect == effect and not c.parameter
        ]
    )
    if len(values) == 0:
        return np.zeros(len(nodes))
    if own is None or len(own) == 1:
        return np.full(len(nodes), values[0])
    return np.asarray(hats(nodes, own, REACH_K) @ values)


def _parameters(fit: Estimate) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    for effect, parameter in fit.model.held:
        found.setdefault(effect, {})[parameter] = catalog.effects()[effect].nonlinear[parameter]
    for effect, values in fit.model.parameters_at(fit.theta).items():
        found.setdefault(effect, {}).update(values)
    return found


# ---------------------------------------------------------------- random characteristics


def random_of(fit: Estimate, spec: Spec) -> list[RandomCharacteristic]:
    """The spreads of one channel, from the variances with χ² intervals."""
    found = []
    variances = fit.variances
    duration = fit.noise.duration
    for i, component in enumerate(fit.noise.components):
        theta, error = float(variances.theta[i]), float(variances.error[i, i])
        freedom = 2.0 * theta * theta / error if error > 0 else float("nan")
        kinds: list[tuple[str, float]] = [(component.kind, 1.0)]
        if component.kind == "white":
            kinds.append(("white_density", duration))
        for kind, factor in kinds:
            found.append(_characteristic(fit, spec, component, kind, theta * factor, freedom))
    return found


def _characteristic(
    fit: Estimate, spec: Spec, component: Component, kind: str, variance: float, freedom: float
) -> RandomCharacteristic:
    low, high = float("nan"), float("nan")
    if freedom >= 1.0:  # below, the data say next to nothing of this spread
        low, high = (
            float(np.sqrt(variance * freedom / chi_square_quantile(q, freedom))) for q in (0.975, 0.025)
        )
    unit = own_unit(spec, fit.model.sensor, component.error.effect)
    return RandomCharacteristic(
        kind={"constant": "in_run"}.get(kind, kind),
        error=component.error,
        channel=AXES[fit.model.channel],
        unit=unit + " s^(1/2)" if kind == "white_density" else unit,
        value=float(np.sqrt(variance)),
        low=low,
        high=high,
        freedom=freedom,
        measured=not (fit.noise.known and kind == "run_to_run"),
    )
