"""Whether records tell an effect that the calibration's fit, beside all that the spec budgets, does not."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner import catalog
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.findings.declared_and_found import ChannelEstimates
from planner.diagnose.findings.sure_by_the_fit import chance_by_the_fit
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.estimates import estimates
from planner.diagnose.hypotheses.found import ALPHA
from planner.diagnose.noise.wander import LARGEST_AT_FIRST, can_tell, left_of, wander
from planner.diagnose.noise.whitened import Whitened, log_p
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec

SURE = 6.0  # sigma of an effect, from which its sign is


def named(s: SensorFound) -> list[int]:
    """The effects of the library that are believed, references apart."""
    return [b for b in s.found.library if not s.found.pool.blocks[b].reference]


def told_by_the_search(
    s: SensorFound, last: Mapping[int, ChannelEstimates], data: Prepared, spec: Spec
) -> set[int]:
    """Channels of which the fit is no longer sure of an effect that the search is, and nothing wanders.

    That fit counts the spec's in-run as noise of every record: 0.5 mg hide a coefficient of 0.08 mg per K/min
    that stands 13 sigma above what the records scatter, and 1.5 mg the length of a centrifuge's arm, 24 sigma
    on three channels. Where they show no such process it is not in them; what is not beyond doubt must be
    significant even beside as much of it as they allow.
    """
    budgets: Mapping[str, ErrorBudget] = getattr(spec.unit, s.sensor)
    out = set[int]()
    for b in named(s):
        axes = s.found.axes(b)
        alone = all(len(s.found.on({axis})) == 1 and axis in last for axis in axes)
        if not alone or not _of_the_bias_alone(s.found.pool.blocks[b], budgets):
            continue
        fit = [
            c
            for axis in axes
            for (effect, _), c in last[axis].terms.items()
            if effect == s.found.pool.blocks[b].name
        ]
        unsure = all(c.low <= 0.0 <= c.high for c in fit)
        unsure = unsure or chance_by_the_fit(s.found.pool, last, b) > ALPHA
        if unsure and _told_by_records(s, b, data.table.time_on, budgets["bias"].in_run_time):
            out |= axes
    return out


def _of_the_bias_alone(block: Block, budgets: Mapping[str, ErrorBudget]) -> bool:
    """Whether all that the spec lets vary beside a block is the bias, of which the records are asked.

    Scale factors and leans that each power-on draws, or that wander, are what an effect of the input looks
    like: ten power-ons made a misalignment over temperature of seven sigma.
    """
    others = (budget for error, budget in budgets.items() if error != "bias")
    steady = all(not o.in_run_sigma and not o.run_to_run_largest for o in others)
    return "bias" in budgets and (steady or catalog.effects()[block.name].group == "bias")


def _told_by_records(s: SensorFound, b: int, time_on: Array, tau: float) -> bool:
    """Whether a block's coefficients are surely not zero, in records of which none shows that it wanders."""
    mine = [e for e in estimates(s.found.pool, s.found.all) if e.block == b]
    if not any(abs(e.value) > e.half for e in mine):
        return False
    return all(
        can_tell(w, LARGEST_AT_FIRST)
        and wander(w, columns, time_on, tau, largest=LARGEST_AT_FIRST) is None
        and _stands_beside_a_walk(s, b, w, time_on, tau)
        for axis, columns in s.found.pool.blocks[b].columns.items()
        for w in [s.found.pool.state[axis]]
    )


def _stands_beside_a_walk(s: SensorFound, b: int, w: Whitened, time_on: Array, tau: float) -> bool:
    """Whether an effect stays significant beside as large a process within power-ons as the rows allow."""
    own = s.found.share(b)
    if own.delta >= SURE**2:
        return True
    pool = s.found.pool
    left = left_of(w, pool.blocks[b].columns[w.channel.axis], time_on, tau)
    looks = len({block.key for block in pool.blocks})
    return bool(float(log_p(left * own.delta, own.m, own.freedom, own.s2)) <= np.log(ALPHA / looks))
