"""The last word: what is left on unseen power-ons must fall, and be noise before that is said."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from planner import catalog
from planner.diagnose.shapes.generic import VARIES_WITH, variable_of
from planner.nouns.diagnosis import (
    FoundEffect,
    NavigationCost,
    NotFound,
    ReferenceSuspect,
    Refused,
    ResidualChange,
    UnitDiagnosis,
    Unknown,
    Untestable,
    Verdict,
)

MORE_THAN_NOISE = (
    1.5  # times the noise model's sigma within runs: held-out figures of clean channels stay below
)
FAR_MORE = 3.0  # sigma by the whole covariance, of rows that were fitted
NOTICED = 0.01  # of a requirement's limit
BEYOND_DOUBT = 10.0  # sigma of an effect, from which something is there whatever becomes of its name
FORESEEN = 2.0  # sigma by which rows held out are to be moved: less says nothing, whichever way they go
CONTRADICTS = 3.0  # standard deviations of their fall, by which rows that see little of an effect deny it
MAY_BE = "what varies with {} on {} has no name, and may be it"
RISES = 1.0  # ratio of the held-out residuals within runs, after to before, from which nothing was gained


def refused_by_residual(
    found: UnitDiagnosis, residual: Sequence[ResidualChange]
) -> tuple[UnitDiagnosis, bool]:
    """The diagnosis without the effects that leave more on unseen power-ons; whether any went.

    A table's many values may predict worse than none of them, though that something follows its variable is
    sure: it is left without a name.
    """
    change = {r.channel: r for r in residual if r.held_out and r.split == "runs"}
    stands, falls, rest = [], [], []
    for e in found.effects:
        mine = [change[c] for c in e.channels if c in change]
        if mine and all(_rises(r, e.strength) for r in mine):
            why = "on unseen power-ons the residual does not fall: " + "; ".join(_told(r) for r in mine)
            falls.append(Refused(e.effect, e.channels, why))
            rest += [u for u in _unnamed(e) if e.strength > BEYOND_DOUBT]
        else:
            stands.append(e)
    if not falls:
        return found, False
    unknown = (*found.unknown, *_not_told(rest, found.unknown))
    return _judged(found, effects=tuple(stands), refused=(*found.refused, *falls), unknown=unknown), True


def refused_by_flight(
    found: UnitDiagnosis, cost: Callable[[FoundEffect], Sequence[NavigationCost]]
) -> tuple[UnitDiagnosis, bool]:
    """The diagnosis without the names whose compensation leaves a flight worse; whether any went.

    cost: what one effect by itself costs, requirement by requirement. That something follows the effect's
    variable stays sure: it is left without a name. An effect of the bench does not fly and is not asked.
    """
    stands, falls, rest = [], [], []
    for e in found.effects:
        worse = [] if catalog.effects()[e.effect].bench_only else [c for c in cost(e) if _worse(c)]
        if not worse:
            stands.append(e)
            continue
        falls.append(Refused(e.effect, e.channels, "compensated, a flight is worse: " + _flown(worse[0])))
        rest += _unnamed(e)
    if not falls:
        return found, False
    unknown = (*found.unknown, *rest)
    return _judged(found, effects=tuple(stands), refused=(*found.refused, *falls), unknown=unknown), True


def limits_that_stand(found: UnitDiagnosis) -> UnitDiagnosis:
    """The diagnosis without the limits of effects that what has no name may be.

    It goes with their variable, on their sensor: a settling of 0.006 deg/s that was left without a name, as
    its flight was worse, stood beside "settling: no larger than 0.0015 deg/s".
    """
    left: dict[tuple[str, str], list[str]] = {}
    for u in found.unknown:
        for c in u.channels:
            left.setdefault((c.rsplit("_", 1)[0], u.varies_with), []).append(c)
    known, stands, falls = catalog.effects(), [], []
    for n in found.not_found:
        variable = variable_of(known[n.effect], n.sensor)
        on = left.get((n.sensor, variable or ""), [])
        if on:
            falls.append(Untestable(n.effect, n.sensor, MAY_BE.format(variable, ", ".join(on))))
        else:
            stands.append(n)
    return replace(found, not_found=tuple(stands), untestable=(*found.untestable, *falls))


def told(e: FoundEffect) -> FoundEffect:
    """The effect with those of its coefficients whose intervals leave zero out; as it is where none does."""
    sure = [t for t in e.terms if t.parameter or not t.low <= 0.0 <= t.high]
    return replace(e, terms=tuple(sure)) if any(not t.parameter for t in sure) else e


def _unnamed(e: FoundEffect) -> list[Unknown]:
    """What is left of an effect without its name, channel by channel; nothing of one of the bench."""
    effect = catalog.effects()[e.effect]
    if effect.bench_only:
        return []
    variable = variable_of(effect, e.sensor) or "unexplained"
    inputs = {VARIES_WITH.get(one) for one in effect.needs}
    near = [r.effect for r in e.rivals if r.effect in inputs]  # the nearest first
    if variable in inputs and near:  # of several in which it is a product
        variable = near[0]
    return [Unknown((c,), variable, e.p_value, e.strength) for c in e.channels]


def _not_told(more: Sequence[Unknown], told: Sequence[Unknown]) -> list[Unknown]:
    """Those of which no other unknown says the same already."""
    said = {(c, u.varies_with) for u in told for c in u.channels}
    return [u for u in more if not said & {(c, u.varies_with) for c in u.channels}]


def _worse(c: NavigationCost) -> bool:
    """Whether it is worse by what a plan can notice: what a flight does not excite costs nothing."""
    return not c.helps and c.after - c.left_alone > NOTICED * abs(c.limit)


def _flown(c: NavigationCost) -> str:
    """In SI, as the other refusals are."""
    return f"{c.error} {c.left_alone:.3g} to {c.after:.3g} {'m' if c.unit in ('m', 'km') else 'in SI'}"


def _rises(r: ResidualChange, strength: float) -> bool:
    """Whether neither the residual within runs nor the whole residual falls, which was to see the effect.

    A centrifuge whose power-ons have no repeat is in every fit: rests that were held out say nothing of it.

    Of rows of unlike noise the loudest make the plain residual: loads of 20 to 60 g, whose scale factor every
    power-on draws, rose by 5 % while rests with a sixth of their noise lost half of their squares, and a
    drift of 10 sigma went. With E² what is foreseen, the sum of squares weighed by the inverse covariance
    falls by E² where the name is right, and rises by E² where it followed noise, either give or take 2 E: of
    all figures it is the surest (Neyman, Pearson), and below zero the latter is likelier. It is asked within
    runs, where no level counts, and of whole runs; either way it must fall.

    strength: sigma of the effect by all rows. Rows that see less than a tenth of its square (`sees_little`)
    refuse it only where they contradict it, by a fall of E² − 3 · 2 E and less: a cubic of 26 sigma on an
    arm, whose power-ons have no repeat, went by rests and turns which were to see 3.4 of them.
    """
    if r.foreseen < FORESEEN or r.weighed_falls:
        return False
    if r.sees_little(strength) and r.falls > r.foreseen * (r.foreseen - 2.0 * CONTRADICTS):
        return False
    within = r.within_after >= RISES * r.within_before if math.isfinite(r.within_before) else True
    return bool(within and r.after >= RISES * r.before)


def _told(r: ResidualChange) -> str:
    return f"{r.channel} {r.before:.3g} to {r.after:.3g} in SI"


def _judged(found: UnitDiagnosis, **changes: Any) -> UnitDiagnosis:
    """The diagnosis with some of its findings changed, and the verdict that goes with them."""
    d = replace(found, **changes)
    return replace(d, verdict=verdict_of((*d.effects, *d.faults), d.unknown, d.not_found))


def verdict_of(
    explained: Sequence[FoundEffect | ReferenceSuspect],
    unknown: Sequence[Unknown],
    not_found: Sequence[NotFound],
) -> Verdict:
    """The verdict in a word."""
    if explained:
        return "partly_explained" if unknown else "explained"
    if unknown:
        return "unexplained"
    return "clean" if not_found else "untestable"


def held_to_the_floor(found: UnitDiagnosis, residual: Sequence[ResidualChange]) -> UnitDiagnosis:
    """An unknown on each channel whose residual is more than noise."""
    told = {c for u in found.unknown for c in u.channels}
    told |= {c for s in found.reference_suspects if s.separated_by > 0.0 for c in s.channels}
    known = catalog.effects()  # the bench's geometry is known only so well: its misfit is no other finding
    told |= {c for e in found.effects if known[e.effect].bench_only for c in e.channels}
    more = tuple(
        Unknown((r.channel,), "unexplained", 0.001, r.sigma_after)
        for r in residual
        if r.channel not in told and _more_than_noise(r)
    )
    return _judged(found, unknown=(*found.unknown, *more)) if more else found


def _more_than_noise(r: ResidualChange) -> bool:
    """Whether the residual's interval lies above the floor of replicates, and the noise model agrees.

    On unseen power-ons; or on the rows that were fitted where none can be held out. Few power-ons do not tell
    what a scale factor draws anew, and each turns by its own: there it must be far more by all that is drawn.
    """
    asked = r.weighed_after > FAR_MORE if not r.held_out else r.split == "runs"
    if not (asked and math.isfinite(r.after_low) and math.isfinite(r.noise_floor)):
        return False
    within = math.isfinite(r.sigma_after) and r.sigma_after > MORE_THAN_NOISE
    return bool(within and r.after_low > MORE_THAN_NOISE * r.noise_floor)
