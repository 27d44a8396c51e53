"""A diagnosis made by hand: what the engine would hand on for a campaign whose hidden effect is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner import catalog
from planner.diagnose.diagnosis_to_residual import UnitFits, unit_fits
from planner.nouns.diagnosis import Evidence, FoundEffect, FoundTerm, UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.spec.model import Spec


def found_effect(
    effect: str, channel: str, value: float, half: float, nonlinear: dict[str, float] | None = None
) -> FoundEffect:
    """An effect on one channel; every term of that channel has the value, SI, known to ± half."""
    sensor = "gyro" if channel.startswith("gyro") else "accelerometer"
    known = catalog.effects()[effect]
    terms = [t.name for t in known.terms(sensor) if t.name[0] == channel[-1]]
    return FoundEffect(
        effect=effect,
        sensor=sensor,
        channels=(channel,),
        terms=tuple(
            FoundTerm(name, channel, value, value - half, value + half, 60.0, known.units[sensor])
            for name in terms
        ),
        p_value=0.001,
        strength=20.0,
        nonlinear=nonlinear or {},
    )


def unit_diagnosis(table: DwellTable, spec: Spec, effects: Sequence[FoundEffect] = ()) -> UnitDiagnosis:
    """The hand-made answer with evidence of the fits: estimates in place of the values that were given."""
    bare = UnitDiagnosis(
        str(table.unit[0]), "explained" if effects else "clean", tuple(effects), (), (), (), (), ()
    )
    fits = unit_fits(table, spec, bare)
    order = np.argsort(np.lexsort((table.time_on, table.run)))
    evidence = tuple(_evidence(c, order) for c in fits.channels)
    found = tuple(_estimated(e, fits) for e in effects)
    return UnitDiagnosis(bare.unit, bare.verdict, found, (), (), (), evidence, ())


def _evidence(c, order) -> Evidence:
    expected = np.sqrt(c.after.spreads.run**2 + c.after.v.diagonal)
    shared = np.full((1, len(order)), c.after.spreads.run)
    added = {e.effect: np.column_stack([_part(c, e), c.after.residual + _part(c, e)])[order] for e in c.found}
    before, after = c.before.residual[order], c.after.residual[order]
    return Evidence(c.channel, before, after, expected[order], added, shared)


def _columns(c, effect: str) -> list[int]:
    return [
        i
        for i, column in enumerate(c.after.model.columns())
        if column.effect == effect and not column.parameter
    ]


def _part(c, found: FoundEffect) -> np.ndarray:
    k = _columns(c, found.effect)
    return c.after.J[:, k] @ c.after.theta[k]


def _estimated(found: FoundEffect, fits: UnitFits) -> FoundEffect:
    (c,) = [c for c in fits.channels if c.channel == found.channels[0]]
    white = c.after.v.whiten(c.after.J)
    covariance = np.linalg.pinv(white.T @ white)
    terms = []
    for term, k in zip(found.terms, _columns(c, found.effect), strict=True):
        value, half = float(c.after.theta[k]), 2.0 * float(np.sqrt(covariance[k, k]))
        terms.append(FoundTerm(term.name, term.channel, value, value - half, value + half, 60.0, term.unit))
    return FoundEffect(
        found.effect, found.sensor, found.channels, tuple(terms), found.p_value, found.strength,
        found.rivals, found.below_bench_uncertainty, found.nonlinear,
    )  # fmt: skip
