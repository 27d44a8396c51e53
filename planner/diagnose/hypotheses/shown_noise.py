"""What the rows of a channel show of its noise beyond white and levels of power-ons, with what hides in it.

A bias that wanders within power-ons (`wander`), or misalignments that differ from power-on to power-on,

    cov(e) = … + Σ_runs σ_j² u_j u_jᵀ,   u_j an input across the channel

which is a pattern of every power-on and no noise of every record that grows with the input across: of a few
on a centrifuge that made a square of the load at seven sigma. Each is asked of the likelihood beside what
hides in the noise (`hidden_columns`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.hidden_columns import with_what_hides
from planner.diagnose.hypotheses.noise import CROSS_NOISE, Readings
from planner.diagnose.hypotheses.wander import LEAST_TO_WANDER, SETTLED_ROUGHLY, gained, with_wander
from planner.diagnose.hypotheses.weighed_columns import Weighed, weighed
from planner.nouns.array import Array
from planner.solvers.distributions import chi_square_tail
from planner.solvers.reml_beside import reml_roughly

CHANCE = 1e-3  # of a channel that keeps its alignment


def as_shown(plain: Readings, hidden: Sequence[Block], time_on: Array) -> tuple[Readings, Readings]:
    """The readings with the noise that they show, and the same with what hides in it beside.

    A table over the time follows what wanders, and a process what a table says: the likelier of both stands.
    """
    whole, how = with_what_hides(plain, hidden)
    if _leans(whole, how):
        plain = plain.with_noise(leans=True)
        whole, how = with_what_hides(plain, hidden)
    drifts, least = with_wander(whole, how, time_on).drifts, -np.inf
    if not drifts and how is not None and whole is not plain:
        drifts, least = with_wander(plain, weighed(plain), time_on).drifts, how.criterion
    if not drifts:
        return plain, whole
    moves = plain.with_noise(drifts=drifts)
    beside, then = with_what_hides(moves, hidden)
    return (moves, beside) if then is not None and then.criterion >= least else (plain, whole)


def alike(triad: Sequence[Readings]) -> list[Readings]:
    """With a kind of noise on every channel where one has it: what they share must be of one kind."""
    drifts = {name: d for r in reversed(triad) for name, d in r.drifts.items()}
    leans = any(r.leans for r in triad)
    own = [{name: r.drifts.get(name, drifts[name]) for name in sorted(drifts)} for r in triad]
    return [
        r if r.leans is leans and [*r.drifts] == [*mine] else r.with_noise(drifts=mine, leans=leans)
        for r, mine in zip(triad, own, strict=True)
    ]


def _leans(readings: Readings, plain: Weighed | None) -> bool:
    """Whether the restricted likelihood is so much larger with misalignments of every power-on: χ² of two.

    Where they are left out, noise of each record that grows with the input across stands for them.
    """
    c = readings.channel
    if plain is None or len(readings.starts) < LEAST_TO_WANDER or CROSS_NOISE not in plain.judged.components:
        return False
    cross = float(plain.theta[plain.judged.components.index(CROSS_NOISE)])
    if cross * float(np.max(c.across**2)) < plain.theta[0]:
        return False
    wider = readings.with_noise(leans=True).judged.sample
    start = np.append(plain.theta, np.full(2, cross))
    theta = reml_roughly(wider, start, SETTLED_ROUGHLY).theta
    gain = gained(plain.judged.sample, plain.theta, wider, theta)
    return gain > 0.0 and float(chi_square_tail(gain, 2)) < CHANCE
