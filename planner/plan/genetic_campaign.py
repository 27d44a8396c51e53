"""The published way to a campaign: the genetic algorithm on allowed error sizes, beside the exact optimum.

A gene says how far the allowed size of one error may rise from the smallest that the bench can reach towards
the largest that is possible, in proportion to the others; all rise together until the requirement is just
met (the published |S − S_required| = 0, exactly). Sizes become a campaign by giving every error, in turn, the
row within its size that adds least to what the others already pay for; the fitness is the campaign's cost.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.nouns.allowances import GeneticHistory
from planner.nouns.array import Array
from planner.nouns.choices import Campaign
from planner.nouns.plan import GeneticPlan
from planner.nouns.progress import Progress
from planner.nouns.sensitivities import Constraint
from planner.plan.budget import size, uncalibrated
from planner.plan.rows import ErrorRows
from planner.plan.task import Task, row_sizes
from planner.solvers.genetic import GeneticSettings, minimise
from planner.solvers.integer import fold_private_resources
from planner.solvers.limit_surface import LimitSurface
from planner.solvers.linear_combination import combination

# Rounds over the errors in which each one may change its row given the rows of the others.
ROUNDS = 3
FRONT_POINTS = 60
HEAD_ROOM = 1.5
# How far below the limit a size may stay; the surface is never overstepped, so no campaign is too good.
SURFACE_TOLERANCE = 1e-5
# A population that has converged sits on one choice of temperatures. A fresh one starts as long as there are
# generations left, until IDLE_RUNS in a row have found nothing shorter.
PATIENCE = 10
IDLE_RUNS = 4
DECADES = 4  # between the slowest and the fastest rising error


def genetic_plan(
    task: Task,
    exact: Campaign,
    rule: str,
    settings: GeneticSettings,
    seed: int,
    told: Callable[[int, float], None] | None = None,
) -> GeneticPlan:
    """Run the genetic algorithm on the allowed sizes; gap is relative to the exact campaign's cost.

    told: after every generation how many there were and the least cost so far
    """
    decoder = _Decoder(task, rule)
    met: list[Array] = []
    histories: list[GeneticHistory] = []
    rng, best, idle = np.random.default_rng(seed), np.inf, 0

    def watch(genes: Array, values: Array) -> None:
        met.append(genes[np.argsort(values)[:FRONT_POINTS]])
        if told is not None:
            told(len(met), min(best, float(values.min())))

    while idle < IDLE_RUNS and (left := settings.generations - sum(h.generations for h in histories)) > 0:
        result = minimise(
            decoder.fitness,
            np.zeros(len(task.models)),
            np.ones(len(task.models)),
            replace(settings, generations=left, patience=PATIENCE),
            rng,
            watch=watch,
        )
        histories.append(result.history)
        idle = 0 if result.value < best else idle + 1
        best = min(best, float(result.value))
        if result.history.stopped == "time":
            break
    return GeneticPlan(
        time_s=round(best, 6),
        gap=max(0.0, best - exact.objective) / exact.objective if exact.objective else 0.0,
        history=_joined(histories),
        front=_front(decoder, met),
    )


def told_above(exact: float, generations: int, progress: Progress) -> Callable[[int, float], None]:
    """Says after every generation how far above the exact campaign the genetic one still is."""

    def told(generation: int, best: float) -> None:
        above = f", {100 * (best / exact - 1):.1f} % above the exact campaign" if exact else ""
        progress(f"genetic algorithm: generation {generation} of at most {generations}{above}")

    return told


def _joined(runs: Sequence[GeneticHistory]) -> GeneticHistory:
    """One history of several runs: best so far, mean of each generation."""
    best = np.minimum.accumulate(np.concatenate([run.best for run in runs]))
    return GeneticHistory(
        best=tuple(map(float, best)),
        mean=tuple(m for run in runs for m in run.mean),
        generations=sum(run.generations for run in runs),
        evaluations=sum(run.evaluations for run in runs),
        stopped=runs[-1].stopped,
    )


@dataclass(frozen=True)
class _Option:
    """One set of points in one test: where its rows start, their half-widths (falling), its residual."""

    start: int
    negative_half_width: Array
    residual: float


class _Decoder:
    """Sizes of errors → rows → cost and navigation error, for a whole population at once."""

    def __init__(self, task: Task, rule: str) -> None:
        self.task, self.rule = task, rule
        self.folded = fold_private_resources(task.problem)
        self.row_sizes = [row_sizes(m, r, rule) for m, r in zip(task.models, task.rows, strict=True)]
        self.low = np.array([s.min() for s in self.row_sizes])
        # a row needs a gene at least as large as it is: without head room the cheapest rows of an error
        # would need a gene at the very end of its range
        self.high = HEAD_ROOM * np.array([s.max() for s in self.row_sizes])
        self.alone = np.array([uncalibrated(model, rule).allowed for model in task.left])
        names = [*task.errors, *(model.name for model in task.left)]
        self.surface = LimitSurface(task.constraints, names, SURFACE_TOLERANCE)
        self.options = [_options(rows) for rows in task.rows]
        self.constant = [
            [float(size((m.largest_run_to_run, m.in_run, m.storage, o.residual), rule)) for o in options]
            for m, options in zip(task.models, self.options, strict=True)
        ]  # the constant parts and the temperature residual
        # row by row in memory: rows of anything else are only taken from a copy of all of it
        self.amounts = [np.ascontiguousarray(g.amounts) for g in self.folded.groups]
        groups = zip(self.folded.groups, self.options, strict=True)
        self.uses = [[_uses(g.amounts, o, self.folded.prices) for o in options] for g, options in groups]
        self.figures = [_figure(task, c) for c in task.constraints]

    def sizes(self, genes: Array) -> Array:
        """(P, E) allowed sizes on the limit: genes in 0..1 give the proportions, over DECADES of ten.

        An error that has reached its largest size stays there, and the others go on.
        """
        errors = len(self.low)
        sizes = np.broadcast_to(np.r_[self.low, self.alone], (len(genes), errors + len(self.alone))).copy()
        rise = np.zeros_like(sizes)
        rise[:, :errors] = (self.high - self.low) * 10.0 ** (DECADES * (genes - 1.0))
        for _ in range(errors):
            far = self.surface.reach(sizes, rise, np.full(len(genes), 10.0**DECADES))
            sizes[:, :errors] = np.minimum((sizes + far[:, None] * rise)[:, :errors], self.high)
            rise[:, :errors] *= sizes[:, :errors] < self.high
        return sizes[:, :errors]

    def fitness(self, genes: Array) -> Array:
        """(P,) cost of the campaign of each individual."""
        return self.decode(genes)[0]

    def decode(self, genes: Array) -> tuple[Array, Array]:
        """(P,) cost and (P,) largest share of a limit that is used."""
        genes, again = np.unique(genes, axis=0, return_inverse=True)  # a third of a generation are twins
        cost, load = self._decoded(genes)
        return cost[again], load[again]

    def _decoded(self, genes: Array) -> tuple[Array, Array]:
        rows = self._rows(self.sizes(genes) * (1 + 1e-9))
        cost = np.maximum.reduce([self._used(e, rows[:, e]) for e in range(rows.shape[1])])
        paid = np.maximum(cost, self.folded.forced) @ self.folded.prices
        own = sum(g.cost[rows[:, e]] for e, g in enumerate(self.folded.groups))
        load = np.max([figure(rows) for figure in self.figures], axis=0)
        return paid + own, load

    def _used(self, e: int, rows: NDArray[np.int64]) -> Array:
        return self.amounts[e].take(rows, axis=0)

    def _rows(self, sizes: Array) -> NDArray[np.int64]:
        """(P, E) for each error the row within its size that adds least to what the others pay for."""
        individuals, errors = sizes.shape
        allowed = [self._within(e, sizes[:, e]) for e in range(errors)]
        rows = np.full((individuals, errors), -1, dtype=np.int64)
        chosen = [np.zeros((individuals, len(self.folded.prices))) for _ in range(errors)]
        stale = np.ones((errors, individuals), dtype=bool)  # the others have changed since
        for _ in range(ROUNDS):
            for e in range(errors):
                at = np.flatnonzero(stale[e])
                found = self._cheapest(e, allowed[e][:, at], self._paid_by_others(e, chosen, at))
                changed = at[found != rows[at, e]]
                rows[at, e] = found
                chosen[e][changed] = self._used(e, rows[changed, e])
                stale[:, changed] = True
                stale[e] = False
        every = np.arange(individuals)
        for e in range(errors):
            # rows are smaller than what was allowed: one error after the other takes what is left over
            within = self._within(e, self._room(e, rows))
            rows[:, e] = self._cheapest(e, within, self._paid_by_others(e, chosen, every))
            chosen[e] = self._used(e, rows[:, e])
        return rows

    def _paid_by_others(self, e: int, chosen: Sequence[Array], at: NDArray[np.intp]) -> Array:
        """(p, K) of the individuals at (p,)."""
        paid = np.tile(self.folded.forced, (len(at), 1))
        for o, used in enumerate(chosen):
            if o != e:
                np.maximum(paid, used.take(at, axis=0) if len(at) < len(used) else used, out=paid)
        return paid

    def _room(self, e: int, rows: NDArray[np.int64]) -> Array:
        """(P,) how large error e may be when the others are as large as their rows."""
        own = np.stack([table[rows[:, o]] for o, table in enumerate(self.row_sizes)], axis=1)
        sizes = np.concatenate([own, np.broadcast_to(self.alone, (len(rows), len(self.alone)))], axis=1)
        alone = np.zeros_like(sizes)
        alone[:, e] = 1.0
        most = np.full(len(rows), self.high[e])
        return np.asarray((own[:, e] + self.surface.reach(sizes, alone, most)) * (1 + 1e-9))

    def _within(self, e: int, sizes: Array) -> NDArray[np.int64]:
        """(O, P) the row of each option with fewest repeats within the size; −1 where none is."""
        found = []
        for option, constant in zip(self.options[e], self.constant[e], strict=True):
            slack = self._slack(constant, sizes)
            level = np.searchsorted(option.negative_half_width, -slack, side="left")
            found.append(np.where(level < len(option.negative_half_width), option.start + level, -1))
        return np.array(found)

    def _slack(self, constant: float, sizes: Array) -> Array:
        """(P,) half-width that the size leaves beside the constant parts."""
        if self.rule == "worst_case":
            return sizes - constant
        return np.sqrt(np.maximum(sizes**2 - constant**2, 0.0))

    def _cheapest(self, e: int, allowed: NDArray[np.int64], others: Array) -> NDArray[np.int64]:
        group, best = self.folded.groups[e], np.full(allowed.shape[1], np.inf)
        rows = np.zeros(allowed.shape[1], dtype=np.int64)
        for option, (start, used, amounts, prices) in zip(allowed, self.uses[e], strict=True):
            more = amounts.take(np.maximum(option - start, 0), axis=0)
            np.subtract(more, others.take(used, axis=1), out=more)
            np.maximum(more, 0.0, out=more)  # in place: fresh arrays would take longer than the arithmetic
            added = more @ prices + group.cost[option]
            better = (option >= 0) & (added < best)
            rows[better], best[better] = option[better], added[better]
        return rows


def _options(rows: ErrorRows) -> list[_Option]:
    starts = np.flatnonzero(np.r_[True, (np.diff(rows.menu) != 0) | (np.diff(rows.option) != 0)])
    ends = np.r_[starts[1:], len(rows)]
    return [
        _Option(int(a), -rows.half_width[a:b], float(rows.residual[a]))
        for a, b in zip(starts, ends, strict=True)
    ]


def _uses(amounts: Array, option: _Option, prices: Array) -> tuple[int, NDArray[np.intp], Array, Array]:
    """First row of an option, the resources that any of its rows uses, their amounts and prices.

    What none of its rows uses adds nothing to what the others pay for: a third of the columns is left.
    """
    own = amounts[option.start : option.start + len(option.negative_half_width)]
    used = np.flatnonzero(own.any(axis=0))
    return option.start, used, np.ascontiguousarray(own[:, used]), prices[used]


def _figure(task: Task, constraint: Constraint) -> Callable[[NDArray[np.int64]], Array]:
    """(P, E) rows -> (P,) share of the constraint's limit that they use, by its own rule."""
    names = [*task.errors, *(model.name for model in task.left)]
    alone = [uncalibrated(model, constraint.rule).allowed for model in task.left]
    tables = [row_sizes(m, r, constraint.rule) for m, r in zip(task.models, task.rows, strict=True)]
    length, limit = combination(constraint, names), constraint.limit

    def share(rows: NDArray[np.int64]) -> Array:
        own = np.stack([table[rows[:, e]] for e, table in enumerate(tables)], axis=1)
        left = np.broadcast_to(np.array(alone), (len(rows), len(alone)))
        return np.asarray(length(np.concatenate([own, left], axis=1)) / limit)

    return share


def _front(decoder: _Decoder, met: list[Array]) -> tuple[Mapping[str, float], ...]:
    """Allowances that no other one beats both in time and in navigation error, thinned, shortest first."""
    reached = np.unique(np.concatenate(met), axis=0)
    cost, load = decoder.decode(reached)
    order = np.lexsort((load, cost))
    falling = load[order] < np.r_[np.inf, np.minimum.accumulate(load[order])[:-1]]
    kept = order[falling]
    kept = kept[np.unique(np.linspace(0, len(kept) - 1, FRONT_POINTS).round().astype(int))]
    sizes = decoder.sizes(reached[kept])
    return tuple(
        {**dict(zip(decoder.task.errors, map(float, sizes[i]), strict=True)), "time_s": float(cost[k])}
        for i, k in enumerate(kept)
    )
