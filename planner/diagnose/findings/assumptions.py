"""What the data say of the spreads that the spec assumes: run-to-run, in-run, between temperature points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner import catalog
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.noise.beside_budgets import Part, Seen, seen
from planner.diagnose.noise.channel_noise import LEAST_RUNS, ChannelNoise, Readings, channel_noise
from planner.diagnose.noise.components import IN_RUN, LEANS, LEVEL, drawn_name
from planner.diagnose.noise.outliers import FAR_WEIGHT
from planner.diagnose.noise.spread_law import SpreadLaw, errors, refused, spread_law
from planner.diagnose.noise.wander import CHANCE, wander
from planner.diagnose.noise.whitened import Whitened, moving
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array
from planner.nouns.diagnosed_spreads import BUDGETED, NOISE, WHITE_OF_1_S, Assumption, BudgetExceeded
from planner.solvers.distributions import chi_square_quantile
from planner.solvers.least_squares import least_squares
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec
from planner.spec.own_units import budget_unit

PARTS = (
    (("run_to_run_bias",), "bias", "run_to_run"),
    (("constant", IN_RUN), "bias", "in_run"),
    (("run_to_run_scale_factor",), "scale_factor", "run_to_run"),
    *(((drawn_name(LEANS, k),), LEANS, "run_to_run") for k in (1, 2)),
)
FEW_RUNS = 5  # power-ons, from which their spread is held against its budget; a search has it from eight on
EXCEEDED = 0.01  # chance that a unit within all its budgets is said to exceed one
OUTSIDE = 0.025  # chance beyond each end of an interval
WELL_KNOWN = 2.0 / 40.0  # relative variance of a variance, 40 degrees of freedom, below which any law will do
KNOWN = 1.0  # relative standard error of a variance above which the data say nothing of it


def exceeded(every: Sequence[Assumption]) -> tuple[BudgetExceeded, ...]:
    """The spreads that are larger than the spec's budget, by one-sided tests of all of them together.

    Of a sensor's white noise the noisiest, of a channel or of all: the spec has one density for them.
    """
    tested = [a for a in every if a.part in BUDGETED and a.assumed is not None and math.isfinite(a.measured)]
    found = [
        BudgetExceeded(a.error, a.part, a.measured, a.low, a.high, a.assumed or 0.0, a.unit, a.channel)
        for a in tested
        if a.low > (a.assumed or 0.0) and a.chance < EXCEEDED / len(tested)
    ]
    noisiest = {b.error: b for b in sorted(found, key=lambda b: b.measured) if b.part == WHITE_OF_1_S}
    return tuple(b for b in found if b.part != WHITE_OF_1_S or b is noisiest[b.error])


def assumptions(s: SensorFound, spec: Spec, data: Prepared) -> list[Assumption]:
    """One entry a channel and part that the spec budgets; one for the triad where it shares a variance."""
    budgets: Mapping[str, ErrorBudget] = getattr(spec.unit, s.sensor)
    shared: dict[tuple[str, str, str, float, float], list[_Told]] = {}
    found: list[Assumption] = []
    white: list[_Told] = []
    beside = _Beside(data.table.time_on, budgets)
    for w in s.found.pool.state.values():
        own = _noise(s, w, budgets, data)
        if "constant" in own.components and (level := _told(w, own, ("white",), "")):
            white.append(level)
        for components, error, part in PARTS:
            if LEVEL in components and error in budgets and _alone(data):
                found += _between_records(s, w, budgets[error], data)
            elif error in budgets and (told := _told(w, own, components, part)):
                # what the channels were found to have in common: a variance that few runs tell
                name = "" if told.relative < KNOWN else w.channel.name
                shared.setdefault((error, part, name, told.theta, told.relative), []).append(told)
    for (error, part, *_), several in shared.items():
        assumed, unit = _assumed(budgets[error], part), _unit(s, error, budgets[error])
        taken = beside.of(several, (error, part))
        one = _spread(several, Assumption(f"{s.sensor}.{error}", part, unit, assumed, *_UNTOLD), taken)
        found.append(_unbudgeted(one) if IN_RUN in several[0].noise.components and part == "in_run" else one)
    found = _larger_lean(found)
    found += [*_white(s, white, spec, beside, data), *_residuals(s, budgets)]
    return found


def _larger_lean(every: Sequence[Assumption]) -> list[Assumption]:
    """Of a channel's two misalignments the one that says more of their budget, which is one for both.

    With the chance that either says as much (Bonferroni).
    """
    leans: dict[str, list[Assumption]] = {}
    for a in every:
        if a.error.endswith(f".{LEANS}"):
            leans.setdefault(a.channel, []).append(a)
    most = {}
    for channel, both in leans.items():
        told = [a for a in both if math.isfinite(a.measured)]
        one = min(told or both, key=lambda a: a.chance)
        most[channel] = replace(one, chance=min(1.0, one.chance * max(len(told), 1)))
    return [*(a for a in every if not a.error.endswith(f".{LEANS}")), *most.values()]


@dataclass(frozen=True)
class _Told:
    """θ of some components (k,) of a channel's noise together, and var θ / θ²: inf of one that is zero."""

    w: Whitened
    noise: ChannelNoise
    components: tuple[int, ...]
    theta: float
    relative: float


def _told(w: Whitened, own: ChannelNoise, names: Sequence[str], part: str) -> _Told | None:
    """Of the components by these names, of a channel's own noise; None without any.

    What that does not tell the triad may.
    """
    here = [own.components.index(name) for name in names if name in own.components]
    if not here:
        return None
    seen_of = [k for k in here if own.variances.free[k]]  # what others came out as zero may be is none of it
    here = seen_of or here
    one = _Told(w, own, tuple(here), *_sum(own, here))
    common = w.noise.by_rows
    theirs = {name: k for k, name in enumerate(common.components)}
    there = tuple(theirs[own.components[k]] for k in here if own.components[k] in theirs)
    if one.relative >= KNOWN and own is not common and there and part != "in_run":
        return _Told(w, common, there, *_sum(common, there))
    return one


_UNTOLD = (float("nan"), float("nan"), float("nan"), 0.0)  # measured, low, high, freedom


class _Beside:
    """What the other budgets add to a variance; asked once of every noise."""

    def __init__(self, time_on: Array, budgets: Mapping[str, ErrorBudget]) -> None:
        self.time_on, self.budgets = time_on, budgets
        self.known: dict[int, Seen] = {}

    def of(self, several: Sequence[_Told], own: Part) -> float:
        """To a variance of several channels in common: each tells it as well as its own rows do."""
        if several[0].relative >= KNOWN:
            return 0.0  # of what is not told nothing is asked
        each = [self._seen(one).of(one.components, own) for one in several]
        weights = [1.0 / max(self._seen(one).error(one.components), 1e-300) for one in several]
        return float(np.average(each, weights=weights))

    def _seen(self, one: _Told) -> Seen:
        key = id(one.noise)
        if key not in self.known:
            self.known[key] = seen(one.noise, one.w.channel, self.time_on, self.budgets)
        return self.known[key]


def _noise(s: SensorFound, w: Whitened, budgets: Mapping[str, ErrorBudget], data: Prepared) -> ChannelNoise:
    """A channel's noise, with what moves within its power-ons where the rows show that something does.

    In the correlation time of the budget: sigma of 2000 s steps as far in a minute as half of it of 600 s.
    Of five to seven power-ons with misalignments of each: one that was mounted crooked by a degree, of two
    that were made alike, made both noise.
    """
    if "bias" not in budgets:
        return w.noise.by_rows
    pool, axis = s.found.pool, w.channel.axis
    mine = [pool.blocks[b].columns[axis] for b in s.found.all if axis in pool.blocks[b].columns]
    believed = np.column_stack([np.empty((len(w.z), 0)), *mine])
    if FEW_RUNS <= len(data.starts) < LEAST_RUNS:
        weights = np.where(s.far[axis], FAR_WEIGHT, 1.0)
        few = Readings(w.channel, data.starts, data.table.duration, (believed,), weights, FEW_RUNS)
        few = replace(few, moves=moving(w.channel, channel_noise(few)))  # as the search has them
        leans = budgets.get(LEANS)
        drawn = (LEANS,) if leans is not None and leans.has_run_to_run else ()
        return channel_noise(few.with_noise(drawn=drawn))
    most = 1.0 if IN_RUN in w.noise.components else CHANCE
    return wander(w, believed, data.table.time_on, budgets["bias"].in_run_time, most) or w.noise.by_rows


def _unbudgeted(a: Assumption) -> Assumption:
    """A process that the rows show and the spec does not budget is one that it has none of."""
    return replace(a, assumed=0.0) if a.assumed is None else a


def _sum(noise: ChannelNoise, components: Sequence[int]) -> tuple[float, float]:
    """Of some of the variances, and its own variance over its square: inf of one that came out zero.

    And of one whose parts rounding alone tells apart.
    """
    theta = float(noise.variances.theta[components].sum())
    error = float(noise.variances.error[np.ix_(components, components)].sum())
    return theta, error / theta**2 if theta > 0.0 and error > 0.0 else np.inf


def _spread(several: Sequence[_Told], asked: Assumption, beside: float) -> Assumption:
    """√(θ − w²) with its interval (`spread_law`), and Satterthwaite's freedom 2 θ² / var θ; beside: w².

    Up to its high end it may all be of the part, should the others have none of their budgets.
    """
    theta, relative = several[0].theta, several[0].relative
    freedom = 2.0 / relative
    assumed = asked.assumed
    low = high = measured = float("nan")
    chance = 1.0
    if relative < KNOWN:
        law = _law(several)
        low = float(np.sqrt(max(law.end(OUTSIDE) - beside, 0.0)))
        high = float(np.sqrt(law.end(1.0 - OUTSIDE)))
        budgeted = (assumed or 0.0) ** 2 + beside
        chance = law.tail(budgeted)
        if assumed is not None and low > assumed:
            chance = max(chance, refused([one.noise for one in several], several[0].components, budgeted))
            low = low if chance < OUTSIDE else assumed
        net = max(theta - beside, 0.0)
        measured, freedom = float(np.sqrt(net)), freedom * (net / theta) ** 2
    return replace(
        asked,
        measured=measured,
        low=low,
        high=high,
        freedom=float(freedom),
        channel=several[0].w.channel.name if len(several) == 1 else "",
        chance=chance,
    )


def _law(several: Sequence[_Told]) -> SpreadLaw:
    """Of a variance that some channels tell together; of one that is well known it needs no shift."""
    theta, error = several[0].theta, several[0].theta * np.sqrt(several[0].relative)
    if several[0].relative < WELL_KNOWN:
        return spread_law(theta, error, 0.5 * error)
    whole, half = np.sum([errors(one.noise, one.components) for one in several], axis=0)
    return spread_law(theta, error, error * float(half / whole) if whole > 0.0 else error)


def _white(
    s: SensorFound, told: Sequence[_Told], spec: Spec, beside: _Beside, data: Prepared
) -> Iterator[Assumption]:
    """Density of white noise where the spec has one, by channels and, of several, what they have in common.

    Records of one length say N²/t together with all that averaging does not lower, the thermometer's noise
    and the bench's: of them nothing is said, and there are no `told`.
    """
    assumed, budget = spec.unit.white(s.sensor), getattr(spec.unit, s.sensor).get("bias")
    if assumed == 0.0:
        return
    unit = str(catalog.effects()["bias"].units[s.sensor]) if budget is None else _unit(s, "bias", budget)
    root = float(np.sqrt(np.mean(np.where(data.table.duration > 0, data.table.duration, 1.0))))
    asked = Assumption(f"{s.sensor}.{NOISE}", WHITE_OF_1_S, unit, assumed / root, *_UNTOLD)
    known = [t for t in told if t.relative < KNOWN]
    for several in (*([t] for t in told), *([_common(known)] if len(known) > 1 else [])):
        one = _spread(several, asked, beside.of(several, (NOISE, WHITE_OF_1_S)))
        low, high = one.low * root, one.high * root  # θ is of a record of mean length
        yield replace(one, assumed=assumed, measured=one.measured * root, low=low, high=high)


def _common(each: Sequence[_Told]) -> list[_Told]:
    """What channels say of one variance: θ = Σ ν_i θ_i / Σ ν_i with its freedom Σ ν_i."""
    freedom = np.array([2.0 / t.relative for t in each])
    theta, relative = float(np.average([t.theta for t in each], weights=freedom)), 2.0 / float(freedom.sum())
    return [replace(t, noise=_with(t, theta), theta=theta, relative=relative) for t in each]


def _with(t: _Told, theta: float) -> ChannelNoise:
    """A channel's noise in which one component has another variance."""
    v = t.noise.variances
    return replace(
        t.noise,
        variances=replace(v, theta=np.where(np.arange(len(v.theta)) == t.components[0], theta, v.theta)),
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
    measured = float(np.sqrt(max(total - white, 0.0)))
    assumed = _assumed(budget, "run_to_run")
    law, unit, name = SpreadLaw(total - white, freedom, white), _unit(s, "bias", budget), w.channel.name
    low, high = float(np.sqrt(law.end(OUTSIDE))), float(np.sqrt(law.end(1.0 - OUTSIDE)))
    chance = law.tail((assumed or 0.0) ** 2)
    return [
        Assumption(
            f"{s.sensor}.bias", "run_to_run", unit, assumed, measured, low, high, freedom, name, chance
        )
    ]


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
