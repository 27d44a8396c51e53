"""A name is the claim of a form: its coefficient is one number, whatever else changes.

With e = G γ̂ what a believed effect adds to a channel, every variable x of the records gives a departure

    d = e x,  and e x² over the variable along which the effect runs,     x from −1 to 1 in these records
    d = sign(e) max(|u| − k U, 0)    over the channel's own input u of U at most, a corner at the share k

a drift of the days that is no straight line, a cubic that bends earlier, a warm-up that goes with
temperature. Each is tested as one column beside everything believed and the slopes of the effect's own
parameters, where a generic alternative of many columns would see it only when it is much stronger: the score
test of a varying coefficient (Hastie, Tibshirani, J. R. Stat. Soc. B 55, 1993). A name that does not hold
gives way to one more effect of the library or to the variable, whichever the criterion has before the other.
A name whose form the records do not test stands beside its own variable, as a rival (`untested`): two rates
show one odd shape, whatever it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from planner.diagnose.channels.channel import Channel
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.found import Found, Question, along, best_of, free, on
from planner.diagnose.hypotheses.lack_of_fit import DECISIVE, LEAST, simplest
from planner.diagnose.hypotheses.pool import Pool, given, inverse, pool_of
from planner.diagnose.hypotheses.scores import Score, score
from planner.diagnose.references.references import hypothesis
from planner.diagnose.vetoes.unnamed import MISFIT_OF_A_NAME, choice, told_apart
from planner.nouns.array import Array
from planner.protocols import Condition
from planner.solvers.distributions import TWO_SIDED

DEPARTS = 1e-3  # p over the departures of one name, from which its form is not the one that is there
# p of one over the input along which it runs, from which it is another curve of that: they are one question,
# for the columns that ask it have nearly all in common. What wanders is set by nobody, and bends as well
BENDS = 2e-3
INPUTS = ("rate", "specific_force")
CORNERS = (0.35, 0.65)  # of the largest input: nearer to nothing or to the end a curve has hardly a bend
MOST_NAMES = (
    2  # on one channel, a second beside one that departs; with a variable in common they are one claim
)
CHANGES = 0.5  # of the coefficient, from the middle of a variable to its end, that a tested form excludes
DOUBTFUL = 2.58  # sigma of a change with temperature, one in a hundred, from which it is no constant for sure
VARIABLES: tuple[Condition, ...] = (
    "temperature_degc",
    "time_on",
    "day",
    "temperature_rate",
    "rate",
    "specific_force",
)
TEMPERATURE = "temperature"
TAKEN_UP = 0.5  # of what a name departs by, that a variable in its place must say
AN_EQUATION = 3  # columns; what has more is a table, which claims no form over its variable


def only_forms_that_hold(found: Found, question: Question) -> None:
    """Put what the data say in the place of believed names whose coefficients depart from one number."""
    for axis in found.pool.axes if told_apart(found.pool) else ():
        for b in [b for b in found.on({axis}) if _is_asked(found, b)]:
            if b in found.library and _is_a_part(found, b, axis):
                found.library.remove(b)
            elif b in found.library:
                lacking = _departs(found, b, axis, question.slopes(found, b))
                if lacking > 0.0:
                    _instead(found, b, axis, question, lacking)
        _one_variable_for_several_names(found, axis, question)
        _one_variable_for_a_name_and_its_own(found, axis, question)


def _one_variable_for_several_names(found: Found, axis: int, question: Question) -> None:
    """Put a variable in the place of several names of a channel none of whose forms over it is tested.

    A bump over the days is a step and an ageing, roughly: two claims, where the records make none but that.
    """
    pool = found.pool
    courses: dict[str, list[int]] = {}
    names = [b for b in found.on({axis}) if _is_asked(found, b)]
    for b in names if len(names) >= MOST_NAMES else ():
        if untested(found, b, question.slopes(found, b)) is not None:
            courses.setdefault(along(pool, b), []).append(b)
    for variable, mine in courses.items():
        if len(mine) < MOST_NAMES:
            continue
        stand = any(pool.blocks[u].name == variable for u in on(pool, found.unknown, {axis}))
        without = given(pool, found.others(*mine))
        scores = {g: score(without, [g]).criterion for g in on(pool, question.generic, {axis})}
        best = _over(pool, scores, variable)
        if stand or (best is not None and scores[best] > DECISIVE):
            found.library = [b for b in found.library if b not in mine]
            found.unknown += [] if stand or best is None or best in found.unknown else [best]


def _one_variable_for_a_name_and_its_own(found: Found, axis: int, question: Question) -> None:
    """Put one curve over a variable in the place of a name along it and as much without a name beside that.

    What is held above half a g is a g-sensitivity, roughly, and a curve over the force: the name is the first
    term of that one. A rest that is small beside the name is what its equation may lack. Where no one curve
    over that variable says what both do together, another variable's may (`_over`): of a cubic and a curve
    that cancel but for eleven sigma one curve of 0.4 was left, and the channel clean.
    """
    pool = found.pool
    for b in [b for b in found.on({axis}) if _is_asked(found, b)]:
        own = along(pool, b)
        beside = [u for u in on(pool, found.unknown, {axis}) if pool.blocks[u].name == own]
        if b in found.library and beside and found.share(beside[0]).delta > LEAST * found.share(b).delta:
            without = given(pool, found.others(b, *beside))
            scores = {g: score(without, [g]).criterion for g in on(pool, question.generic, {axis})}
            best = _over(pool, scores, own)
            assert best is not None  # one of them stands beside it
            found.stands_for(best, [b, *beside], question)
            found.library.remove(b)
            found.unknown = [*(u for u in found.unknown if u not in beside), best]


def _over(pool: Pool, scores: Mapping[int, float], variable: str) -> int | None:
    """The best bins over a variable; those over another one, of which names are functions too, if decisive.

    A rate that saturates is a scale factor over the load and one over its square, where loads go with rates.
    """
    own = [g for g in scores if pool.blocks[g].name == variable]
    best = max(own, key=lambda g: scores[g], default=None)
    other = max(scores, key=lambda g: scores[g], default=None)
    if other is not None and (best is None or scores[other] > scores[best] + DECISIVE):
        return other
    return best


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


def untested(found: Found, b: int, slopes: Block | None) -> tuple[str, float] | None:
    """(variable, sigma) where the records do not tell a believed form from another one over its own variable.

    With d the departures over that variable, each beside all that is believed, c d of length |c| l has the
    interval c ± 1.96 / l. The form is tested where each of them holds zero and none reaches CHANGES; sigma is
    how far such a change would be seen, CHANGES l, of the departure that is seen least.
    """
    if not _claims_a_form(found, b):
        return None
    axis = next(iter(found.pool.blocks[b].columns))
    own = hypothesis(found.pool.blocks[b].name).variable
    sizes = _sizes(found, b, axis, slopes, list(_courses(found.pool.state[axis].channel, own)))
    if all(abs(c) * length <= TWO_SIDED and _excludes(CHANGES, c, length) for c, length in sizes):
        return None
    return along(found.pool, b), CHANGES * min(length for _, length in sizes)


def at_one_temperature(found: Found, b: int, slopes: Block | None) -> float | None:
    """Sigma by which a coefficient that doubles, or goes to nothing, to an end of the temperatures is seen.

    Or to their middle, where they are three or more. None where the intervals exclude both, and neither is
    told from no change. A centrifuge stands in the room.
    """
    block = found.pool.blocks[b]
    if not _claims_a_form(found, b) or TEMPERATURE in (
        hypothesis(block.name).variable,
        *block.name.split("_"),
    ):
        return None
    axis = next(iter(block.columns))
    x = _scaled(_values(found.pool.state[axis].channel, "temperature_degc"))
    if not np.any(x):
        return None
    one, both = _sizes(found, b, axis, slopes, [x, 2.0 * x**2 - 1.0])
    told = [one, both] if both[1] > 0.0 else [one]
    unseen = [n for c, n in told if not _excludes(1.0, c, n) or abs(c) * n > DOUBTFUL]
    return min(unseen, default=None)


def _claims_a_form(found: Found, b: int) -> bool:
    block = found.pool.blocks[b]
    widest = max(x.shape[1] for x in block.columns.values())
    return bool(_is_asked(found, b) and along(found.pool, b) and widest <= AN_EQUATION)


def _excludes(change: float, c: float, length: float) -> bool:
    """Whether the interval c ± 1.96 / length leaves a change out, either way."""
    return (change - abs(c)) * length >= TWO_SIDED


def _departs(found: Found, b: int, axis: int, slopes: Block | None) -> float:
    """Δ of the variable that changes the coefficient of a believed block most; 0 where none does."""
    w, variable = found.pool.state[axis], hypothesis(found.pool.blocks[b].name).variable
    own, others = list(_courses(w.channel, variable)), list(_others(w.channel, variable))
    corners = list(_corners(w.channel, variable))
    one, first = _beside(found, b, axis, slopes, [*own, *others], corners)
    told = [score(one, [first + i]) for i in range(len(own) + len(others) + len(corners))]
    log_p = [s.log_p if s.m and _is_more(found, b, s) else 0.0 for s in told]
    most = max((s.delta for s, p in zip(told, log_p, strict=True) if p < 0.0), default=0.0)
    if variable in INPUTS and min(*log_p[: len(own)], *log_p[len(own) + len(others) :]) < np.log(BENDS):
        return most
    return most if min(log_p, default=0.0) < np.log(DEPARTS / max(len(told), 1)) else 0.0


def _is_more(found: Found, b: int, s: Score) -> bool:
    """Whether a departure is more than what readings with noise leave of an equation that is right."""
    return bool(s.delta > MISFIT_OF_A_NAME * found.share(b).delta)


def _sizes(
    found: Found, b: int, axis: int, slopes: Block | None, x: Sequence[Array]
) -> list[tuple[float, float]]:
    """c of every departure c e x beside all that is believed, and the whitened length of e x there."""
    one, first = _beside(found, b, axis, slopes, x)
    out = []
    for i in range(len(x)):
        k = one.places[first + i]
        gram, size = float(one.grams(k)[0, 0]), float(one.size[k[0]])
        length = float(np.sqrt(max(gram, 0.0))) * size
        out.append((float(one.h[k[0]]) / gram / size if length > 0.0 else 0.0, length))
    return out


def _beside(
    found: Found,
    b: int,
    axis: int,
    slopes: Block | None,
    x: Sequence[Array],
    corners: Sequence[Array] = (),
) -> tuple[Pool, int]:
    """A pool of the departures e x, and sign(e) times some corners, clear of all that is believed.

    And the place of the first of them.
    """
    w, block = found.pool.state[axis], found.pool.blocks[b]
    e = block.columns[axis] @ _coefficients(found, b)
    columns = [*(e * v for v in x), *(np.sign(e) * k for k in corners)]
    departures = [replace(block, columns={axis: d[:, None]}, terms=("",), nonlinear={}) for d in columns]
    believed = [found.pool.blocks[i] for i in on(found.pool, found.all, {axis})]
    believed += [slopes] if slopes is not None else []
    beside = [replace(y, columns={axis: y.columns[axis]}) for y in believed]
    one = given(pool_of({axis: w}, [*beside, *departures], found.pool.cuts), range(len(beside)))
    return one, len(beside)


def _coefficients(found: Found, b: int) -> Array:
    """(k,) of a believed block's columns, SI, beside everything else that is believed."""
    pool = found.pool
    k = pool.columns(found.all)
    gamma = inverse(pool.grams(k)) @ pool.h[k]
    mine = np.isin(k, pool.places[b])
    size = pool.size[pool.places[b]]
    return np.asarray(np.divide(gamma[mine], size, out=np.zeros_like(size), where=size > 0))


def _others(c: Channel, own: Condition | None) -> Iterator[Array]:
    """(n,) each variable of the records from −1 to 1, but the one along which an effect runs."""
    for name in VARIABLES:
        if name != _along(c, own):
            yield _scaled(_values(c, name))


def _along(c: Channel, own: Condition | None) -> Condition | None:
    """The variable along which an effect runs; an accelerometer's input is the load (`of_the_sensor`)."""
    return "specific_force" if own == "rate" and c.sensor == "accelerometer" else own


def _courses(c: Channel, own: Condition | None) -> Iterator[Array]:
    """(n,) an effect's own variable from −1 to 1 and its square; of the channel's input also its modulus."""
    name = _along(c, own)
    if name in VARIABLES:
        x = _scaled(_values(c, name))
        yield x
        yield x**2
    if _is_own_input(c, name):
        yield _scaled(np.abs(c.u))
        yield _scaled(np.abs(c.u)) ** 2


def _corners(c: Channel, own: Condition | None) -> Iterator[Array]:
    """(n,) what of a channel's own input lies beyond a share of the largest, where an effect runs along that.

    A reading that saturates at two thirds, or leaves its line at one, is a cubic but for the corner.
    """
    if _is_own_input(c, _along(c, own)):
        size = np.abs(c.u) / np.abs(c.u).max()
        for share in CORNERS:
            yield np.maximum(size - share, 0.0)


def _is_own_input(c: Channel, name: Condition | None) -> bool:
    return name == ("rate" if c.sensor == "gyro" else "specific_force")


def _values(c: Channel, name: Condition) -> Array:
    values = np.asarray(getattr(c.model.conditions, name), dtype=float)
    return np.asarray(np.linalg.norm(values, axis=1) if values.ndim > 1 else values)


def _scaled(values: Array) -> Array:
    low, high = float(values.min()), float(values.max())
    return (2.0 * values - low - high) / (high - low) if high > low else np.zeros_like(values)


def _instead(found: Found, b: int, axis: int, question: Question, lacking: float) -> None:
    """One more name beside one that does not hold, another one or the variable in its place.

    lacking: Δ of what it departs by. A variable that takes up less than half of that says no more than the
    name did, with less of a form: where |f| was 1 g but for what turning adds, an asymmetry of 20 sigma
    departed along it by 3.5, of which three bins of the force had 2.8 of 12.6.
    """
    pool = found.pool
    without = given(pool, found.others(b))
    every = free(pool, on(pool, question.generic, {axis}), found.unknown)
    unnamed = {g: score(without, [g]).criterion for g in every}
    if max(unnamed.values(), default=0.0) < score(without, [b]).criterion:
        # no bins explain as much as the name does: only those along its own variable say what it said
        unnamed = {g: c for g, c in unnamed.items() if along(pool, b) in pool.blocks[g].name.split("_and_")}
    most = max(unnamed.values(), default=0.0)
    if most < DECISIVE:
        return
    second, gain = _second(found, axis, question)
    if second is not None and gain > 0.0 and score(without, [b]).criterion + gain > most:
        found.library.append(second)
        found.stood_for[pool.blocks[second].key] = DEPARTS
        found.refine(question)
        return
    other = _another(found, b, axis, question, without)
    if other is not None and score(without, [other]).criterion > most:
        found.library[found.library.index(b)] = other
        found.stood_for[pool.blocks[other].key] = DEPARTS
        return
    instead, own = simplest(pool, unnamed), score(without, [b])
    taken = score(without, [instead])
    if taken.criterion < own.criterion and taken.delta - own.delta < TAKEN_UP * lacking:
        return
    found.library.remove(b)
    found.aliased.discard(pool.blocks[b].key)
    found.unknown.append(instead)
    found.drop_needless(found.chance(question))


def _another(found: Found, b: int, axis: int, question: Question, without: Pool) -> int | None:
    """The table over the variable of a name that does not hold, where it explains more than that.

    By the criterion it may be as far behind as the bends are weak of which the name has none: a load that
    saturates is a straight line, roughly, and its table has twenty columns.
    """
    pool, own = found.pool, score(without, [b])
    every = free(pool, on(pool, question.library, {axis}), found.all)
    mine = [c for c in every if len(pool.blocks[c].columns) == 1 and along(pool, c) == along(pool, b)]
    scores = {c: score(without, [c]) for c in mine}
    better = {c: s.criterion for c, s in scores.items() if s.m > own.m and s.delta > own.delta + DECISIVE}
    best = max(better, key=lambda c: better[c], default=None)
    return best if best is not None and better[best] > own.criterion - DECISIVE else None


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
