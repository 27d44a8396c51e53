"""A scale factor that all channels of a sensor have in common: the sensor's own, or that of its reference.

    κ_i = c_i + γ,   c_i uniform within the spec's `systematic` ± s,   γ what the reference is off by

κ_i the channel's scale factor over temperature. Where no second reference acts (no centrifuge beside gravity,
no rate but the table's) no record tells γ from a part that the c_i share. It is said where the budget does
not have it: the mean of n channels is larger than that of n uniform sizes (Irwin, Hall, 1927) and of what the
records leave of it, normal, is once in a thousand, and with one γ taken off all of them lie within the budget
again,

    max (κ − 1.96 σ) − s <= γ <= min (κ + 1.96 σ) + s.

Where that has γ = 0 every channel may be within its budget, and nothing is said of three that are large
alike.
κ and σ are of the declared model with every other error as large as its budget (`scale_factors`): on a table
|f| is 1 g in every turn, a scale factor over acceleration is the scale factor over again, and free of any
budget the two made κ −1.2 % where it was −0.3 %.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import comb, factorial

import numpy as np

from planner.diagnose.channels.channel import Channel, declared_columns
from planner.diagnose.hypotheses.found import ALPHA_REFERENCE
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.noise.whitened import Whitened
from planner.diagnose.references.references import REFERENCES
from planner.diagnose.search.sensor import SensorFound
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect, Untestable
from planner.solvers.distributions import TWO_SIDED, chi_square_tail
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec

TOLD = 5.0  # sigma at which the records would have shown γ as the reference's, and have not
COARSE = 2e-4  # one sigma of γ: TOLD of it are the 0.1 % by which standard gravity misses a local one
LARGE = 0.01  # of γ: what records tell no better, they do not tell
ERROR = "scale_factor"


def common_scale(s: SensorFound, spec: Spec) -> ReferenceSuspect | None:
    """The reference that may be off by what all channels have in common beyond the spec's budget."""
    budget: ErrorBudget | None = getattr(spec.unit, s.sensor).get(ERROR)
    block = _block(s)
    if block is None or budget is None or budget.systematic_size <= 0.0:
        return None
    kappa, sigma = scale_factors(s, getattr(spec.unit, s.sensor))
    if len(kappa) < len(AXES):
        return None
    size = as_large(budget)
    mean, of_mean = float(kappa.mean()), float(np.linalg.norm(sigma)) / len(sigma)
    low = float((kappa - TWO_SIDED * sigma).max()) - size
    high = float((kappa + TWO_SIDED * sigma).min()) + size
    p = uniform_mean_tail(abs(mean) / size, len(kappa), of_mean / size)
    if p >= ALPHA_REFERENCE or low > high or low <= 0.0 <= high or abs(mean) > TOLD * _known_to(s, block):
        return None
    r, stated = REFERENCES[s.found.pool.blocks[block].name], s.found.pool.blocks[block].stated
    least = min(abs(low), abs(high))
    return ReferenceSuspect(
        hypothesis=r.name,
        value=min(max(mean, low), high),
        low=low,
        high=high,
        unit=r.unit,
        channels=tuple(c.name for c in s.channels),
        p_value=p,
        strength=abs(mean) / float(np.hypot(size / np.sqrt(3.0 * len(kappa)), of_mean)),
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
    if block is None or not any(_declared(c) for c in s.channels) or known < COARSE:
        return None
    r = REFERENCES[s.found.pool.blocks[block].name]
    here = "here" if TOLD * known > LARGE else f"up to {100.0 * TOLD * known:.2g} % here"
    why = f"one with a scale factor common to the {s.sensor}s {here}: {r.record} would tell"
    return Untestable(r.name, s.sensor, why)


def uniform_mean_tail(x: float, n: int, sigma: float = 0.0) -> float:
    """P(|mean of n + e| >= x), numbers uniform within ± 1 (Irwin and Hall's law), e normal of `sigma`."""
    z = np.linspace(-6.0, 6.0, 481) if sigma > 0.0 else np.zeros(1)
    weight = np.exp(-0.5 * z**2)
    beyond = np.array([_upper_tail(x - sigma * one, n) for one in z.tolist()])
    return float(min(2.0 * (weight @ beyond) / weight.sum(), 1.0))


def _upper_tail(x: float, n: int) -> float:
    """P(mean of n >= x) of numbers uniform within ± 1."""
    left = n * (1.0 - min(abs(x), 1.0)) / 2.0  # the sum of n in 0 … 1 is this far from its end
    inside = float(sum((-1) ** k * comb(n, k) * max(left - k, 0.0) ** n for k in range(n + 1))) / factorial(n)
    return inside if x >= 0.0 else 1.0 - inside


def as_large(budget: ErrorBudget) -> float:
    """The largest that an error can be at any temperature, SI."""
    return budget.systematic_size + max((budget.residual_table or {}).values(), default=0.0)


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


def scale_factors(s: SensorFound, budgets: Mapping[str, ErrorBudget]) -> tuple[Array, Array]:
    """κ and σ (channels,) of declared scale factors over temperature; none where one is not declared.

        β̂ = (XᵀV⁻¹X + Λ)⁻¹ XᵀV⁻¹y,   κ = Σ_k β̂_k / σ_k² : Σ_k 1 / σ_k²,   k the nodes of the table

    (Lindley, Smith, J. R. Stat. Soc. B 34, 1972, 1). Λ has the budgets of all other errors and the steepest
    slopes of the tables; of what has no budget, and of κ, that it adds no more than the largest reading.
    """
    each = [_scale_factor(w, budgets) for w in s.found.pool.state.values() if _declared(w.channel)]
    return np.array([k for k, _ in each]), np.array([sigma for _, sigma in each])


def _scale_factor(w: Whitened, budgets: Mapping[str, ErrorBudget]) -> tuple[float, float]:
    c, noise = w.channel, w.noise
    names = _declared_names(c)
    X = np.column_stack([c.J, noise.fixed_runs])
    theta = np.zeros(X.shape[1])
    theta[: len(names)] = c.theta[declared_columns(c.model, c.found)]
    reach = np.abs(X).max(axis=0)
    moves = reach > 0.0
    sigma = np.abs(c.y).max() / np.where(moves, reach, 1.0)
    sigma[: len(c.most)] = np.where(np.isfinite(c.most), c.most, sigma[: len(c.most)])
    for k, name in enumerate(names):
        budget = budgets.get(name)
        if name != ERROR and budget is not None and budget.systematic_size > 0.0:
            sigma[k] = as_large(budget)
    moves &= sigma > 0.0
    white = noise.whiten(np.column_stack([c.r + X @ theta, X]))
    scaled = white[:, 1:][:, moves] * sigma[moves]  # by their prior sigmas: Λ is one
    more = max(0, scaled.shape[1] - len(scaled))  # rows of nothing: every direction has a size then
    U, size, Vt = np.linalg.svd(np.pad(scaled, ((0, more), (0, 0))), full_matrices=False)
    beta = (Vt.T * (size / (1.0 + size**2))) @ (U.T @ np.pad(white[:, 0], (0, more))) * sigma[moves]
    own = np.flatnonzero(moves)[np.flatnonzero(moves) < len(names)]
    nodes = np.flatnonzero(np.array([names[k] for k in own], dtype=object) == ERROR)
    at = sigma[own[nodes]]
    covariance = (Vt[:, nodes].T / (1.0 + size**2)) @ Vt[:, nodes] * at[:, None] * at
    weight = 1.0 / np.diag(covariance)
    weight /= weight.sum()
    return float(weight @ beta[nodes]), float(np.sqrt(weight @ covariance @ weight))


def _declared(c: Channel) -> bool:
    """Whether a channel's scale factor is declared."""
    return ERROR in _declared_names(c)


def _declared_names(c: Channel) -> list[str]:
    """The effects of the first columns of J."""
    every = c.model.columns()
    return [every[i].effect for i in declared_columns(c.model, c.found)]
