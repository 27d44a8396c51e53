"""Names that do not stand beside a reference that is off: what is left of its fault is no sensor's effect.

A fault of the bench is seldom exactly what its hypothesis says: a thermometer lags from a day on, the angle
of a dividing head slips a little more with each record. What the hypothesis leaves of it goes through the
same reference, and looks like several effects of several channels. Three things tell it from an effect that
a sensor has beside the fault:

1. it is left of more than one kind: the channel has a rest that no effect explains as well, or several
   others have one;
2. it is of several channels at once, which a sensor's effect seldom is, and one reference always; two names
   over one variable count as such, and a lean where it is in doubt how the unit stands;
3. it follows the temperature's course (temperature, its rate, time, days), and the thermometer is suspected.
   One that is alone stands where the other channels deny that it is one temperature (`of_one_temperature`).

Of a suspected thermometer only what follows that course is asked; gravity and rates are what they were. Where
no reference is suspected the channels themselves may say so: three of one sensor that each lack something of
a kind, no two the same and one without a name, lack one reference; so do those that lack one law (`one_law`),
channels of both sensors that follow how the temperature moved, or that have rests over what the name goes
with. Other channels may show a part of a temperature (`of_one_temperature`), the channel's own rests that its
equation is not what is there, and the power-ons may each have their own size of it (`unlike_sizes`). That
something is there, and with what it goes, stays said.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import replace

from planner import catalog
from planner.diagnose.findings.of_one_temperature import Temperatures, blocks_of, follows_the_course
from planner.diagnose.findings.one_law import OneLaw
from planner.diagnose.shapes.generic import variable_of
from planner.diagnose.vetoes.unlike_sizes import sizes_differ
from planner.diagnose.vetoes.verdicts import LEAST_RUNS
from planner.measurement import AXES
from planner.nouns.diagnosis import FoundEffect, ReferenceSuspect, Refused, Unknown
from planner.nouns.sensor import channel_name

THERMOMETERS = ("thermometer_lag", "thermometer_offset")
KELVINS = ("K", "degC")
NOT_FITTED = ("wrong_label", "wrong_record", "mixed_units", "stuck_channel")  # their records are left out
OF_ONE_CHANNEL = ("wrong_record", "stuck_channel")  # where they name one: its recording, not the bench
COURSE = ("temperature", "time_on", "day", "time_of_day")  # and what begins so: `time_on_and_rate`
MOVES = "temperature_rate"
TURNED = ("mounting", "base_tilt", "wrong_label")  # of how the unit stands
ALMOST_ALL = 5  # channels, of both sensors: what one sensor has is on its own three
SEVERAL = 2  # other channels with a rest: one may lack something of its own beside the fault
WITH_A_REST = "a reference is off ({0}), and its channel has a rest that no effect explains"
RESTS = "a reference is off ({0}), and other channels have rests that no effect explains"
OF_SEVERAL = "a reference is off ({0}), and several channels show it at once"
OF_THE_COURSE = "the thermometer is off ({0}), and it follows the temperature's course"
DIFFERS = "the power-ons differ in its size by as much as it is: it goes with what was done in each"
ONE_LAW = "all three channels of the sensor lack the same over their own inputs: one law, their reference's"
LEANS_TOO = "a reference is off ({0}), and a unit that stands otherwise is a misalignment that changes"
MANY = "many channels have rests without a name that go with the same: they share what they are judged by"
RESTS_OF_ITS_OWN = "its channel has several rests that no effect explains: it is one of them"
KINDS = "its sensor's channels follow the temperature's course by several names each, and not by the same"
RECORDER = "some of its records are not what it read: what is left of the others is the recorder's too"
OF_ALL = "nearly all channels of both sensors follow how the temperature moved: they share its thermometer"
SHARED = "other channels show a part of it, each by the slope of its own curve over temperature"
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
    laws: Sequence[OneLaw] = (),
) -> tuple[list[FoundEffect], list[Refused], list[Unknown]]:
    """The effects that stand, those that do not, and what stays sure of these.

    wrong: suspected references; one that is off by no more than is stated of it suspects nothing else
    """
    wrong = [s for s in wrong if not s.expected]
    suspected = list(dict.fromkeys(_called(s) for s in wrong))
    recorded = {s.channels[0] for s in wrong if s.hypothesis in OF_ONE_CHANNEL and len(s.channels) == 1}
    stands, falls, rest = [], [], []
    for e in (part for whole in effects for part in _parts(whole, temperatures)):
        if catalog.effects()[e.effect].bench_only:
            why = None
        elif any(law.takes(e) for law in laws):
            why = ONE_LAW
        elif _of_the_recorder(e, recorded):
            why = RECORDER
        else:
            why = _why(e, effects, unknown, suspected, temperatures)
        if why is None:
            stands.append(e)
        else:
            falls.append(Refused(e.effect, e.channels, why))
            rest += list(_still_sure(e))
    said = {(c, u.varies_with) for u in unknown for c in u.channels}
    new = {(u.channels, u.varies_with): u for u in rest if (u.channels[0], u.varies_with) not in said}
    return stands, falls, list(new.values())


def _of_the_recorder(e: FoundEffect, recorded: Set[str]) -> bool:
    """Whether an effect may be what wrong records left: a power-on of which some are has another level.

    recorded: the channels of which it is the recording that is wrong
    """
    in_it = follows_the_course(e.effect) and recorded >= set(e.channels)
    return in_it or len(recorded) >= len(AXES)


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
    variable = variable_of(catalog.effects()[e.effect], e.sensor)
    fitted = any(s not in NOT_FITTED for s in through)
    if fitted and (len(e.channels) > 1 or not _others_by(variable, effects).issubset(e.channels)):
        return OF_SEVERAL.format(words)
    if catalog.effects()[e.effect].group == "misalignment" and not set(TURNED).isdisjoint(suspected):
        return LEANS_TOO.format(words)
    alike = {c for u in unknown if u.varies_with == variable for c in u.channels}
    if len(alike.difference(e.channels)) >= len(AXES) and len(alike.union(e.channels)) >= ALMOST_ALL:
        return MANY
    if course and _of_no_one_kind(e, effects):
        return KINDS
    its_own = [{u.varies_with for u in unknown if c in u.channels} for c in e.channels]
    if all(len(own) >= SEVERAL or variable in own for own in its_own):
        return RESTS_OF_ITS_OWN
    if _moves(e) and len(_all_that_move(effects, unknown)) >= ALMOST_ALL:
        return OF_ALL
    if course and temperatures.of(e).shared:
        return SHARED
    starts = temperatures.data.starts
    if len(starts) >= LEAST_RUNS and _all_lack_another(e, effects, unknown):
        return UNLIKE
    return DIFFERS if _differing(e, temperatures) == set(e.channels) else None


def _parts(e: FoundEffect, temperatures: Temperatures) -> Iterator[FoundEffect]:
    """An effect, or apart from each other its channels whose power-ons agree on its size, and the others.

    One channel has it, and the bench makes the same of the next one, in a part of the records.
    """
    off = _differing(e, temperatures) if len(e.channels) > 1 else set()
    if not off or off == set(e.channels):
        yield e
        return
    for some in (off, set(e.channels) - off):
        channels = tuple(c for c in e.channels if c in some)
        terms = tuple(t for t in e.terms if t.channel in some or not t.channel)
        yield replace(e, channels=channels, terms=terms)


def _differing(e: FoundEffect, temperatures: Temperatures) -> set[str]:
    """The channels whose power-ons do not agree on its size, or all where they share a block."""
    data, off = temperatures.data, set()
    for s, b in blocks_of(e, temperatures.found):
        if sizes_differ(s.found, b, data.starts, data.table.bench):
            off |= {channel_name(s.sensor, axis) for axis in s.found.pool.blocks[b].columns}
    return off


def _of_no_one_kind(e: FoundEffect, effects: Sequence[FoundEffect]) -> bool:
    """Whether two names of the course are on a channel of its sensor, and others on another channel.

    Two effects of every channel are the same on each.
    """
    names: dict[str, set[str]] = {}
    for x in effects:
        for c in x.channels if x.sensor == e.sensor and follows_the_course(x.effect) else ():
            names.setdefault(c, set()).add(x.effect)
    sets = list(names.values())
    return max(map(len, sets), default=0) > 1 and any(one != sets[0] for one in sets)


def _moves(e: FoundEffect) -> bool:
    """Whether an effect follows how the temperature moved; that a unit warms itself is its own."""
    return MOVES in catalog.effects()[e.effect].needs


def _all_that_move(effects: Sequence[FoundEffect], unknown: Sequence[Unknown]) -> set[str]:
    """The channels that follow it, with a name or without."""
    named = {c for e in effects if _moves(e) for c in e.channels}
    return named | {c for u in unknown if u.varies_with == MOVES for c in u.channels}


def _others_by(variable: str | None, effects: Sequence[FoundEffect]) -> set[str]:
    """The channels of sensors' effects that go with one variable."""
    known = catalog.effects()
    alike = (x for x in effects if not known[x.effect].bench_only)
    return {c for x in alike if variable_of(known[x.effect], x.sensor) == variable for c in x.channels}


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
