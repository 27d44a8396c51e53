"""What the data say of the spreads that the spec assumes: run-to-run, in-run, between temperature points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from planner import catalog
from planner.diagnose.hypotheses.beside_budgets import like_in_run, like_level, like_scale_factor
from planner.diagnose.hypotheses.noise import IN_RUN, LEVEL, ChannelNoise
from planner.diagnose.hypotheses.prepared import Prepared
from planner.diagnose.hypotheses.sensor import SensorFound
from planner.diagnose.hypotheses.wander import wander
from planner.diagnose.hypotheses.whitened import Whitened
from planner.nouns.array import Array
from planner.nouns.diagnosis import Assumption, BudgetExceeded
from planner.solvers.distributions import chi_square_quantile, chi_square_tail
from planner.solvers.least_squares import least_squares
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec
from planner.spec.own_units import budget_unit

PARTS = (
    (("run_to_run_bias",), "bias", "run_to_run"),
    (("constant", IN_RUN), "bias", "in_run"),
    (("run_to_run_scale_factor",), "scale_factor", "run_to_run"),
)
EXCEEDED = 0.01  # chance that a unit within all its budgets is said to exceed one
KNOWN = 1.0  # relative standard error of a variance above which the data say nothing of it


def exceeded(every: Sequence[Assumption]) -> tuple[BudgetExceeded, ...]:
    """The spreads that are larger than the spec's budget, by one-sided tests of all of them together."""
    tested = [
        a
        for a in every
        if a.part in ("run_to_run", "in_run") and a.assumed is not None and math.isfinite(a.measured)
    ]
    out = []
    for a in tested:
        budget = a.assumed or 0.0
        square = a.freedom * (a.measured / budget) ** 2 if budget > 0.0 else np.inf
        chance = float(chi_square_tail(square, a.freedom))
        if a.low > budget and chance < EXCEEDED / len(tested):
            out.append(BudgetExceeded(a.error, a.part, a.measured, a.low, a.high, budget, a.unit, a.channel))
    return tuple(out)


def assumptions(s: SensorFound, spec: Spec, data: Prepared) -> list[Assumption]:
    """One entry a channel and part that the spec budgets; one for the triad where it shares a variance."""
    budgets: Mapping[str, ErrorBudget] = getattr(spec.unit, s.sensor)
    found = []
    for w in s.found.pool.state.values():
        noise = _noise(s, w, budgets, data)
        for components, error, part in PARTS:
            here = [noise.components.index(c) for c in components if c in noise.components]
            if LEVEL in components and error in budgets and _alone(data):
                found += _between_records(s, w, budgets[error], data)
            elif error in budgets and here:
                size = _sum(noise, here)
                if size[1] >= KNOWN and noise is not w.noise and part != "in_run":
                    size = _sum(w.noise, here)  # which the triad may tell
                apart = _apart(s, budgets, noise, data, error, part)
                one = _spread(s, w.channel.name, size, error, part, budgets[error], apart)
                found.append(_unbudgeted(one) if IN_RUN in noise.components and part == "in_run" else one)
    found = _of_the_triad(found)
    found += list(_residuals(s, budgets))
    return found


def _of_the_triad(found: Sequence[Assumption]) -> list[Assumption]:
    """One entry for what the channels were found to have in common: a variance that few runs tell."""
    groups: dict[tuple[str, str, float, float], list[Assumption]] = {}
    for a in found:
        groups.setdefault((a.error, a.part, a.measured, a.freedom), []).append(a)
    return [
        several[0] if len(several) == 1 else replace(several[0], channel="") for several in groups.values()
    ]


def _apart(
    s: SensorFound,
    budgets: Mapping[str, ErrorBudget],
    noise: ChannelNoise,
    data: Prepared,
    error: str,
    part: str,
) -> float:
    """What else the budgets let differ and a spread would hold, on the channel that has most of it."""
    if error == "scale_factor":
        drawn = max(like_scale_factor(c, data.starts, budgets) for c in s.channels)
        return float(np.hypot(_wander(s, budgets, noise), drawn))
    if part == "in_run":
        return max(like_in_run(c, data.starts, budgets) for c in s.channels)
    told = error != "bias" or IN_RUN in noise.components
    return 0.0 if told else like_level(data.table.time_on, data.starts, budgets[error])


def _wander(s: SensorFound, budgets: Mapping[str, ErrorBudget], noise: ChannelNoise) -> float:
    """What the budgets let wander within a power-on and the noise model counts as the scale factor's spread.

    The scale factor's own in-run, and the bias' over the largest input, or what it was found to be where that
    is more: 0.5 mg among six faces looks like 0.02 % of 1 g that changes from power-on to power-on.
    """
    bias = budgets["bias"].in_run_sigma if "bias" in budgets else 0.0
    if IN_RUN in noise.components:
        bias = max(bias, float(np.sqrt(noise.variances.theta[noise.components.index(IN_RUN)])))
    largest = max(float(np.abs(c.u).max(initial=0.0)) for c in s.channels)
    return float(np.hypot(budgets["scale_factor"].in_run_sigma, bias / largest if largest > 0.0 else 0.0))


def _noise(s: SensorFound, w: Whitened, budgets: Mapping[str, ErrorBudget], data: Prepared) -> ChannelNoise:
    """A channel's noise, with what moves within its power-ons where the rows show that something does."""
    if "bias" not in budgets:
        return w.noise
    pool, axis = s.found.pool, w.channel.axis
    mine = [pool.blocks[b].columns[axis] for b in s.found.all if axis in pool.blocks[b].columns]
    believed = np.column_stack([np.empty((len(w.z), 0)), *mine])
    return wander(w, believed, data.table.time_on, budgets["bias"].in_run_time) or w.noise


def _unbudgeted(a: Assumption) -> Assumption:
    """A process that the rows show and the spec does not budget is one that it has none of."""
    return replace(a, assumed=0.0) if a.assumed is None else a


def _sum(noise: ChannelNoise, components: Sequence[int]) -> tuple[float, float]:
    """Of some of the variances, and its own variance over its square: inf of one that came out zero."""
    theta = float(noise.variances.theta[components].sum())
    error = float(noise.variances.error[np.ix_(components, components)].sum())
    return theta, error / theta**2 if theta > 0.0 else np.inf


def _spread(
    s: SensorFound,
    channel: str,
    variance: tuple[float, float],
    error: str,
    part: str,
    budget: ErrorBudget,
    wander: float,
) -> Assumption:
    """√(θ − wander²) with the interval of a χ² of Satterthwaite's freedom, 2 θ² / var θ.

    Up to its high end it may all be of the part, should nothing wander. variance: θ and var θ / θ²
    """
    theta, relative = variance
    freedom = 2.0 / relative if relative > 0 else np.inf
    low = high = measured = float("nan")
    if relative < KNOWN:
        low, high = (
            float(np.sqrt(theta * freedom / chi_square_quantile(p, freedom))) for p in (0.975, 0.025)
        )
        low = float(np.sqrt(max(low**2 - wander**2, 0.0)))
        net = max(theta - wander**2, 0.0)
        measured, freedom = float(np.sqrt(net)), freedom * (net / theta) ** 2
    return Assumption(
        error=f"{s.sensor}.{error}",
        part=part,
        unit=_unit(s, error, budget),
        assumed=_assumed(budget, part),
        measured=measured,
        low=low,
        high=high,
        freedom=float(freedom),
        channel=channel,
    )


def _alone(data: Prepared) -> bool:
    """Whether every power-on is one record: only what varies within it tells its noise from its level."""
    return len(data.starts) == len(data.table)


def _between_records(s: SensorFound, w: Whitened, budget: ErrorBudget, data: Prepared) -> list[Assumption]:
    """Level of one-record power-ons: their variance less what white noise leaves of a mean of n samples.

    σ_level² = s² − mean(s_within² / n),    s² ~ χ² of the records' degrees of freedom
    """
    table = data.table
    within = table.gyro_std if s.sensor == "gyro" else table.acc_std
    if within is None or table.n_samples is None:
        return []
    white = float(np.mean(within[:, w.channel.axis] ** 2 / np.maximum(table.n_samples, 1)))
    left = w.z * w.noise.spread
    freedom = float(len(left) - w.Q.shape[1])
    if freedom < 1.0 or not np.isfinite(white):
        return []
    total = float(left @ left) / freedom
    ends = [
        max(total * freedom / float(chi_square_quantile(p, freedom)) - white, 0.0) for p in (0.975, 0.025)
    ]
    measured = float(np.sqrt(max(total - white, 0.0)))
    low, high = (float(np.sqrt(x)) for x in ends)
    assumed = _assumed(budget, "run_to_run")
    unit, name = _unit(s, "bias", budget), w.channel.name
    return [Assumption(f"{s.sensor}.bias", "run_to_run", unit, assumed, measured, low, high, freedom, name)]


def _unit(s: SensorFound, error: str, budget: ErrorBudget) -> str:
    """The unit of an error's budget; a bare number is read as a share."""
    unit = budget_unit(budget, catalog.effects()[error].units[s.sensor])
    return "%" if unit == "1" else unit


def _assumed(budget: ErrorBudget, part: str) -> float | None:
    """The spread that the spec gives, SI; of a table over temperature its root mean square."""
    if getattr(budget, part) is None:
        return None
    if part == "in_run":
        return budget.in_run_sigma
    table = budget.run_to_run_table
    if table is None:
        return budget.run_to_run_largest
    return float(np.sqrt(np.mean([sigma**2 for sigma in table.values()])))


# ---------------------------------------------------------------- between the temperature points


def _residuals(s: SensorFound, budgets: Mapping[str, ErrorBudget]) -> Iterator[Assumption]:
    """What straight lines between every second node miss at the others: the residual of half the points."""
    budget = budgets.get("bias")
    residual = None if budget is None else budget.residual_table
    if budget is None or residual is None:
        return
    nodes = s.channels[0].model.nodes_of("bias")
    if nodes is None or len(nodes) < 5:
        return
    tables = [_bias_table(s, axis) for axis in s.found.pool.state]
    inner = np.arange(1, len(nodes) - 1, 2)
    kept = np.setdiff1d(np.arange(len(nodes)), inner)
    missed = np.concatenate([t[inner] - np.interp(nodes[inner], nodes[kept], t[kept]) for t in tables])
    freedom = len(missed)
    square = float(np.mean(missed**2))
    points = sorted(residual)
    assumed = float(np.interp(len(kept), points, [residual[p] for p in points]))
    low, high = (float(np.sqrt(square * freedom / chi_square_quantile(p, freedom))) for p in (0.975, 0.025))
    yield Assumption(
        f"{s.sensor}.bias",
        f"temperature_residual at {len(kept)} points",
        _unit(s, "bias", budget),
        assumed,
        float(np.sqrt(square)),
        low,
        high,
        float(freedom),
    )


def _bias_table(s: SensorFound, axis: int) -> Array:
    """(N,) the bias at the nodes by generalised least squares."""
    w = s.found.pool.state[axis]
    c = w.channel
    white = w.noise.whiten(np.column_stack([c.J, c.r]))
    step, _ = least_squares(white[:, :-1], white[:, -1], 1e-9)
    place = [i for i, column in enumerate(c.model.columns()) if column.effect == "bias"]
    return np.asarray(c.theta[place] + step[place])
