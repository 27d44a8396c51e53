"""What a change of the requirement, the bench or the sensor is worth in hours.

Changes of the bench leave the campaign as it is and count its time again. A change of the limit plans again,
briefly. A better sensor is judged on the same campaign: what it eases the promise by is worth what as much
room in the limits is worth.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from planner.information.choose import Found
from planner.information.exchange import Judge, beginnings, eased, shorter, shortest
from planner.information.model_of import Flight
from planner.information.scaled import PARTS, Part, scaled
from planner.information.spreads import figures_with
from planner.nouns.array import Array
from planner.nouns.plan import Price
from planner.nouns.sensor import ErrorName
from planner.plan.costs import weights_of
from planner.plan.schedule_to_steps import makespan
from planner.spec.model import Spec

ROOM = (1.1, 1.3, 2.0)  # limits, as multiples, from which hours against room are known
TIGHTER = 0.9
LOOKED_AT = 60  # campaigns for every other limit
TEN_MINUTES = 600.0
NOTABLE = 0.02  # share of the square that a spread makes, from which on it has a price
WORDS: dict[Part, str] = {
    "run_to_run": "run-to-run",
    "in_run": "in-run",
    "storage": "storage",
    "temperature": "temperature residual",
}


def prices_of(
    flight: Flight, found: Found, parts: Sequence[tuple[ErrorName, Part, float]]
) -> tuple[Price, ...]:
    """Seconds of the campaign for every change; negative saves. parts: (error, part, share of the square)"""
    room = _Room.of(found)
    return (
        *_of_limit(found, room),
        *_of_repeats(flight.spec, found),
        *_of_benches(flight.spec, found),
        *_of_spreads(flight, found, room, parts),
    )


@dataclass(frozen=True)
class _Room:
    """Weighted seconds of the shortest campaigns that are found from the plan, with limits multiplied."""

    factors: Array
    seconds: Array

    @staticmethod
    def of(found: Found) -> _Room:
        """At the plan's own load, and at ROOM beyond it; more room is never worth less."""
        best, seconds = found.counts, [found.cost]
        for factor in ROOM:
            best = shorter(found.offers, found.judge.loosened(factor), best, LOOKED_AT)
            seconds.append(min(float(found.offers.cost(best[None])[0]), seconds[-1]))
        return _Room(np.array([1.0, *ROOM]), np.array(seconds))

    def saved(self, factor: float) -> float:
        """Seconds that room of a factor saves, linear between."""
        return float(self.seconds[0] - np.interp(factor, self.factors, self.seconds))


def _of_limit(found: Found, room: _Room) -> Iterator[Price]:
    percent = 100.0 * (ROOM[0] - 1.0)
    yield Price("limits 1 % wider, on average up to 10 %", -room.saved(ROOM[0]) / percent)
    longer = _longer(found, found.judge.loosened(TIGHTER))
    if longer is not None:
        cost = float(found.offers.cost(longer[None])[0])
        yield Price(
            "limits 1 % tighter, on average up to 10 %", max(cost - found.cost, 0.0) / (100 * (1 - TIGHTER))
        )


def _longer(found: Found, judge: Judge) -> Array | None:
    """(g,) the shortest campaign found for narrower limits, from the plan; None if none keeps them."""
    begun = eased(found.offers, judge, found.counts)
    if begun is not None:
        return shorter(found.offers, judge, begun, LOOKED_AT)
    return shortest(found.offers, judge, LOOKED_AT) if beginnings(found.offers, judge) else None


def _of_repeats(spec: Spec, found: Found) -> Iterator[Price]:
    n, offers = found.counts, found.offers
    for offer in offers.tests:
        used = [k for k in offer.places if n[k] > 0]
        if not used:
            continue
        more = n.copy()
        more[used] += 1
        cost = float(offers.cost(more[None])[0]) - found.cost
        yield Price(f"{offer.test}: one repeat more at each of its temperatures", cost)
        yield Price(f"{offer.test}: one repeat less at each of its temperatures", -cost)
    soaked = sorted({float(offers.degc[k]) for k in np.flatnonzero((n > 0) & offers.soaked)})
    if soaked:
        each = [found.cost - float(offers.cost(np.where(offers.degc == t, 0.0, n)[None])[0]) for t in soaked]
        yield Price("one temperature less, on average", -float(np.mean(each)))


def _of_benches(spec: Spec, found: Found) -> Iterator[Price]:
    now = makespan(spec, found.visits)
    for words, changed in _bench_changes(spec, [v.test for v in found.visits]):
        yield Price(words, (makespan(changed, found.visits) - now) * max(weights_of(spec)[0], 0.0))
    if spec.plan.units is not None:
        for name in dict.fromkeys(spec.tests[v.test].bench for v in found.visits):
            with_one = makespan(spec, found.visits, count={name: spec.benches[name].count + 1})
            chamber = " with its chamber" if spec.benches[name].chamber is not None else ""
            yield Price(f"{name}: one more of it{chamber}", (with_one - now) * max(weights_of(spec)[0], 0.0))


def _bench_changes(spec: Spec, tests: Sequence[str]) -> Iterator[tuple[str, Spec]]:
    used = {spec.tests[name].bench for name in tests}
    for name in [n for n in spec.benches if n in used]:
        bench = spec.benches[name]
        if bench.install > 0:
            less = max(bench.install - TEN_MINUTES, 0.0)
            yield f"{name}: install {_minutes(bench.install, less)} less", _bench(spec, name, install=less)
        chamber = bench.chamber
        if chamber is not None and chamber.soak > 0:
            less = max(chamber.soak - TEN_MINUTES, 0.0)
            soak = chamber.model_copy(update={"soak": less})
            yield f"{name}: soak {_minutes(chamber.soak, less)} less", _bench(spec, name, chamber=soak)
        if chamber is not None and (chamber.heating or chamber.cooling):
            faster = {k: 2.0 * v for k in ("heating", "cooling") if (v := getattr(chamber, k)) is not None}
            yield (
                f"{name}: ramps twice as fast",
                _bench(spec, name, chamber=chamber.model_copy(update=faster)),
            )
        if spec.plan.units is not None:
            yield f"{name}: room for one unit more", _bench(spec, name, units=bench.units + 1)
    for name in tests:
        test = spec.tests[name]
        if test.cool_down > 0:
            less = 0.5 * test.cool_down
            yield f"{name}: cool-down halved", _test(spec, name, cool_down=less)
        yield f"{name}: records 10 % shorter, as accurate", _test(spec, name, record=0.9 * test.record)


def _minutes(now: float, less: float) -> str:
    return f"{(now - less) / 60.0:g} min"


def _bench(spec: Spec, name: str, **changes: object) -> Spec:
    bench = spec.benches[name].model_copy(update=changes)
    return spec.model_copy(update={"benches": {**spec.benches, name: bench}})


def _test(spec: Spec, name: str, **changes: object) -> Spec:
    return spec.model_copy(
        update={"tests": {**spec.tests, name: spec.tests[name].model_copy(update=changes)}}
    )


# ---------------------------------------------------------------- a better sensor


def _of_spreads(
    flight: Flight, found: Found, room: _Room, parts: Sequence[tuple[ErrorName, Part, float]]
) -> Iterator[Price]:
    before = loads_with(flight, found, flight.spec)
    for error, part, share in parts:
        if share >= NOTABLE:
            after = loads_with(flight, found, scaled(flight.spec, error, 0.5, (part,)))
            saved = room.saved(max(before / after, 1.0))
            yield Price(f"{error}: {WORDS[part]} halved", -saved)


def loads_with(flight: Flight, found: Found, spec: Spec) -> float:
    """The load of the same campaign under another error model, by the quick figures."""
    return float((figures_with(flight, found.visits, spec) * found.judge.tightened / flight.limits).max())


def parts_by_share(
    of_error: Mapping[str, float], parts: Mapping[ErrorName, Mapping[str, float]]
) -> list[tuple[ErrorName, Part, float]]:
    """(error, part, share of the square) of every spread, the largest first, by an error's parts."""
    total = sum(of_error.values()) or 1.0
    whole = {error: sum(v**2 for v in own.values()) or 1.0 for error, own in parts.items()}
    found = [
        (error, part, of_error[str(error)] / total * own[part] ** 2 / whole[error])
        for error, own in parts.items()
        for part in PARTS
    ]
    return sorted(found, key=lambda item: -item[2])
