"""A scale factor that all channels of a sensor have in common: the sensor's own, or that of its reference.

    κ_i = c_i + γ,   c_i uniform within the spec's `systematic` ± s,   γ what the reference is off by

κ_i the channel's scale factor over temperature. Where no second reference acts (no centrifuge beside gravity,
no rate but the table's) no record tells γ from a part that the c_i share. It is said where the budget does
not have it: the mean of n channels is larger than that of n uniform sizes is once in a thousand (Irwin,
Hall, 1927), and with one γ taken off all of them lie within the budget again,

    max κ − s <= γ <= min κ + s.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb, factorial

import numpy as np

from planner.diagnose.hypotheses.found import ALPHA_REFERENCE
from planner.diagnose.hypotheses.references import REFERENCES
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.hypotheses.sensor import SensorFound
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect, Untestable
from planner.solvers.distributions import chi_square_tail
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec

TOLD = 5.0  # sigma at which the records would have shown γ as the reference's, and have not
COARSE = 2e-4  # one sigma of γ: TOLD of it are the 0.1 % by which standard gravity misses a local one
LARGE = 0.01  # of γ: what records tell no better, they do not tell
ERROR = "scale_factor"


def common_scale(s: SensorFound, spec: Spec) -> ReferenceSuspect | None:
    """The reference that may be off by what all channels have in common beyond the spec's budget."""
    budget: ErrorBudget | None = getattr(spec.unit, s.sensor).get(ERROR)
    block, kappa = _block(s), _scale_factors(s)
    if block is None or budget is None or budget.systematic_size <= 0.0 or len(kappa) < len(AXES):
        return None
    size = budget.systematic_size + max((budget.residual_table or {}).values(), default=0.0)
    mean, low, high = float(kappa.mean()), float(kappa.max()) - size, float(kappa.min()) + size
    p = uniform_mean_tail(abs(mean) / size, len(kappa))
    if p >= ALPHA_REFERENCE or low > high or abs(mean) > TOLD * _known_to(s, block):
        return None
    r, stated = REFERENCES[s.found.pool.blocks[block].name], s.found.pool.blocks[block].stated
    least = max(min(abs(low), abs(high)), 0.0) if low * high > 0.0 else 0.0
    return ReferenceSuspect(
        hypothesis=r.name,
        value=mean,
        low=low,
        high=high,
        unit=r.unit,
        channels=tuple(f"{s.sensor}_{AXES[c.axis]}" for c in s.channels),
        p_value=p,
        strength=abs(mean) / (size / np.sqrt(3.0 * len(kappa))),
        check=r.check,
        separated_by=0.0,
        alias=r.alias,
        record=r.record,
        stated=stated,
        chance=float(chi_square_tail((least / stated) ** 2, 1)) if stated > 0.0 else 1.0,
    )


def untold_scale(s: SensorFound) -> Untestable | None:
    """That these records do not tell the reference from a common scale factor, and which would."""
    block = _block(s)
    known = np.inf if block is None else _known_to(s, block)
    if block is None or not len(_scale_factors(s)) or known < COARSE:
        return None
    r = REFERENCES[s.found.pool.blocks[block].name]
    here = "here" if TOLD * known > LARGE else f"up to {100.0 * TOLD * known:.2g} % here"
    why = f"one with a scale factor common to the {s.sensor}s {here}: {r.record} would tell"
    return Untestable(r.name, s.sensor, why)


def uniform_mean_tail(x: float, n: int) -> float:
    """P(|mean of n| >= x) of numbers uniform within ± 1: both tails of Irwin and Hall's law."""
    left = n * (1.0 - min(x, 1.0)) / 2.0  # the sum of n in 0 … 1 is this far from its end
    inside = sum((-1) ** k * comb(n, k) * max(left - k, 0.0) ** n for k in range(n + 1))
    return float(min(max(2.0 * inside / factorial(n), 0.0), 1.0))


def _block(s: SensorFound) -> int | None:
    """The hypothesis about the reference that is one with a scale factor, unless it is believed."""
    blocks = s.found.pool.blocks
    mine = [i for i, b in enumerate(blocks) if b.reference and not b.place and _alias(b.name) == ERROR]
    believed = {blocks[i].name for i in s.found.library if blocks[i].reference}
    return mine[0] if mine and blocks[mine[0]].name not in believed else None


def _alias(name: str) -> str:
    return REFERENCES[name].alias


def _known_to(s: SensorFound, block: int) -> float:
    """One sigma of γ beside all that is declared and believed: no more than a second reference tells."""
    pool = s.found.pool
    if not score(s.found.without(block), [block]).m:
        return float("inf")
    (k,) = pool.places[block]
    left = float(s.found.without(block).grams(pool.places[block])[0, 0])
    return 1.0 / (float(pool.size[k]) * np.sqrt(left)) if left > 0.0 else float("inf")


def _scale_factors(s: SensorFound) -> Array:
    """(channels,) declared scale factors, each the mean over its nodes; none where it is not declared."""
    every: Sequence[Array] = [
        np.array([t for column, t in zip(c.model.columns(), c.theta, strict=True) if column.effect == ERROR])
        for c in s.channels
    ]
    return np.array([k.mean() for k in every if len(k)])
