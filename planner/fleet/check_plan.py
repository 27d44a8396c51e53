"""The cheapest check that decides a unit: temperatures, tests with their faces, and power-ons.

A power-on of a test has the records X of its motions, noise σ² = N²/duration and run-to-run D; n of them
leave

    cov = (Σ_tests n A (I + D A)⁻¹)⁻¹,     A = XᵀX/σ²

of the terms that they tell (`check_residual`), and the reserve that goes with it. Good units of a given load
have residuals drawn about what the plan had left of every term; one is decided when every temperature accepts
it, and how often that happens is counted over drawn units and estimates, by the very rule of `judge`. Of one
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
from planner.fleet.check_residual import MeasuredResidual, columns_of, identified, spread_of_power_on
from planner.fleet.judge import ErrorRates, to_accept
from planner.fleet.looks import looks_at
from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.plan.bench_work import ramp_time
from planner.plan.motions_to_records import RepeatRecords, repeat_records
from planner.protocols import SENSORS
from planner.simulate.settings import settings_of
from planner.solvers.distributions import normal_quantile
from planner.solvers.sequential import boundaries, stopped
from planner.spec.even_points import even_points
from planner.spec.model import Spec

TEMPERATURES = (1, FEWEST_TEMPERATURES, 5)
MOST_POWER_ONS = 200  # a temperature
MOST_TESTS = 3  # used together in one check
DRAWS = 400
_SEED = 20240917
_HALVINGS = 25
Drawn = Callable[[tuple[bool, ...]], tuple[Reserve, Array | None]]  # measured flags -> reserve, residuals


@dataclass(frozen=True)
class CheckTest:
    """Records of one kind of power-on. faces: places of its motions that are used; time_s: of one power-on"""

    test: str
    faces: tuple[int, ...]
    time_s: float


@dataclass(frozen=True)
class Check:
    """A check of one unit. power_ons: of every test at every temperature; decides: share of such units

    looks: power-ons a temperature, of all tests, to be planned where it may stop early; expected: of them on
    average; time_s: of one unit
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
    drawn = {w: cache(partial(units_at, region, load, w)) for w in (False, True)}
    found = []
    for count in TEMPERATURES:
        best: Check | None = None
        for tests in choices:
            best = _check(spec, told, drawn, region, tests, count, load, share, rates, best) or best
        if best is not None:
            found.append(_with_looks(best, share, rates))
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
    drawn: Mapping[bool, Drawn],
    region: AllowedRegion,
    tests: Sequence[CheckTest],
    count: int,
    load: float,
    share: float,
    rates: ErrorRates,
    best: Check | None,
) -> Check | None:
    """The fewest power-ons of these tests that decide, if any do in less time than the best so far."""
    degc = even_points(*spec.plan.temperatures.range, count) if count > 1 else (spec.plan.temperatures.room,)
    once, twice = (_time(spec, tests, degc, n) for n in (1, 2))
    most = MOST_POWER_ONS
    if best is not None:
        most = min(most, int(np.ceil((best.time_s - once) / (twice - once))))
    if most < 1:
        return None
    whole = reaches(degc, spec.plan.temperatures.range)
    informations = [np.sum([told(test, t) for test in tests], axis=0) for t in degc]
    each = share ** (1 / count)

    @cache
    def decides(n: int) -> float:
        checks = [measured_by(region, one * n, t, n) for one, t in zip(informations, degc, strict=True)]
        return min(_accepted(region, c, drawn[whole], rates) for c in checks)

    if decides(most) < each:
        return None
    low, high = 0, most
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if decides(middle) >= each else (middle, high)
    time_s = _time(spec, tests, degc, high)
    return Check(degc, tuple(tests), high, time_s, decides(high) ** count, load, float(high), 1)


def _with_looks(check: Check, share: float, rates: ErrorRates) -> Check:
    fixed, count = check.power_ons * len(check.tests), len(check.temperatures_degc)
    expected, looks = _expected(fixed, share ** (1 / count), count, rates)
    return replace(check, expected=expected, looks=looks)


def _expected(power_ons: int, share: float, count: int, rates: ErrorRates) -> tuple[float, int]:
    """Power-ons a temperature on average with a boundary at every look, and the power-ons that are planned.

    All of `count` temperatures go on until each has accepted; share: that one decides with the fixed check.
    A fixed check of n power-ons decides `share` where the distance is (z_share + z_β)/√n of one; the one that
    may stop gets a quarter more, so that it decides about as many.
    """
    each, looks = looks_at(int(np.ceil(1.25 * power_ons)))
    if looks < 2:
        return float(power_ons), each * looks
    drift = float(normal_quantile(share) - normal_quantile(rates.bad_accepted)) * np.sqrt(each / power_ons)
    one_open = np.concatenate([[1.0], stopped(boundaries(rates.bad_accepted, looks), drift)[:-1]])
    going_on = 1.0 - (1.0 - one_open) ** count
    return float(going_on.sum() * each), each * looks


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
    spread = {m.name: float(spread_of_power_on(m, [degc])[0]) for m in models}
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


def _accepted(region: AllowedRegion, found: MeasuredResidual, drawn: Drawn, rates: ErrorRates) -> float:
    """Share of units of the load that one temperature of the check accepts."""
    reserve, true = drawn(tuple(found.measured.tolist()))
    if true is None:
        return 0.0
    values, vectors = np.linalg.eigh(found.covariance)
    draws = np.random.default_rng(_SEED).standard_normal(true.shape)
    seen = true + (draws * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    inside = np.ones(len(seen), dtype=bool)
    for c in region.constraints:
        T = region.value(c, seen, reserve)
        inside &= T + to_accept(c, found, seen, T, rates.bad_accepted) <= c.limit
    return float(inside.mean())


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


def units_at(
    region: AllowedRegion, load: float, whole: bool, measured: tuple[bool, ...]
) -> tuple[Reserve, Array | None]:
    """The reserve, and (DRAWS, t) residuals of this load; None: no room.

    They are drawn about what the plan left of the measured terms: units differ in where their residual lies.
    """
    seen = np.array(measured)
    reserve = reserve_after(region, seen, np.asarray(whole))
    left = region.parts[:, [PARTS.index("estimate"), PARTS.index("temperature")]].sum(axis=1)
    draws = np.random.default_rng(_SEED + 1).standard_normal((DRAWS, len(left)))
    along = np.where(seen, left, 0.0) * draws
    if float(region.load(np.zeros(len(left)), reserve)) >= load or not along.any():
        return reserve, None
    low, high = np.zeros((DRAWS, 1)), np.ones((DRAWS, 1))
    while np.any(inside := region.load(high * along, reserve) < load):
        high[inside] *= 2.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        below = (region.load(middle * along, reserve) < load)[:, None]
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return reserve, np.asarray(low * along)
