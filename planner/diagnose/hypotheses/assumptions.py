"""What the data say of the spreads that the spec assumes: run-to-run, in-run, between temperature points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from planner import catalog
from planner.diagnose.hypotheses.sensor import SensorFound
from planner.diagnose.hypotheses.whitened import Whitened
from planner.nouns.array import Array
from planner.nouns.diagnosis import Assumption
from planner.solvers.least_squares import least_squares
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec

PARTS = (
    ("run_to_run_bias", "bias", "run_to_run"),
    ("constant", "bias", "in_run"),
    ("run_to_run_scale_factor", "scale_factor", "run_to_run"),
)
KNOWN = 1.0  # relative standard error of a variance above which the data say nothing of it


def assumptions(s: SensorFound, spec: Spec) -> list[Assumption]:
    """One entry a channel and part that the spec budgets."""
    budgets: Mapping[str, ErrorBudget] = getattr(spec.unit, s.sensor)
    found = []
    for w in s.found.pool.state.values():
        for component, error, part in PARTS:
            if error in budgets and component in w.noise.components:
                found.append(_spread(s, w, component, error, part, budgets[error]))
    found += list(_residuals(s, budgets))
    return found


def _spread(
    s: SensorFound, w: Whitened, component: str, error: str, part: str, budget: ErrorBudget
) -> Assumption:
    """√θ with the interval of a χ² of Satterthwaite's freedom, 2 θ² / var θ."""
    from scipy.stats import chi2

    k = w.noise.components.index(component)
    theta = float(w.noise.variances.theta[k])
    relative = float(w.noise.relative_error[k, k])
    freedom = 2.0 / relative if relative > 0 else np.inf
    low = high = measured = float("nan")
    if relative < KNOWN:
        measured = float(np.sqrt(theta))
        low, high = (float(np.sqrt(theta * freedom / chi2.ppf(p, freedom))) for p in (0.975, 0.025))
    return Assumption(
        error=f"{s.sensor}.{error}",
        part=part,
        unit=_unit(s, error),
        assumed=_assumed(budget, part),
        measured=measured,
        low=low,
        high=high,
        freedom=float(freedom),
        channel=w.channel.name,
    )


def _unit(s: SensorFound, error: str) -> str:
    """Display unit of an error; a bare number is read as a share."""
    unit = catalog.effects()[error].units[s.sensor]
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
    from scipy.stats import chi2

    budget = budgets.get("bias")
    residual = None if budget is None else budget.residual_table
    if residual is None:
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
    low, high = (float(np.sqrt(square * freedom / chi2.ppf(p, freedom))) for p in (0.975, 0.025))
    yield Assumption(
        f"{s.sensor}.bias",
        f"temperature_residual at {len(kept)} points",
        _unit(s, "bias"),
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
