"""What the rows of a channel show of its noise beyond white and levels of power-ons, with what hides in it.

A bias that wanders within power-ons (`wander`), or coefficients that differ from power-on to power-on,

    cov(e) = … + Σ_runs σ_j² u_j u_jᵀ,   u_j what coefficient j adds: an input across the channel, …

misalignments, and whatever else the spec's budgets let every power-on draw. That is a pattern of each
power-on and no noise of every record that grows with the input, nor a scale factor that wanders: of a few on
a centrifuge misalignments made a square of the load at seven sigma, and g-sensitivities a drift over the
temperature. Each is asked of the likelihood beside what hides in the noise (`hidden_columns`).

Misalignments that the budget lets exceed the records' own noise are a variance in any case. Hardly seen at
1 g they are forty times as large on an arm, where every direction has a power-on or two and all candidates
together leave nothing of them: no likelihood asks, and a product of loads, a lever arm or a crooked mounting
was claimed at fifteen sigma. How large they are, and how badly that is known, REML says.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from planner import catalog
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.noise.channel_noise import LEAST_RUNS, Readings
from planner.diagnose.noise.components import CROSS_NOISE, LEANS, draws
from planner.diagnose.noise.wander import (
    LEAST_TO_WANDER,
    PROMISED,
    SETTLED_ROUGHLY,
    gained,
    with_wander,
)
from planner.diagnose.noise.weighed_columns import Weighed, weighed
from planner.diagnose.search.hidden_columns import with_what_hides
from planner.nouns.array import Array
from planner.solvers.distributions import chi_square_tail
from planner.solvers.reml_beside import promised, reml_roughly
from planner.solvers.restricted_likelihood import Sample
from planner.spec.budget import ErrorBudget

CHANCE = 1e-3  # of a channel whose coefficients stay what they are
OF_THE_LEVEL = ("bias", "scale_factor", LEANS)  # of which the spread is a variance already, or asked first


def as_shown(
    plain: Readings, hidden: Sequence[Block], time_on: Array, budgets: Mapping[str, ErrorBudget]
) -> tuple[Readings, Readings]:
    """The readings with the noise that they show, and the same with what hides in it beside.

    A table over the time follows what wanders, and a process what a table says: the likelier of both stands.
    """
    plain = with_leans(plain, budgets)  # whatever hides: it makes the noise larger
    whole, how = with_what_hides(plain, hidden, budgets)
    if not plain.drawn and how is not None and (_may_lean(whole, how, budgets) or _leans(whole, how)):
        plain = plain.with_noise(drawn=(LEANS,))
        whole, how = with_what_hides(plain, hidden, budgets)
    drawn = whole.drawn if how is None else _drawn(whole, how, budgets)
    if drawn != plain.drawn:
        plain = plain.with_noise(drawn=drawn)
        whole, how = with_what_hides(plain, hidden, budgets)
    drifts, least = with_wander(whole, how, time_on).drifts, -np.inf
    if not drifts and how is not None and whole is not plain:
        drifts, least = with_wander(plain, weighed(plain), time_on).drifts, how.criterion
    if not drifts:
        return plain, whole
    moves = plain.with_noise(drifts=drifts)
    beside, then = with_what_hides(moves, hidden, budgets)
    return (moves, beside) if then is not None and then.criterion >= least else (plain, whole)


def with_leans(plain: Readings, budgets: Mapping[str, ErrorBudget]) -> Readings:
    """The readings with misalignments that every power-on draws, where the budget lets them be seen."""
    first = weighed(plain) if LEANS in budgets else None
    leans = first is not None and _may_lean(plain, first, budgets)
    return plain.with_noise(drawn=(LEANS,)) if leans else plain


def alike(triad: Sequence[Readings]) -> list[Readings]:
    """With a kind of noise on every channel where one has it: what they share must be of one kind."""
    drifts = {name: d for r in reversed(triad) for name, d in r.drifts.items()}
    drawn = tuple(sorted({effect for r in triad for effect in r.drawn}))
    own = [{name: r.drifts.get(name, drifts[name]) for name in sorted(drifts)} for r in triad]
    return [
        r if r.drawn == drawn and [*r.drifts] == [*mine] else r.with_noise(drifts=mine, drawn=drawn)
        for r, mine in zip(triad, own, strict=True)
    ]


def _may_lean(readings: Readings, plain: Weighed, budgets: Mapping[str, ErrorBudget]) -> bool:
    """Whether the budget lets misalignments of a power-on exceed white noise, of as many as tell a spread."""
    budget = budgets.get(LEANS)
    return (
        budget is not None
        and budget.has_run_to_run
        and len(readings.starts) >= LEAST_RUNS
        and _exceeds(readings, plain, LEANS, budget)
    )


def _leans(readings: Readings, plain: Weighed) -> bool:
    """Whether the restricted likelihood is so much larger with misalignments of every power-on: χ² of two.

    Where they are left out, noise of each record that grows with the input across stands for them.
    """
    c = readings.channel
    if len(readings.starts) < LEAST_TO_WANDER or CROSS_NOISE not in plain.judged.components:
        return False
    cross = float(plain.theta[plain.judged.components.index(CROSS_NOISE)])
    if cross * float(np.max(c.across**2)) < plain.theta[0]:
        return False
    wider = readings.with_noise(drawn=(LEANS,)).judged.sample
    return _likelier(plain.judged.sample, plain.theta, wider, cross) is not None


def _likelier(sample: Sample, theta: Array, wider: Sample, first: float) -> Array | None:
    """Variances of a sample with a few more, sought from `first`, where its likelihood asks for them."""
    more = wider.effects.count - len(theta)
    found = reml_roughly(wider, np.append(theta, np.full(more, first)), SETTLED_ROUGHLY).theta
    gain = gained(sample, theta, wider, found)
    return found if gain > 0.0 and float(chi_square_tail(gain, more)) < CHANCE else None


def _drawn(readings: Readings, plain: Weighed, budgets: Mapping[str, ErrorBudget]) -> tuple[str, ...]:
    """The effects of which the rows show that their coefficients differ from power-on to power-on.

    Of those that the budgets let differ by more than the records' own noise: that which promises most first.
    """
    drawn = readings.drawn
    if len(readings.starts) < LEAST_TO_WANDER:
        return drawn
    left = dict(_large(readings, plain, budgets))
    sample, theta = plain.judged.sample, plain.theta
    while left:
        wider = {e: readings.with_noise(drawn=(*drawn, e)).judged.sample for e in left}
        promises = {e: _promise(w, theta) for e, w in wider.items()}
        best = max(promises, key=lambda e: promises[e])
        if promises[best] < PROMISED:
            break
        found = _likelier(sample, theta, wider[best], left.pop(best))
        if found is not None:
            drawn, sample, theta = (*drawn, best), wider[best], found
    return drawn


def _promise(wider: Sample, theta: Array) -> float:
    """2 log L that the most promising of the further variances of a sample promises."""
    more = wider.effects.count - len(theta)
    return float(promised(wider, np.append(theta, np.zeros(more)), more).max(initial=0.0)) if more else 0.0


def _large(
    readings: Readings, plain: Weighed, budgets: Mapping[str, ErrorBudget]
) -> Iterator[tuple[str, float]]:
    """(effect, σ²) of what the budgets let every power-on draw, larger than white noise in one of them."""
    for effect, budget in budgets.items():
        if effect in OF_THE_LEVEL or effect not in catalog.effects() or not budget.has_run_to_run:
            continue
        if _exceeds(readings, plain, effect, budget):
            yield effect, budget.run_to_run_largest**2


def _exceeds(readings: Readings, plain: Weighed, effect: str, budget: ErrorBudget) -> bool:
    """Whether what one power-on may draw of an effect is more than white noise in its records."""
    c = readings.channel
    named = dict(zip(plain.judged.components, plain.theta.tolist(), strict=True))
    white = named["white"] + named.get("constant", 0.0)
    square = sum((x**2 for x in draws(c, [effect]).values()), np.zeros(len(c.r)))
    largest = float(np.add.reduceat(square, readings.starts).max())
    return bool(budget.run_to_run_largest**2 * largest > white)
