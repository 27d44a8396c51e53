"""A name is the claim of a form: its coefficient is one number, whatever else changes.

With e = G γ̂ what a believed effect adds to a channel, every variable x of the records gives a departure

    d = e x,  and e x² over the variable along which the effect runs,     x from −1 to 1 in these records

a drift of the days that is no straight line, a cubic that bends earlier, a warm-up that goes with
temperature. Each is tested as one column beside everything believed and the slopes of the effect's own
parameters, where a generic alternative of many columns would see it only when it is much stronger: the score
test of a varying coefficient (Hastie, Tibshirani, J. R. Stat. Soc. B 55, 1993). A name that does not hold
gives way to one more effect of the library or to the variable, whichever the criterion has before the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.channels import Channel
from planner.diagnose.hypotheses.found import Found, Question, best_of, free, on
from planner.diagnose.hypotheses.lack_of_fit import DECISIVE, LEAST, along
from planner.diagnose.hypotheses.pool import given, inverse, pool_of, score
from planner.diagnose.hypotheses.references import hypothesis
from planner.diagnose.hypotheses.unnamed import MISFIT_OF_A_NAME, choice, told_apart
from planner.nouns.array import Array
from planner.protocols import Condition

DEPARTS = 1e-3  # p over the departures of one name, from which its form is not the one that is there
MOST_NAMES = 2  # on one channel, a second beside one that departs


def only_forms_that_hold(found: Found, question: Question) -> None:
    """Put what the data say in the place of believed names whose coefficients depart from one number."""
    for axis in found.pool.axes if told_apart(found.pool) else ():
        for b in [b for b in found.on({axis}) if _is_asked(found, b)]:
            if b in found.library and _is_a_part(found, b, axis):
                found.library.remove(b)
            elif b in found.library and _departs(found, b, axis, question.slopes(found, b)):
                _instead(found, b, axis, question)


def _is_asked(found: Found, b: int) -> bool:
    block = found.pool.blocks[b]
    return not (len(block.columns) > 1 or block.reference or hypothesis(block.name).bench_only)


def _is_a_part(found: Found, b: int, axis: int) -> bool:
    """Whether an unknown over the effect's variable and another one stands beside it: their first term."""
    own, mine = along(found.pool, b), found.share(b).delta
    return any(
        "_and_" in found.pool.blocks[u].name
        and own in found.pool.blocks[u].name.split("_and_")
        and found.share(u).delta > LEAST * mine
        for u in on(found.pool, found.unknown, {axis})
    )


def _departs(found: Found, b: int, axis: int, slopes: Block | None) -> bool:
    """Whether some variable changes the coefficient of a believed block."""
    w = found.pool.state[axis]
    block = found.pool.blocks[b]
    e = block.columns[axis] @ _coefficients(found, b)
    departures = [
        replace(block, columns={axis: (e * x)[:, None]}, terms=("",), nonlinear={})
        for x in _variables(w.channel, hypothesis(block.name).variable)
    ]
    believed = [found.pool.blocks[i] for i in on(found.pool, found.all, {axis})]
    believed += [slopes] if slopes is not None else []
    beside = [replace(x, columns={axis: x.columns[axis]}) for x in believed]
    one = given(pool_of({axis: w}, [*beside, *departures], found.pool.segments.cuts), range(len(beside)))
    told = [score(one, [len(beside) + i]) for i in range(len(departures))]
    told = [s for s in told if s.m and s.delta > MISFIT_OF_A_NAME * found.share(b).delta]
    return bool(told) and min(s.log_p for s in told) < np.log(DEPARTS / len(departures))


def _coefficients(found: Found, b: int) -> Array:
    """(k,) of a believed block's columns, SI, beside everything else that is believed."""
    pool = found.pool
    k = pool.columns(found.all)
    gamma = inverse(pool.grams(k)) @ pool.h[k]
    mine = np.isin(k, pool.places[b])
    size = pool.size[pool.places[b]]
    return np.asarray(np.divide(gamma[mine], size, out=np.zeros_like(size), where=size > 0))


def _variables(c: Channel, own: Condition | None) -> Iterator[Array]:
    """(n,) each variable of the records from −1 to 1, and the square of an effect's own."""
    conditions = c.model.conditions
    for name in ("temperature_degc", "time_on", "day", "temperature_rate", "rate", "specific_force"):
        values = np.asarray(getattr(conditions, name), dtype=float)
        x = _scaled(np.linalg.norm(values, axis=1) if values.ndim > 1 else values)
        yield x
        if name == own:
            yield x**2
    if own in ("rate", "specific_force"):
        yield _scaled(np.abs(c.u))
        yield _scaled(np.abs(c.u)) ** 2


def _scaled(values: Array) -> Array:
    low, high = float(values.min()), float(values.max())
    return (2.0 * values - low - high) / (high - low) if high > low else np.zeros_like(values)


def _instead(found: Found, b: int, axis: int, question: Question) -> None:
    """One more name beside one that does not hold, or the variable in its place."""
    pool = found.pool
    without = given(pool, found.others(b))
    every = free(pool, on(pool, question.generic, {axis}), found.unknown)
    unnamed = {g: score(without, [g]).criterion for g in every}
    variable = max(unnamed, key=lambda g: unnamed[g], default=None)
    if variable is None or unnamed[variable] < DECISIVE:
        return
    second, gain = _second(found, axis, question)
    if second is not None and gain > 0.0 and score(without, [b]).criterion + gain > unnamed[variable]:
        found.library.append(second)
        found.stood_for[pool.blocks[second].key] = DEPARTS
        found.refine(question)
        return
    found.library.remove(b)
    found.aliased.discard(pool.blocks[b].key)
    found.unknown.append(variable)
    found.drop_needless(found.chance(question))


def _second(found: Found, axis: int, question: Question) -> tuple[int | None, float]:
    """The best further name of a channel, and its criterion less what its choice costs; none beside two."""
    pool, here = found.pool, found.without()
    if len(found.on({axis})) >= MOST_NAMES:
        return None, 0.0
    every = free(pool, on(pool, question.library, {axis}), found.all)
    scores = {c: score(here, [c]) for c in every if len(pool.blocks[c].columns) == 1}
    criteria = {c: s.criterion for c, s in scores.items() if s.m}
    if not criteria:
        return None, 0.0
    best = best_of(pool, criteria)
    return best, criteria[best] - choice(found, question, axis)
