"""What a campaign pays for, in seconds: K 2.6, eq. 28, with the ramps that it leaves out.

time = Σ_benches install + Σ_(bench, T) (soak + ramps)
     + Σ_tests Σ_T repeats · (power_on + Σ_motions (move + record + gap) + cool_down)
     − Σ_(bench, T) what of the last cool-down runs during the next ramp and soak, where the spec allows it

The ramps are those of a monotone order (up or down): home → first → … → last → home crosses every stretch
between the extremes, home included, once each way, wherever home lies. That is also the least that any order
takes (planner.solvers.ordering), so one price serves every order; waiting for shifts is not priced.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.plan.bench_work import last_cool_down, overlapped_time, ways_aside
from planner.plan.by_hand import in_room
from planner.spec.attendance import powered_time, record_time
from planner.spec.model import Spec, Test
from planner.spec.plan_choice import Objective


@dataclass(frozen=True, order=True)
class Resource:
    """Something that is paid for once, however many errors use it.

    kind: `install` of a bench, `soak` at a temperature, `stretch` of temperature from `at` to `to` that the
    chamber crosses both ways, one repeat of a test at a temperature (`records`) or in the room
    (`room_records`), `last_cool_down` before a unit leaves a chamber; `overlap`: what is saved (a negative
    price) when any test is made `at` a temperature whose overlapped cool-down is `to` seconds or more
    """

    kind: str
    bench: str
    test: str = ""
    at: float = 0.0
    to: float = 0.0


def weights_of(spec: Spec) -> tuple[float, float]:
    """Weights of campaign time and power-on time; of equal power-on hours the shorter campaign is wanted."""
    minimise = spec.plan.minimise
    if isinstance(minimise, Objective):
        return minimise.time, minimise.power_on
    return (1.0, 0.0) if minimise == "time" else (1e-6, 1.0)


def repeat_time(spec: Spec, test: Test) -> float:
    """Seconds of one repeat: power-on, a move, a record and a gap for every motion, and the cool-down.

    On a ramp also the chamber's way to where its ramps begin, and back.
    """
    bench = spec.benches[test.bench]
    powered = test.power_on + test.motion_count * record_time(bench, test)
    return powered + test.cool_down + sum(ways_aside(spec, test))


def repeat_power_on(spec: Spec, test: Test) -> float:
    """Powered seconds of one repeat: the unit is switched off for the last gap and the cool-down."""
    return powered_time(spec.benches[test.bench], test)


def resources_of(spec: Spec, temperatures: Iterable[float]) -> tuple[Resource, ...]:
    """Every resource that tests at these temperatures could use."""
    places = sorted({*temperatures, spec.plan.temperatures.room})
    found = []
    for name, bench in spec.benches.items():
        found.append(Resource("install", name))
        if bench.chamber is not None:
            found += [Resource("soak", name, at=t) for t in places]
            found += [Resource("stretch", name, at=a, to=b) for a, b in pairwise(places)]
            if last_cool_down(spec, name):
                found.append(Resource("last_cool_down", name))
            further = overlap_levels(spec, name)[1:]
            found += [Resource("overlap", name, at=t, to=o) for t in places for o in further]
    for name, test in spec.tests.items():
        found += [Resource("records", test.bench, name, at=t) for t in places]
        found.append(Resource("room_records", test.bench, name, at=spec.plan.temperatures.room))
    return tuple(found)


def overlap_levels(spec: Spec, bench: str) -> tuple[float, ...]:
    """The different lengths of overlapped cool-down of a bench's tests in its chamber, ascending.

    The longest one among the tests at a temperature is saved there: the first level wherever anything is
    soaked, so it is part of the price of a soak, and the step to every further level that a test reaches.
    """
    inside = [n for n, test in spec.tests.items() if test.bench == bench and not in_room(spec, n)]
    return tuple(sorted({overlapped_time(spec, name) for name in inside})) or (0.0,)


def price(spec: Spec, resource: Resource) -> float:
    """Weighted seconds of one unit of a resource."""
    time, power_on = weights_of(spec)
    bench = spec.benches[resource.bench]
    if resource.kind == "install":
        return time * (bench.install + bench.remove)
    if resource.kind in ("records", "room_records"):
        test = spec.tests[resource.test]
        return time * repeat_time(spec, test) + power_on * repeat_power_on(spec, test)
    chamber = bench.chamber
    assert chamber is not None  # only benches with a chamber offer soaks and stretches
    if resource.kind == "soak":
        return time * (chamber.soak - overlap_levels(spec, resource.bench)[0])
    if resource.kind == "last_cool_down":
        return time * last_cool_down(spec, resource.bench)
    if resource.kind == "overlap":
        return -time * (resource.to - max(o for o in overlap_levels(spec, resource.bench) if o < resource.to))
    there_and_back = sum(1 / speed for speed in (chamber.heating, chamber.cooling) if speed)
    return time * (resource.to - resource.at) * there_and_back


class Tariff:
    """The resources of a spec in a fixed order, their prices, and what a visit of a test uses of each."""

    def __init__(self, spec: Spec, temperatures: Iterable[float]) -> None:
        self.spec = spec
        self.resources = resources_of(spec, temperatures)
        self.prices = np.array([price(spec, resource) for resource in self.resources])
        self._position = {resource: i for i, resource in enumerate(self.resources)}
        self.within = np.array([self._surrounding(resource) for resource in self.resources], dtype=np.int64)

    def amounts(
        self, test: str, temperatures: Iterable[float], repeats: NDArray[np.int64], *, room: bool
    ) -> Array:
        """(L, K) amounts of every resource for `repeats` (L, T) of a test at T temperatures.

        In the room nothing is soaked and the chamber does not move.
        """
        bench = self.spec.tests[test].bench
        used = np.zeros((len(repeats), len(self.resources)))
        used[:, self._position[Resource("install", bench)]] = 1.0
        for column, t in zip(repeats.T, temperatures, strict=True):
            kind = "room_records" if room else "records"
            used[:, self._position[Resource(kind, bench, test, at=t)]] = column
            if not room and self.spec.benches[bench].chamber is not None:
                used[:, self._soak_and_stretches(bench, t)] = 1.0
                used[:, self._overlaps(test, t)] = 1.0
        return used

    def _surrounding(self, resource: Resource) -> int:
        """Nothing overlaps where nothing is soaked."""
        if resource.kind != "overlap":
            return -1
        return self._position[Resource("soak", resource.bench, at=resource.at)]

    def _overlaps(self, test: str, t: float) -> list[int]:
        """What is paid and saved on leaving a temperature and the chamber."""
        bench = self.spec.tests[test].bench
        own, further = overlapped_time(self.spec, test), overlap_levels(self.spec, bench)[1:]
        used = [Resource("overlap", bench, at=t, to=o) for o in further if o <= own]
        used.append(Resource("last_cool_down", bench))
        return [self._position[resource] for resource in used if resource in self._position]

    def _soak_and_stretches(self, bench: str, t: float) -> list[int]:
        low, high = sorted((t, self.spec.plan.temperatures.room))
        return [
            i
            for i, r in enumerate(self.resources)
            if r.bench == bench
            and ((r.kind == "soak" and r.at == t) or (r.kind == "stretch" and r.at >= low and r.to <= high))
        ]
