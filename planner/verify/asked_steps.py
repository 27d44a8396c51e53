"""Which steps a spec asks for, counted again from its text alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from planner.spec.model import Spec, Test
from planner.spec.motions import motions_of, turned_by_hand
from planner.verify.findings import Document


@dataclass(frozen=True)
class Expected:
    """One action as the spec has it; block: of which number, for what must not be torn apart."""

    id: str
    action: str
    seconds: float
    temperature: float | None
    test: str | None = None
    repeat: int | None = None
    motion: Mapping[str, float] | None = None
    attended: bool = False
    block: int = 0
    rate: float | None = None  # K/min of a chamber that moves evenly


def expected(document: Document, spec: Spec, name: str, temperatures: Sequence[float]) -> Iterator[Expected]:
    """The actions of one batch on one bench, without waiting."""
    bench, room = spec.benches[name], spec.plan.temperatures.room
    people = bench.attended is not False
    chamber, now, block = bench.chamber, room, 0
    inside = _chamber_tests(document, spec, name)
    if bench.install:
        yield Expected(f"{name}/install", "install", bench.install, room, attended=people, block=block)
    for test in document["tests"]:
        if test["bench"] == name and in_room(spec, test["test"]):
            for e in _repeats(spec, test["test"], room, test["repeats"][0], "room", block):
                block = e.block
                yield e
    for t in temperatures:
        assert chamber is not None
        place = f"{round(t, 2):g}"
        speed = chamber.heating if t > now else chamber.cooling
        if speed and t != now:
            block += 1
            yield Expected(f"{name}/{place}/ramp", "ramp", abs(t - now) / speed, t, block=block)
        if chamber.soak:
            block += 1
            yield Expected(f"{name}/{place}/soak", "soak", chamber.soak, t, block=block)
        for e in _at_temperature(spec, inside, t, place, block):
            block = e.block
            yield e
        now = t
    if chamber and now != room and (speed := chamber.heating if room > now else chamber.cooling):
        block += 1
        yield Expected(f"{name}/room/ramp", "ramp", abs(room - now) / speed, room, block=block)
    wait = _cool_down_before_leaving(spec, name) if inside else 0.0
    if wait:
        block += 1
        yield Expected(f"{name}/room/cool_down", "cool_down", wait, room, block=block)
    if bench.remove:
        yield Expected(f"{name}/remove", "remove", bench.remove, room, attended=people, block=block + 1)


def in_room(spec: Spec, name: str) -> bool:
    """Whether a test is made at room temperature, outside the chamber's cycle."""
    fixed = spec.plan.fixed.get(name)
    said = fixed.temperatures if fixed is not None and fixed.temperatures is not None else None
    said = spec.tests[name].temperatures if said is None else said
    return said == "room" or (said is None and spec.benches[spec.tests[name].bench].chamber is None)


def chamber_temperatures(document: Document, spec: Spec, bench: str) -> list[float]:
    """Temperatures of the tests that are made in a bench's chamber, the coldest first."""
    return sorted({t for _, ts, _ in _chamber_tests(document, spec, bench) for t in ts})


def _chamber_tests(document: Document, spec: Spec, bench: str) -> list[tuple[str, list[float], list[int]]]:
    """(test, temperatures, repeats) of what is done in the chamber, in the order of the spec."""
    found = {t["test"]: t for t in document["tests"] if t["bench"] == bench}
    return [
        (name, [float(x) for x in found[name]["temperatures_degc"]], list(found[name]["repeats"]))
        for name in spec.tests
        if name in found and not in_room(spec, name) and spec.benches[bench].chamber is not None
    ]


def _at_temperature(
    spec: Spec, tests: Sequence[tuple[str, list[float], list[int]]], t: float, place: str, block: int
) -> Iterator[Expected]:
    """The tests of one temperature; where the last cool-down may overlap, the longest one comes last."""
    mine = [(name, repeats[ts.index(t)]) for name, ts, repeats in tests if t in ts]
    soaked = [pair for pair in mine if spec.tests[pair[0]].temperature == "soak"]
    mine = [*soaked, *(pair for pair in mine if pair not in soaked)]
    spared = [_overlap(spec, name) for name, _ in mine]
    if max(spared, default=0.0) > 0:
        mine = [pair for _, pair in sorted(zip(spared, mine, strict=True), key=lambda item: item[0])]
    every = [list(_repeats(spec, name, t, n, place, 0)) for name, n in mine]
    flat = [e for actions in every for e in actions]
    saved = max(spared, default=0.0)
    if saved and flat:
        last = flat[-1]
        rest = last.seconds - saved
        flat[-1:] = [] if rest <= 0 else [replace(last, seconds=rest)]
    number, before = block, None
    for e in flat:
        key = (e.test, e.block)
        number += key != before
        before = key
        yield replace(e, block=number)


def _overlap(spec: Spec, name: str) -> float:
    test = spec.tests[name]
    chamber = spec.benches[test.bench].chamber
    if chamber is None or "cool_down" not in spec.plan.overlap or in_room(spec, name):
        return 0.0
    return min(test.gap + test.cool_down, chamber.soak)


def _cool_down_before_leaving(spec: Spec, name: str) -> float:
    """What the unit must still cool before it may be powered on the next bench."""
    used = [b for b in spec.benches if any(t.bench == b for t in spec.tests.values())]
    later = used[used.index(name) + 1 :]
    if not later:
        return 0.0
    longest = max(_overlap(spec, test) for test in spec.tests if spec.tests[test].bench == name)
    way = spec.benches[name].remove + min(spec.benches[b].install for b in later)
    return max(0.0, longest - way)


def _repeats(spec: Spec, name: str, t: float, repeats: int, place: str, block: int) -> Iterator[Expected]:
    """One power-on a repeat: for every motion a move, a record, a gap; off for the last gap and cool-down."""
    test = spec.tests[name]
    bench = spec.benches[test.bench]
    motions = motions_of(test.bench, bench, test)
    if test.attended is None:
        by_hand: tuple[bool, ...] = turned_by_hand(test.bench, bench, motions)
    else:
        by_hand = (test.attended,) * len(motions)
    start = t - _aside(test)
    for r in range(1, repeats + 1):
        run = f"{test.bench}/{place}/{name}/r{r:02d}"
        if bench.chamber and bench.chamber.cooling and start != t:
            block += 1
            way = (t - start) / bench.chamber.cooling
            yield Expected(f"{run}/aside", "ramp", way, start, name, r, block=block)
        block += 1
        yield from _powered(test, run, t, r, motions, by_hand, bench.move, block)
        off = test.gap + test.cool_down
        if off:
            block += 1
            yield Expected(f"{run}/m{len(motions)}/cool_down", "cool_down", off, start, name, r, block=block)
        if bench.chamber and bench.chamber.heating and start != t:
            block += 1
            yield Expected(
                f"{run}/back", "ramp", (t - start) / bench.chamber.heating, t, name, r, block=block
            )


def _aside(test: Test) -> float:
    """Kelvins from a test's temperature to where its ramps turn: half a record and the lead, at its rate."""
    return 0.0 if test.ramp is None else (test.record / 2.0 + test.ramp.lead) * test.ramp.ramp


def _powered(
    test: Test,
    run: str,
    t: float,
    r: int,
    motions: Sequence[Mapping[str, float] | None],
    by_hand: Sequence[bool],
    move: float,
    block: int,
) -> Iterator[Expected]:
    name = run.split("/")[-2]
    people = bool(test.attended)
    now, aside = t - _aside(test), _aside(test)
    yield Expected(f"{run}/power_on", "power_on", test.power_on, now, name, r, None, people, block)
    for m, motion in enumerate(motions, start=1):
        if motion is not None or move:
            yield Expected(f"{run}/m{m}/move", "move", move, now, name, r, motion, by_hand[m - 1], block)
        if test.ramp is None:
            yield Expected(f"{run}/m{m}", "record", test.record, t, name, r, motion, False, block)
        else:
            up = 1.0 if m % 2 else -1.0
            rate, lead, now = up * 60.0 * test.ramp.ramp, test.ramp.lead, t + up * aside
            met = t - up * test.ramp.ramp * test.record / 2.0
            on = (name, r, None, False, block, rate)
            if lead:
                yield Expected(f"{run}/m{m}/lead", "ramp", lead, met, *on)
            yield Expected(f"{run}/m{m}", "record", test.record, t, name, r, motion, False, block, rate)
            yield Expected(f"{run}/m{m}/tail", "ramp", lead, now, *on)
        if m < len(motions) and test.gap:
            yield Expected(f"{run}/m{m}/pause", "pause", test.gap, now, name, r, None, False, block)
    yield Expected(f"{run}/power_off", "power_off", 0.0, now, name, r, None, False, block)
