"""Names that do not stand beside a reference that is off: what is left of its fault is no sensor's effect.

A fault of the bench is seldom exactly what its hypothesis says: a thermometer lags from a day on, the angle
of a dividing head slips a little more with each record. What the hypothesis leaves of it goes through the
same reference, and looks like several effects of several channels. Three things tell it from an effect that
a sensor has beside the fault:

1. it is left of more than one kind: the channel has a rest that no effect explains as well, or several
   others have one;
2. it is of several channels at once, which a sensor's effect seldom is, and one reference always;
3. it follows the temperature's course (temperature, its rate, time, days), and the thermometer is suspected.
   One that is alone stands where the other channels deny that it is one temperature (`of_one_temperature`).

Of a suspected thermometer only what follows that course is asked; gravity and rates are what they were. Where
no reference is suspected the channels themselves may say so: three of one sensor that each lack something of
a kind, no two the same and one without a name, lack one reference. And so may the power-ons, of which each
has its own size of it (`unlike_sizes`). That something is there, and with what it goes, stays said.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from planner import catalog
from planner.diagnose.findings.of_one_temperature import Temperatures, blocks_of, follows_the_course
from planner.diagnose.shapes.generic import variable_of
from planner.diagnose.vetoes.unlike_sizes import sizes_differ
from planner.diagnose.vetoes.verdicts import LEAST_RUNS
from planner.measurement import AXES
from planner.nouns.diagnosis import FoundEffect, ReferenceSuspect, Refused, Unknown

THERMOMETERS = ("thermometer_lag", "thermometer_offset")
KELVINS = ("K", "degC")
NOT_FITTED = ("wrong_label", "wrong_record", "mixed_units", "stuck_channel")  # their records are left out
COURSE = ("temperature", "time_on", "day", "time_of_day")  # and what begins so: `time_on_and_rate`
SEVERAL = 2  # other channels with a rest: one may lack something of its own beside the fault
WITH_A_REST = "a reference is off ({0}), and its channel has a rest that no effect explains"
RESTS = "a reference is off ({0}), and other channels have rests that no effect explains"
OF_SEVERAL = "a reference is off ({0}), and several channels show it at once"
OF_THE_COURSE = "the thermometer is off ({0}), and it follows the temperature's course"
DIFFERS = "the power-ons differ in its size by as much as it is: it goes with what was done in each"
UNLIKE = "all three channels of the sensor lack something, and not the same: they share their references"


def thermometer_beside(
    effects: Sequence[FoundEffect], wrong: Iterable[ReferenceSuspect], temperatures: Temperatures
) -> list[ReferenceSuspect]:
    """The thermometer, where other channels show one temperature for an effect; none where it is said."""
    said = any(_called(s) in THERMOMETERS and not s.expected for s in wrong)
    return [] if said else list(temperatures.suspects(effects))


def beside_the_bench(
    effects: Sequence[FoundEffect],
    unknown: Sequence[Unknown],
    wrong: Iterable[ReferenceSuspect],
    temperatures: Temperatures,
) -> tuple[list[FoundEffect], list[Refused], list[Unknown]]:
    """The effects that stand, those that do not, and what stays sure of these.

    wrong: suspected references; one that is off by no more than is stated of it suspects nothing else
    """
    suspected = list(dict.fromkeys(_called(s) for s in wrong if not s.expected))
    stands, falls, rest = [], [], []
    for e in effects:
        own = catalog.effects()[e.effect].bench_only
        why = None if own else _why(e, effects, unknown, suspected, temperatures)
        if why is None:
            stands.append(e)
        else:
            falls.append(Refused(e.effect, e.channels, why))
            rest += list(_still_sure(e))
    said = {(c, u.varies_with) for u in unknown for c in u.channels}
    new = {(u.channels, u.varies_with): u for u in rest if (u.channels[0], u.varies_with) not in said}
    return stands, falls, list(new.values())


def _called(s: ReferenceSuspect) -> str:
    """Its hypothesis; of power-ons whose temperature is another than is written, their thermometer."""
    return THERMOMETERS[1] if s.unit in KELVINS else s.hypothesis


def _why(
    e: FoundEffect,
    effects: Sequence[FoundEffect],
    unknown: Sequence[Unknown],
    suspected: Sequence[str],
    temperatures: Temperatures,
) -> str | None:
    """Why a name does not stand; None where it does."""
    course, words = follows_the_course(e.effect), ", ".join(suspected)
    through = [s for s in suspected if s not in THERMOMETERS]
    if course and len(through) < len(suspected):
        stays = _alone(e, effects, unknown) and temperatures.of(e).denied
        if not stays:
            return OF_THE_COURSE.format(words)
    rests = {c for u in unknown for c in u.channels}
    if through and not rests.isdisjoint(e.channels):
        return WITH_A_REST.format(words)
    if through and len(rests.difference(e.channels)) >= SEVERAL:
        return RESTS.format(words)
    if len(e.channels) > 1 and any(s not in NOT_FITTED for s in through):
        return OF_SEVERAL.format(words)
    starts, blocks = temperatures.data.starts, list(blocks_of(e, temperatures.found))
    if len(starts) >= LEAST_RUNS and _all_lack_another(e, effects, unknown):
        return UNLIKE
    return DIFFERS if blocks and all(sizes_differ(s.found, b, starts) for s, b in blocks) else None


def _alone(e: FoundEffect, effects: Sequence[FoundEffect], unknown: Sequence[Unknown]) -> bool:
    """Whether one channel has it, and nothing else follows the temperature's course."""
    others = [x for x in effects if x is not e and follows_the_course(x.effect)]
    return len(e.channels) == 1 and not others and not any(_of_the_course(u) for u in unknown)


def _all_lack_another(e: FoundEffect, effects: Sequence[FoundEffect], unknown: Sequence[Unknown]) -> bool:
    """Whether every channel of its sensor lacks something of its kind, no two the same, one without a name.

    A unit that has two effects on every channel lacks the same on each.
    """
    course = follows_the_course(e.effect)
    alike = [x for x in effects if x.sensor == e.sensor and follows_the_course(x.effect) == course]
    lacks = {(c, x.effect) for x in alike if not catalog.effects()[x.effect].bench_only for c in x.channels}
    rests = {
        (c, f"varies with {u.varies_with}")
        for u in unknown
        for c in u.channels
        if c.startswith(e.sensor) and _of_the_course(u) == course
    }
    lacks |= rests
    apart = len({name for _, name in lacks}) == len(lacks)
    return bool(rests) and apart and len({c for c, _ in lacks}) == len(AXES)


def _of_the_course(u: Unknown) -> bool:
    return u.varies_with.startswith(COURSE)


def _still_sure(e: FoundEffect) -> Iterator[Unknown]:
    """What it varies with, channel by channel."""
    variable = variable_of(catalog.effects()[e.effect], e.sensor) or "unexplained"
    for c in e.channels:
        yield Unknown((c,), variable, e.p_value, e.strength)
