"""What is done on one bench, before it has a place in time: blocks of actions, and stops at temperatures.

On a bench: install; what is done in the room; then stops at temperatures, each with its tests; remove. One
repeat of a test is one power-on (the run-to-run spread is what repeats average): power_on, then for each
motion a move, a record and a gap; the unit is off during the last gap and the cool-down of the repeat. From
power-on to power-off a repeat is one block: it waits for people before it starts, never in the middle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from planner.nouns.choices import TestVisits
from planner.plan.by_hand import in_room
from planner.solvers.calendar import Calendar, Passage, Span, constant
from planner.spec.attendance import attended_spans, install_attended, off_time, people_at, powered_time
from planner.spec.model import Chamber, Spec, Test
from planner.spec.motions import motions_of
from planner.spec.ramp import half_way, rates_of

MINUTE_S = 60.0


@dataclass(frozen=True)
class Action:
    """A step before it has a place in time; attended: whether people must be there for all of it."""

    id: str
    action: str
    seconds: float
    test: str | None = None
    temperature_degc: float | None = None
    repeat: int | None = None
    motion: Mapping[str, float] | None = None
    attended: bool = False
    temperature_rate_degc_min: float | None = None


@dataclass(frozen=True)
class Block:
    """Actions that follow one another without a pause."""

    actions: tuple[Action, ...]

    @property
    def seconds(self) -> float:
        """How long it takes once it has begun."""
        return sum(a.seconds for a in self.actions)

    @property
    def attended(self) -> tuple[Span, ...]:
        """(start, end) of its attended actions, in seconds from its start."""
        spans, now = [], 0.0
        for a in self.actions:
            if a.attended:
                spans.append((now, now + a.seconds))
            now += a.seconds
        return tuple(spans)


@dataclass(frozen=True)
class Stop:
    """One temperature: its tests in their order with their repeats.

    overlapped_s: so much of the last cool-down runs during the ramp and the soak to what comes next
    """

    temperature_degc: float
    tests: tuple[tuple[str, int], ...]
    overlapped_s: float = 0.0


@dataclass(frozen=True)
class BenchWork:
    """All work on one bench; `before` and `after` the stops are done at room temperature."""

    bench: str
    before: tuple[Block, ...]
    stops: tuple[Stop, ...]
    after: tuple[Block, ...]


def bench_work(spec: Spec, name: str, visits: Sequence[TestVisits]) -> BenchWork:
    """The work of a campaign's visits to one bench; stops from cold to hot."""
    bench, room = spec.benches[name], spec.plan.temperatures.room
    inside = [visit for visit in visits if not in_room(spec, visit.test)] if bench.chamber else []
    blocks = [
        block
        for visit in visits
        if in_room(spec, visit.test)
        for block in test_blocks(spec, visit.test, room, visit.repeats[0], place="room")
    ]
    temperatures = sorted({t for visit in inside for t in visit.temperatures_degc})
    return BenchWork(
        name,
        (*_handling(spec, name, "install", bench.install), *blocks),
        tuple(_stop(spec, t, inside) for t in temperatures),
        (*_last_cool_down(spec, name, inside), *_handling(spec, name, "remove", bench.remove)),
    )


def _handling(spec: Spec, name: str, action: str, seconds: float) -> Iterator[Block]:
    room, attended = spec.plan.temperatures.room, install_attended(spec, name)
    if seconds:
        yield Block((Action(f"{name}/{action}", action, seconds, temperature_degc=room, attended=attended),))


def _stop(spec: Spec, t: float, visits: Sequence[TestVisits]) -> Stop:
    """With overlap the test that cools down longest comes last; else the order is that of the spec.

    Tests on a ramp come behind the soaked ones, which find the temperature as it was soaked.
    """
    tests = [(v.test, v.repeats[v.temperatures_degc.index(t)]) for v in visits if t in v.temperatures_degc]
    tests.sort(key=lambda item: spec.tests[item[0]].ramp is not None)
    overlapped = [overlapped_time(spec, test) for test, _ in tests]
    if max(overlapped) > 0:
        tests.sort(key=lambda item: overlapped_time(spec, item[0]))
    return Stop(t, tuple(tests), max(overlapped))


def overlapped_time(spec: Spec, test: str) -> float:
    """Seconds of a test's last cool-down that may run while the chamber ramps and soaks.

    At most the soak, so that the saving is the same whichever temperature is next: a cool-down that is
    longer than the soak keeps its rest before the ramp.
    """
    chamber = spec.benches[spec.tests[test].bench].chamber
    if chamber is None or "cool_down" not in spec.plan.overlap or in_room(spec, test):
        return 0.0
    return min(off_time(spec.tests[test]), chamber.soak)


def last_cool_down(spec: Spec, name: str) -> float:
    """Seconds to wait before remove, so that the next power-on on a later bench finds the unit cooled down.

    After the last temperature the unit cools down while it is taken home, removed and installed elsewhere;
    what these do not last for must be waited. Zero on the last bench: no record follows.
    """
    names = [bench for bench in spec.benches if any(t.bench == bench for t in spec.tests.values())]
    if name not in names:
        return 0.0
    later = [spec.benches[other].install for other in names[names.index(name) + 1 :]]
    overlapped = max(overlapped_time(spec, t) for t in spec.tests if spec.tests[t].bench == name)
    return max(0.0, overlapped - spec.benches[name].remove - min(later)) if later else 0.0


def _last_cool_down(spec: Spec, name: str, inside: Sequence[TestVisits]) -> Iterator[Block]:
    seconds = last_cool_down(spec, name) if inside else 0.0
    if seconds:
        room = spec.plan.temperatures.room
        yield Block((Action(f"{name}/room/cool_down", "cool_down", seconds, temperature_degc=room),))


def ramp_action(name: str, place: str, t: float, seconds: float) -> Block:
    """The chamber on its way to a temperature."""
    return Block((Action(f"{name}/{place}/ramp", "ramp", seconds, temperature_degc=t),))


def stop_blocks(spec: Spec, name: str, stop: Stop) -> Iterator[Block]:
    """The tests at a temperature, without the part of the last cool-down that overlaps."""
    place = temperature_name(stop.temperature_degc)
    blocks = [
        block
        for test, repeats in stop.tests
        for block in test_blocks(spec, test, stop.temperature_degc, repeats, place)
    ]
    yield from blocks[:-1]
    yield _shortened(blocks[-1], stop.overlapped_s)


def stop_passage(spec: Spec, hours: Calendar, stop: Stop) -> Passage:
    """When the tests of a stop are finished, against when they are ready to begin."""
    total = constant(0.0, hours.period)
    for name, repeats in stop.tests:
        test = spec.tests[name]
        bench = spec.benches[test.bench]
        powered = hours.passage(attended_spans(test.bench, bench, test), powered_time(bench, test))
        there, back = (constant(s, hours.period) for s in ways_aside(spec, test))
        off = constant(off_time(test), hours.period)
        total = total.then(there.then(powered).then(off).then(back).times(repeats))
    return total.earlier(stop.overlapped_s)


def _shortened(block: Block, seconds: float) -> Block:
    """A cool-down without its last seconds; none is left of one that overlaps altogether."""
    if not seconds:
        return block
    (last,) = block.actions
    return Block((replace(last, seconds=last.seconds - seconds),) if last.seconds > seconds else ())


def test_blocks(spec: Spec, name: str, t: float, repeats: int, place: str) -> Iterator[Block]:
    """Two blocks a repeat: powered, and switched off; on a ramp between the chamber's ways aside and back."""
    test = spec.tests[name]
    there, back = ways_aside(spec, test)
    start = t - half_way(test)
    motions = motions_of(test.bench, spec.benches[test.bench], test)
    for r in range(1, repeats + 1):
        run = f"{test.bench}/{place}/{name}/r{r:02d}"
        blank = Action(run, "", 0.0, name, t, r)
        if there:
            aside = replace(blank, id=f"{run}/aside", action="ramp", seconds=there, temperature_degc=start)
            yield Block((aside,))
        yield Block(tuple(_powered(spec, test, motions, blank)))
        if off_time(test):
            cool_down = f"{run}/m{len(motions)}/cool_down"
            rest = replace(blank, id=cool_down, action="cool_down", seconds=off_time(test))
            yield Block((replace(rest, temperature_degc=start),))
        if back:
            yield Block((replace(blank, id=f"{run}/back", action="ramp", seconds=back),))


def _powered(
    spec: Spec, test: Test, motions: Sequence[Mapping[str, float] | None], blank: Action
) -> Iterator[Action]:
    run, bench = blank.id, spec.benches[test.bench]
    switching, moving = people_at(test.bench, bench, test, motions)
    middle = blank.temperature_degc or 0.0
    rates = list(rates_of(test, len(motions)))
    held = replace(blank, temperature_degc=middle - half_way(test))  # between its ramps the chamber stands
    yield replace(held, id=f"{run}/power_on", action="power_on", seconds=test.power_on, attended=switching)
    for m, (motion, people, rate) in enumerate(zip(motions, moving, rates, strict=True), start=1):
        if motion is not None or bench.move:
            move = replace(held, id=f"{run}/m{m}/move", action="move", seconds=bench.move, motion=motion)
            yield replace(move, attended=people)
        record = replace(blank, id=f"{run}/m{m}", action="record", seconds=test.record, motion=motion)
        around = list(_ramps(test, record, rate))
        yield from around
        held = replace(held, temperature_degc=around[-1].temperature_degc)
        if m < len(motions) and test.gap:
            yield replace(held, id=f"{run}/m{m}/pause", action="pause", seconds=test.gap)
    yield replace(held, id=f"{run}/power_off", action="power_off")


def _ramps(test: Test, record: Action, rate: float) -> Iterator[Action]:
    """A record with the ramp that leads to it, and the one after it; alone in a soaked chamber.

    The temperature of a record is that of its middle; of a ramp that of its end.
    """
    if test.ramp is None:
        yield record
        return
    middle, half = record.temperature_degc or 0.0, rate * test.record / 2.0
    moving = replace(record, action="ramp", temperature_rate_degc_min=rate * MINUTE_S)
    lead = replace(moving, seconds=test.ramp.lead, motion=None)
    if test.ramp.lead:
        yield replace(lead, id=f"{record.id}/lead", temperature_degc=middle - half)
    yield replace(record, temperature_rate_degc_min=rate * MINUTE_S)
    end = middle + half + rate * test.ramp.lead
    yield replace(lead, id=f"{record.id}/tail", temperature_degc=end)  # of no time where there is no lead


def ways_aside(spec: Spec, test: Test) -> tuple[float, float]:
    """Seconds of the chamber's way from a test's temperature to where its ramps begin, and of that back."""
    chamber, h = spec.benches[test.bench].chamber, half_way(test)
    return (0.0, 0.0) if chamber is None else (ramp_time(chamber, h, 0.0), ramp_time(chamber, 0.0, h))


def ramp_time(chamber: Chamber, start: float, end: float) -> float:
    """Seconds from one temperature to another."""
    speed = chamber.heating if end > start else chamber.cooling
    return abs(end - start) / speed if speed else 0.0


def temperature_name(t: float) -> str:
    """A temperature as it stands in step ids: `-30`, `-51.43`."""
    return f"{round(t, 2):g}"
