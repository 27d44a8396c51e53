"""Power-ons that differ as a whole, where nothing tells which: the unit was clamped anew, or it was not one.

Misalignments are angles of elements in a block; from one power-on to the next they move by what the spec
gives them. Where those of several channels scatter by many times as much, the noise has taken up a unit that
stood otherwise in some power-ons, or another unit among few: that is no "nothing is missing", though no
effect is left to be found. And of power-ons that have each a temperature of their own, what goes with the
temperature is what goes with the power-on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner import catalog
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.findings.suspects import DEGREES
from planner.diagnose.noise.components import LEANS
from planner.measurement import AXES
from planner.nouns.diagnosed_spreads import Assumption
from planner.nouns.diagnosis import FoundEffect, ReferenceSuspect, Refused
from planner.temperature_table import temperature_nodes

NAME = "mounting"
TOLD = ("mounting", "mixed_units", "base_tilt", "wrong_label")  # each says already why power-ons differ
FAR = 5.0  # budgets, at the low end of the interval: twice as much may be a budget that was meant well
SEVERAL = 2  # channels; what all three say together counts for them
CHANCE = 1e-6  # of each
OF_LEANS = "misalignment_temperature"
OF_DAYS = "the power-ons differ in how the unit was mounted, or in which unit it was: days tell no more"
WHY = "every power-on has a temperature of its own, and they differ in how the unit was mounted"


def unlike_power_ons(
    every: Sequence[Assumption], wrong: Sequence[ReferenceSuspect]
) -> ReferenceSuspect | None:
    """That misalignments of several channels differ far beyond their budget; None where that is told."""
    if any(s.hypothesis in TOLD and not s.expected for s in wrong):
        return None
    far = [
        a
        for a in every
        if a.error.endswith(f".{LEANS}") and a.part == "run_to_run" and a.chance < CHANCE
        and a.assumed is not None and a.low > FAR * a.assumed
    ]  # fmt: skip
    if sum(1 if a.channel else SEVERAL for a in far) < SEVERAL:
        return None
    most = max(far, key=lambda a: a.measured)
    assumed = (most.assumed or 0.0) * DEGREES
    size = most.measured * DEGREES
    check = (
        f"misalignments of several channels differ from power-on to power-on by {size:.2g} deg, where the "
        f"spec gives {assumed:.2g} deg: look up how the unit was mounted in each, and whether all power-ons "
        "are one unit's; what else is found rests on that"
    )
    channels = [c for a in far for c in _channels(a)]
    return ReferenceSuspect(
        NAME, size, most.low * DEGREES, most.high * DEGREES, "deg",
        tuple(dict.fromkeys(channels)), max(a.chance for a in far), 0.0, check, 0.0, LEANS,
        "power-ons in which the unit stays clamped as it is",
    )  # fmt: skip


def _channels(a: Assumption) -> list[str]:
    return [a.channel] if a.channel else [f"{a.error.split('.')[0]}_{x}" for x in AXES]


def of_their_power_ons(
    effects: Sequence[FoundEffect], data: Prepared
) -> tuple[list[FoundEffect], list[Refused]]:
    """The effects without those that unlike power-ons explain, and these.

    What goes with the days alone is seen between power-ons, and these are not of one unit as it stood once.
    """
    known = catalog.effects()
    days = [e for e in effects if known[e.effect].needs == {"day"}]
    effects = [e for e in effects if e not in days]
    falls = [Refused(e.effect, e.channels, OF_DAYS) for e in days]
    t, starts = data.table.temperature_degc, data.starts
    nodes = temperature_nodes(t)
    at = np.argmin(np.abs(t[:, None] - nodes), axis=1)
    run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(t))))
    if len(np.unique(np.stack([at, run]), axis=1).T) > len(nodes):
        return effects, falls
    leans = [e for e in effects if e.effect == OF_LEANS]
    falls += [Refused(e.effect, e.channels, WHY) for e in leans]
    return [e for e in effects if e not in leans], falls
