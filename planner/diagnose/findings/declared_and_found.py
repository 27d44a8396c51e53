"""The last word on what a diagnosis found: the declared model and the found effects, as calibrate fits them.

    y = (1 + κ)(M u) + b,   declared and found effects alike in κ, M and b; variances by REML

The search weighs candidates beside generic alternatives and free slopes; the sizes that it reports are those
that `planner calibrate` gives for the spec with the found effects declared, on the same rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner import catalog
from planner.calibrate.dwells_to_fit import fit_sensor
from planner.calibrate.fit_to_calibration import CONFIDENCE, coefficients_of
from planner.campaign.estimate import Estimate, solved
from planner.campaign.noise import spec_variances
from planner.dwells.table_rows import by_run
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.calibration import Coefficient
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Effect, Sensor
from planner.solvers.distributions import student_quantile
from planner.solvers.mixed_model import MixedFit
from planner.spec.model import Spec

WIDE = 3.0  # times its budget that a unit may draw: as far outside of its data sheet it is calibrated rightly
FEW = 8.0  # degrees of freedom, below which two estimates of one variance may differ by its own size
_APART = 1e-9  # of the largest correlation of coefficients, below which they are one


@dataclass(frozen=True)
class Together:
    """Coefficients γ (k,) of one effect against nothing: square γᵀ Φ⁺ γ, of rank and freedom (Wald's F).

    each: t² and freedom of every one of them alone, beside the others
    budgeted: the same square where every power-on draws, and lets wander, WIDE times its budget at least and
        what the records show of it; 0 where that is not asked (`_as_wide`)
    """

    square: float
    rank: int
    freedom: float
    each: tuple[tuple[float, float], ...] = ()
    budgeted: float = 0.0


@dataclass(frozen=True)
class ChannelEstimates:
    """What calibrate says of the found effects on one channel.

    terms: (effect, term) -> its coefficient; parameters: (effect, parameter) -> its estimate, without those
    that the data do not tell, which are held at their defaults; notes: of the fit, sentences
    together: effect -> all its coefficients against nothing, of one without parameters and without a table
    """

    terms: Mapping[tuple[str, str], Coefficient]
    parameters: Mapping[tuple[str, str], Coefficient]
    notes: tuple[str, ...]
    together: Mapping[str, Together] = field(default_factory=dict)

    def nonlinear(self, effect: Effect) -> dict[str, float]:
        """The effect's parameters, at their estimates or held at their defaults."""
        told = {name: c.value for (e, name), c in self.parameters.items() if e == effect.name}
        return {**effect.nonlinear, **told}


def declared_and_found(
    table: DwellTable, spec: Spec, sensor: Sensor, found: Sequence[str], channels: Sequence[int]
) -> dict[int, ChannelEstimates]:
    """Channel -> estimates, from a table with references: of the channels asked for, or of all that share.

    found: names of the effects that the whole diagnosis found, of either sensor: a spec that declares them
        declares them for both. Raises InputError for fewer rows than coefficients.
    """
    ordered, _ = by_run(table)
    fits = fit_sensor(ordered, sensor, spec, effects=(*spec.effects, *found), channels=channels)
    return {fit.model.channel: _of_channel(fit, spec, found) for fit in fits}


def _of_channel(fit: Estimate, spec: Spec, found: Sequence[str]) -> ChannelEstimates:
    known = catalog.effects()
    terms: dict[tuple[str, str], Coefficient] = {}
    parameters: dict[tuple[str, str], Coefficient] = {}
    for c, column in zip(coefficients_of(fit, spec), fit.model.columns(), strict=True):
        if column.effect in found and c.temperature_degc is None:
            (parameters if column.parameter else terms)[column.effect, c.term] = c
    for name in found:
        if known[name].tabled and fit.model.sensor in known[name].sensors:
            terms |= {(name, c.term): c for c in _mean_slopes(fit, known[name])}
    together = {name: told for name in found if (told := _together(fit, spec, name)) is not None}
    return ChannelEstimates(terms, parameters, tuple(fit.notes), together)


def _together(fit: Estimate, spec: Spec, effect: str) -> Together | None:
    """All coefficients of an effect that the data determine; None where a parameter goes with their size.

    The freedom is that of the least known one.
    """
    mine = [
        i
        for i, c in enumerate(fit.model.columns())
        if c.effect == effect and np.isnan(c.node_degc) and not fit.fit.undetermined[i]
    ]
    if catalog.effects()[effect].parameters or not mine:
        return None
    told = _square(fit.fit, fit.theta, mine)
    if told is None:
        return None
    square, rank, alone = told
    freedom = fit.fit.freedom[mine]
    each = tuple(zip(alone.tolist(), freedom.tolist(), strict=True))
    least = float(np.min(freedom))
    return Together(square, rank, least, each, _as_wide(fit, spec, mine) if least < FEW else 0.0)


def _square(fit: MixedFit, theta: Array, mine: list[int]) -> tuple[float, int, Array] | None:
    """γᵀ Φ⁺ γ of some coefficients, its rank, and t² (k,) of each; None where one has no error."""
    error = np.sqrt(np.maximum(np.diag(fit.covariance)[mine], 0.0))
    if not error.all():
        return None
    correlation = fit.covariance[np.ix_(mine, mine)] / np.outer(error, error)
    inverse = np.linalg.pinv(correlation, rcond=_APART, hermitian=True)
    size = theta[mine] / error
    rank = int(np.linalg.matrix_rank(correlation, tol=_APART, hermitian=True))
    return float(size @ inverse @ size), rank, np.square(size)


def _as_wide(fit: Estimate, spec: Spec, mine: list[int]) -> float:
    """The square where power-ons differ by WIDE times what the spec lets them, or by more if they show it.

    Two power-ons on either side of an arm tell the spread of a scale factor by one degree of freedom: among a
    hundred names 71 sigma were then no surer than chance, though the budget would have to be exceeded twenty
    times. 0 where the spec says nothing of some spread: the records are all there is to know it by.
    """
    drawn = np.array([c.kind in ("run_to_run", "in_run") for c in fit.noise.components])
    said = spec_variances(fit.noise, spec.unit).theta
    if not np.all(said[drawn] > 0.0):
        return 0.0
    theta = np.where(drawn, np.maximum(fit.variances.theta, WIDE**2 * said), fit.variances.theta)
    wide = replace(fit.variances, theta=theta, error=np.zeros_like(fit.variances.error))
    again = solved(fit.residual + fit.J @ fit.theta, fit.J, fit.prior, fit.noise, wide)
    told = _square(again, again.coefficients, mine)
    return 0.0 if told is None else told[0]


def _mean_slopes(fit: Estimate, effect: Effect) -> list[Coefficient]:
    """Of an effect that a table carries: the straight line through what the table adds to the rows.

        s = l θ,   l the second row of [c₀, c₁]⁺ C,   var s = l Φ lᵀ

    with C (n, N) the table's columns, c₀ their sum, c₁ the effect's own column; as many degrees of freedom as
    the least known node has. None for a table of one node.
    """
    found = []
    for k, term in enumerate(effect.terms(fit.model.sensor)):
        nodes = [
            i
            for i, c in enumerate(fit.model.columns())
            if (c.effect, c.term) == (effect.temperature_of, term.name) and np.isfinite(c.node_degc)
        ]
        if len(nodes) < 2:
            continue
        table = fit.J[:, nodes]
        own = effect.regressors(fit.model.sensor, fit.model.conditions)[:, fit.model.channel, k]
        line = np.linalg.pinv(np.column_stack([table.sum(axis=1), own])) @ table
        slope = float(line[1] @ fit.theta[nodes])
        error = float(np.sqrt(max(line[1] @ fit.fit.covariance[np.ix_(nodes, nodes)] @ line[1], 0.0)))
        freedom = float(np.min(fit.fit.freedom[nodes]))
        half = float(student_quantile((1.0 + CONFIDENCE) / 2.0, freedom)) * error
        if fit.fit.undetermined[nodes].any():
            half = float("inf")
        found.append(
            Coefficient(
                error=f"{fit.model.sensor}.{effect.name}",
                channel=AXES[fit.model.channel],
                term=term.name,
                temperature_degc=None,
                unit=effect.units[fit.model.sensor],
                value=slope,
                standard_error=error,
                freedom=freedom,
                low=slope - half,
                high=slope + half,
                status="determined" if np.isfinite(half) else "undetermined",
            )
        )
    return found
