"""The cheapest check that decides a unit: temperatures, tests with their faces, and power-ons.

A power-on of a test has the records X of its motions, noise σ² = N²/duration and run-to-run D; n of them
leave

    cov = (Σ_tests n A (I + D A)⁻¹)⁻¹,     A = XᵀX/σ²

of the terms that they tell (`check_residual`), and the reserve that goes with it. A good unit of a given
load has its residual along what the plan had left of every term; it is decided when every temperature
accepts it, and how often that happens is counted over drawn estimates, by the very rule of `judge`. Of one
unit's hours: install and remove, a ramp from the coldest to the hottest temperature and back to the room,
soaks, power-ons.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import combinations, pairwise

import numpy as np

from planner.errors import InfeasibleError, InputError
from planner.fleet.acceptance import FEWEST_TEMPERATURES, reaches, reserve_after
from planner.fleet.allowed_region import PARTS, AllowedRegion, Reserve
from planner.fleet.check_residual import MeasuredResidual, columns_of, identified
from planner.fleet.judge import ErrorRates, judged
from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.plan.bench_work import ramp_time
from planner.plan.by_hand import even_points
from planner.plan.confidence import spread_at
from planner.plan.motions_to_records import RepeatRecords, repeat_records
from planner.protocols import SENSORS
from planner.simulate.settings import settings_of
from planner.solvers.sequential import boundaries, stopped
from planner.spec.model import Spec

TEMPERATURES = (1, FEWEST_TEMPERATURES, 5)
MOST_POWER_ONS = 200  # a temperature
MOST_TESTS = 3  # used together in one check
DRAWS = 400
LOOKS = 60  # of a check that may stop early: further ones hardly save anything
_SEED = 20240917


@dataclass(frozen=True)
class CheckTest:
    """Records of one kind of power-on. faces: places of its motions that are used; time_s: of one power-on"""

    test: str
    faces: tuple[int, ...]
    time_s: float


@dataclass(frozen=True)
class Check:
    """A check of one unit. power_ons: of every test at every temperature; decides: share of such units

    expected: power-ons a temperature on average when it may stop after each; time_s: of one unit
    """

    temperatures_degc: tuple[float, ...]
    tests: tuple[CheckTest, ...]
    power_ons: int
    time_s: float
    decides: float
    load: float
    expected: float
    looks: int


def planned_checks(
    spec: Spec,
    models: Sequence[ErrorModel],
    region: AllowedRegion,
    load: float,
    share: float,
    rates: ErrorRates,
) -> tuple[Check, ...]:
    """The cheapest check for every number of temperatures, the cheapest of all first.

    load: of the unit, of the limit; share: of such units that must be decided.
    Raises InputError for a load that is none, InfeasibleError when no check decides such units.
    """
    if not 0.0 < load < 1.0:
        raise InputError(f"--load must lie between 0 and 100 % of the limit, not {100 * load:g} %")
    if not 0.0 < share < 1.0:
        raise InputError(f"--decided must lie between 0 and 100 %, not {100 * share:g} %")
    records = {name: own for name in spec.tests if (own := repeat_records(spec, name)) is not None}
    choices = list(_choices(spec, records))
    told = cache(partial(_told, spec, records, models, region))  # a test stands in many choices
    found = []
    for count in TEMPERATURES:
        each = [c for tests in choices for c in _check(spec, told, region, tests, count, load, share, rates)]
        if each:
            found.append(_with_looks(min(each, key=lambda c: (c.time_s, c.power_ons)), share, rates))
    if not found:
        raise InfeasibleError(
            f"no check with up to {MOST_POWER_ONS} power-ons a temperature decides {100 * share:g} % of the "
            f"units at {100 * load:g} % of the limit; what has more room can be decided: a smaller --load"
        )
    return tuple(sorted(found, key=lambda c: c.time_s))


def _choices(spec: Spec, records: Mapping[str, RepeatRecords]) -> Iterator[tuple[CheckTest, ...]]:
    """Tests alone and together, each with all its faces or every second of them."""
    known: dict[str, list[CheckTest]] = {}
    for name, own in records.items():
        test, n = spec.tests[name], len(own.duration)
        move = spec.benches[test.bench].move
        whole, half = tuple(range(n)), tuple(range(0, n, 2))
        known[name] = [
            CheckTest(name, f, test.power_on + len(f) * (move + test.record + test.gap) + test.cool_down)
            for f in ([whole, half] if n >= 4 else [whole])
        ]
    for size in range(1, min(MOST_TESTS, len(known)) + 1):
        for names in combinations(known, size):
            yield from _each([known[n] for n in names])


def _each(options: Sequence[Sequence[CheckTest]]) -> Iterator[tuple[CheckTest, ...]]:
    if not options:
        yield ()
        return
    for one in options[0]:
        for rest in _each(options[1:]):
            yield (one, *rest)


def _check(
    spec: Spec,
    told: Callable[[CheckTest, float], Array],
    region: AllowedRegion,
    tests: Sequence[CheckTest],
    count: int,
    load: float,
    share: float,
    rates: ErrorRates,
) -> Iterator[Check]:
    """The fewest power-ons of these tests that decide, if any do."""
    degc = even_points(*spec.plan.temperatures.range, count) if count > 1 else (spec.plan.temperatures.room,)
    whole = reaches(degc, spec.plan.temperatures.range)
    informations = [np.sum([told(test, t) for test in tests], axis=0) for t in degc]
    each = share ** (1 / count)

    @cache
    def decides(n: int) -> float:
        checks = [measured_by(region, one * n, t, n) for one, t in zip(informations, degc, strict=True)]
        return min(_accepted(region, c, whole, load, rates, count) for c in checks)

    if decides(MOST_POWER_ONS) < each:
        return
    low, high = 0, MOST_POWER_ONS
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if decides(middle) >= each else (middle, high)
    time_s = _time(spec, tests, degc, high)
    yield Check(degc, tuple(tests), high, time_s, decides(high) ** count, load, float(high), 1)


def _with_looks(check: Check, share: float, rates: ErrorRates) -> Check:
    expected, looks = _expected(check.power_ons, share ** (1 / len(check.temperatures_degc)), rates)
    return replace(check, expected=expected, looks=looks)


def _expected(power_ons: int, share: float, rates: ErrorRates) -> tuple[float, int]:
    """Power-ons a temperature on average with a boundary at every look, and the looks that are planned.

    A fixed check of n power-ons decides `share` where the distance is (z_share + z_β)/√n of one; the one that
    may stop gets a quarter more, so that it decides about as many.
    """
    from scipy.special import ndtri

    looks = min(max(int(np.ceil(1.25 * power_ons)), 1), LOOKS)
    if power_ons < 2:
        return float(power_ons), looks
    per_look = 1.25 * power_ons / looks
    drift = float(ndtri(share) - ndtri(rates.bad_accepted)) / np.sqrt(power_ons) * np.sqrt(per_look)
    going_on = np.concatenate([[1.0], stopped(boundaries(rates.bad_accepted, looks), drift)[:-1]])
    return float(going_on.sum() * per_look), looks


def _time(spec: Spec, tests: Sequence[CheckTest], degc: Sequence[float], power_ons: int) -> float:
    """Seconds of one unit."""
    total = 0.0
    for name in dict.fromkeys(spec.tests[t.test].bench for t in tests):
        bench = spec.benches[name]
        here = [t for t in tests if spec.tests[t.test].bench == name]
        total += bench.install + bench.remove + len(degc) * power_ons * sum(t.time_s for t in here)
        if bench.chamber is None:
            continue
        room = spec.plan.temperatures.room
        path = [room, min(degc), max(degc), room]
        for a, b in pairwise(path):
            total += ramp_time(bench.chamber, a, b)
        total += bench.chamber.soak * sum(abs(t - room) > 0 for t in degc)
    return total


def _told(
    spec: Spec,
    records: Mapping[str, RepeatRecords],
    models: Sequence[ErrorModel],
    region: AllowedRegion,
    chosen: CheckTest,
    degc: float,
) -> Array:
    """(t, t) what one power-on tells at one temperature, SI⁻²."""
    size, own, faces = len(region.terms), records[chosen.test], list(chosen.faces)
    information = np.zeros((size, size))
    spread = {m.name: float(np.hypot(spread_at(m, [degc])[0], m.in_run)) for m in models}
    white = settings_of(spec).white
    for sensor in SENSORS:
        columns = columns_of(own.conditions, sensor, models, region)
        for channel in range(3):
            terms = [t for t, X in columns.items() if np.any(X[faces, channel])]
            if not terms:
                continue
            X = np.stack([columns[t][faces, channel] for t in terms], axis=1)
            A = X.T @ (X / (white[sensor] ** 2 / own.duration[faces, None]))
            D = np.diag([spread[region.terms[t].error] ** 2 for t in terms])
            M = np.linalg.solve(np.eye(len(terms)) + A @ D, A)
            information[np.ix_(terms, terms)] += 0.5 * (M + M.T)
    return information


def _accepted(
    region: AllowedRegion, found: MeasuredResidual, whole: bool, load: float, rates: ErrorRates, count: int
) -> float:
    """Share of units of this load that one temperature of the check accepts."""
    reserve = reserve_after(region, found.measured, np.asarray(whole))
    true = at_load(region, found, reserve, load)
    if true is None:
        return 0.0
    values, vectors = np.linalg.eigh(found.covariance)
    draws = np.random.default_rng(_SEED).standard_normal((DRAWS, len(true)))
    seen = true + (draws * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    T = np.stack([region.value(c, seen, reserve) for c in region.constraints], axis=1)
    limit = np.array([c.limit for c in region.constraints])
    margin = judged(region, found, 0.0 * limit, rates, count).to_accept
    return float(np.all(T + margin <= limit, axis=1).mean())


def measured_by(region: AllowedRegion, information: Array, degc: float, power_ons: int) -> MeasuredResidual:
    """What a check of this information measures, the residual itself left at zero."""
    size = len(region.terms)
    scale = np.where(region.allowed > 0, region.allowed, 1.0)
    inside = information * np.outer(scale, scale)
    measured = np.zeros(size, dtype=bool)
    covariance = np.zeros((size, size))
    for channel in dict.fromkeys((ErrorName(t.error).sensor, t.channel) for t in region.terms):
        own = [i for i, t in enumerate(region.terms) if (ErrorName(t.error).sensor, t.channel) == channel]
        told = identified(inside[np.ix_(own, own)][None], np.array(own), region)[0]
        kept = np.array(own)[told]
        measured[kept] = True
        covariance[np.ix_(kept, kept)] = np.linalg.inv(inside[np.ix_(kept, kept)])
    covariance *= np.outer(scale, scale)
    return MeasuredResidual("", degc, 0.0, np.zeros(size), covariance, measured, power_ons, power_ons)


def at_load(region: AllowedRegion, found: MeasuredResidual, reserve: Reserve, load: float) -> Array | None:
    """(t,) a residual of this load along what the plan left of the measured terms; None: no room."""
    left = region.parts[:, [PARTS.index("estimate"), PARTS.index("temperature")]].sum(axis=1)
    along = np.where(found.measured, left, 0.0)
    if float(region.load(0.0 * along, reserve)) >= load or not along.any():
        return None
    low, high = 0.0, 1.0
    while float(region.load(high * along, reserve)) < load:
        high *= 2.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if float(region.load(middle * along, reserve)) < load else (low, middle)
    return np.asarray(low * along)
