"""The bound against all campaigns that there are: what a set of temperatures costs and may keep at most."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.information.bound import MOST_SETS_OF_TESTS, Effort, Prover
from planner.information.choose import campaign_found
from planner.information.easiest import EASIER
from planner.information.exchange import CHUNK, Judge
from planner.information.model_of import on_offer
from planner.information.promise import Promise
from planner.information.remembered import Left
from planner.nouns.array import Array
from tests.information import cases
from tests.information.cases import Everything

SEEDS = (1, 4, 5, 21)


def prover(every: Everything) -> Prover:
    judge = Judge(every.promise, np.ones(len(every.promise.asked)), families=list(every.promise.families))
    return Prover(every.flight, every.offers, judge, lambda n: True)


def sets_of(every: Everything, p: Prover, counts: Array) -> dict[int, list[tuple[tuple[int, ...], int]]]:
    """Number of chamber temperatures -> (their places on the grid, which campaign)."""
    found: dict[int, list[tuple[tuple[int, ...], int]]] = {}
    for b, n in enumerate(counts):
        degc = np.unique(every.offers.degc[every.offers.soaked & (n > 0)])
        places = tuple(np.searchsorted(p._grid, degc).tolist())
        found.setdefault(len(places), []).append((places, b))
    return found


@pytest.mark.parametrize("seed", SEEDS)
def test_no_campaign_costs_less_than_its_temperatures(seed: int) -> None:
    every = Everything(cases.flight(cases.tree(seed)))
    counts = every.counts()
    counts = counts[np.all(np.isfinite(every.quick(counts)), axis=1)]
    p, cost = prover(every), every.offers.cost(counts)
    for size, each in sets_of(every, p, counts).items():
        floors = p._floors(np.array([s for s, _ in each], dtype=np.intp).reshape(len(each), size))
        assert np.all(floors <= cost[[b for _, b in each]] + 1e-6)
        assert p._least_floor(size) <= floors.min() + 1e-6


def on_two_benches(second: cases.Tree) -> cases.Tree:
    """Every test of a case on a second bench too, which has other prices."""
    made = needed_and_cheap()
    made["benches"]["other"] = made["benches"]["table"] | second
    made["tests"] = {"faces": made["tests"]["faces"], "rates": made["tests"]["rates"]}
    for test in ("faces", "rates"):
        made["tests"][test] |= {"bench": "table"}
        made["tests"][f"{test}_there"] = made["tests"][test] | {"bench": "other"}
    made["plan"] |= {"repeats": {"least": 1, "most": 1}, "fixed": {}}
    return made


@pytest.mark.parametrize("second", [{}, {"install": "40 min"}], ids=str)
@pytest.mark.further("second", [{"install": "4 min"}])
def test_a_set_costs_no_less_on_two_benches_than_on_the_cheapest_of_each(second: cases.Tree) -> None:
    """What a soak is on one bench or another is paid for once, and by every campaign at its temperature."""
    every = Everything(cases.flight(on_two_benches(second)))
    counts = every.counts()
    counts = counts[np.all(np.isfinite(every.quick(counts)), axis=1)]
    p, cost = prover(every), every.offers.cost(counts)
    for size, each in sets_of(every, p, counts).items():
        floors = p._floors(np.array([s for s, _ in each], dtype=np.intp).reshape(len(each), size))
        least: dict[tuple[int, ...], float] = {}
        for (places, b), floor in zip(each, floors, strict=True):
            assert floor <= cost[b] + 1e-6
            least[places] = min(least.get(places, np.inf), cost[b])
        assert p._least_floor(size) <= floors.min() + 1e-6
        if not second:  # and it is as near as with one bench
            assert floors.min() >= 0.6 * min(least.values())


def test_a_second_bench_of_the_same_kind_leaves_the_bound() -> None:
    made = on_two_benches({})
    alone = {**made, "tests": {k: t for k, t in made["tests"].items() if t["bench"] == "table"}}
    alone["benches"] = {"table": made["benches"]["table"]}
    one, two = (prover(Everything(cases.flight(tree))) for tree in (alone, made))
    for size in range(1, 4):
        assert two._least_floor(size) == pytest.approx(one._least_floor(size))


def test_a_cheap_test_elsewhere_does_not_raise_what_a_needed_one_costs() -> None:
    """The cheap one is made at 12 degC only and tells no scale factor; faces are needed, and may be all."""
    made = needed_and_cheap()
    made["tests"]["static"] |= {"bench": "table"}
    del made["tests"]["static"]["temperatures"]
    made["tests"]["faces"] |= {"motions": 1, "calibrates": ["gyro.bias"]}
    made["benches"] = {"table": made["benches"]["table"]}
    del made["tests"]["rates"], made["unit"]["gyro"]["scale_factor"]
    every = Everything(cases.flight(made))
    counts = every.counts()
    counts = counts[np.all(np.isfinite(every.quick(counts)), axis=1)]
    p, cost = prover(every), every.offers.cost(counts)
    assert [o.test for o in p._needed] == ["static"]
    for size, each in sets_of(every, p, counts).items():
        floors = p._floors(np.array([s for s, _ in each], dtype=np.intp).reshape(len(each), size))
        assert np.all(floors <= cost[[b for _, b in each]] + 1e-6)


def test_temperatures_apart_may_be_cheaper_than_neighbours() -> None:
    """Where a cheap test is offered at both ends only, and the chamber ramps at once."""
    made = needed_and_cheap()
    del made["benches"]["table"]["chamber"]["heating"], made["benches"]["table"]["chamber"]["cooling"]
    made["tests"]["rates"] |= {"temperatures": "room"}
    made["tests"]["static"] |= {"bench": "table", "record": "3000 s"}
    del made["tests"]["static"]["temperatures"]
    made["plan"]["fixed"] = {"faces": {"temperatures": ["-20 degC", "40 degC"]}}
    every = Everything(cases.flight(made))
    counts = every.counts()
    p, cost = prover(every), every.offers.cost(counts)
    for size, each in sets_of(every, p, counts).items():
        floors = p._floors(np.array([s for s, _ in each], dtype=np.intp).reshape(len(each), size))
        assert p._least_floor(size) <= floors.min() + 1e-6
        assert p._least_floor(size) <= cost[[b for _, b in each]].min() + 1e-6


def needed_and_cheap() -> cases.Tree:
    made = cases.tree(0)
    faces = ["gyro.bias", "accelerometer.bias", "accelerometer.scale_factor"]
    timed = {"bench": "table", "motions": 6, "power_on": "30 s"}
    chamber = {"range": ["-60 degC", "80 degC"], "soak": "5 min", "heating": "4 K/min", "cooling": "4 K/min"}
    made["benches"] = {
        "table": {"kind": "rate_table", "axes": 2, "install": "10 min", "chamber": chamber},
        "plain": {"kind": "rate_table", "axes": 2, "install": "10 min"},
    }
    made["tests"] = {
        "static": {**timed, "bench": "plain", "calibrates": faces, "record": "100 s", "temperatures": "room"},
        "rates": {**timed, "calibrates": ["gyro.scale_factor"], "record": "600 s"},
        "faces": {**timed, "calibrates": faces, "record": "10 s"},
    }
    scale = {"scale_factor": {"systematic": "0.5 %", "run_to_run": "0.01 %"}}
    made["unit"] = cases.unit(np.random.default_rng(0), True)
    assert made["unit"]["gyro"]["scale_factor"] == scale["scale_factor"]
    made["effects"] = ["bias", "bias_temperature", "scale_factor"]
    made["plan"] |= {"fixed": {"faces": {"temperatures": ["12 degC"]}}, "repeats": {"least": 1, "most": 2}}
    made["plan"]["temperatures"]["step"] = "20 K"
    return made


@pytest.mark.parametrize("seed", SEEDS[:1])
@pytest.mark.further("seed", SEEDS[1:3])
def test_temperatures_of_a_campaign_that_keeps_its_limits_are_never_ruled_out(seed: int) -> None:
    """Limits that a campaign just keeps: perfect knowledge at its temperatures keeps them too."""
    made = cases.tree(seed)
    every = Everything(cases.flight(made))
    counts = every.counts()
    counts = counts[np.all(np.isfinite(every.quick(counts)), axis=1)]
    for n in counts[np.random.default_rng(seed).choice(len(counts), 3)]:
        exact = every.exact(n)
        limits = np.array(exact.largest)
        p = prover(Everything(cases.flight(cases.limited(made, limits))))
        drawn = np.minimum(exact.figures / every.promise.figures(n[None])[0], 1.0)
        ((size, ((places, _),)),) = sets_of(every, p, n[None]).items()
        some = np.array(places, dtype=np.intp).reshape(1, size)
        assert p._knowledge.may_do(some, drawn)[0]


@pytest.mark.parametrize("seed", SEEDS[:1])
@pytest.mark.further("seed", SEEDS[1:3])
def test_a_proof_without_time_says_less_but_nothing_wrong(seed: int) -> None:
    made = cases.tree(seed)
    every = Everything(cases.flight(made))
    counts = every.counts()
    counts = counts[np.all(np.isfinite(every.quick(counts)), axis=1)]
    most = counts[np.argmax(every.offers.cost(counts))]
    cost = float(every.offers.cost(counts).min())
    for effort in (Effort(0, 0, 0), Effort(1, 1, 1), Effort(10**6, 10**6, 10**6, lambda: True)):
        found = prover(every).bounded(most, effort)
        assert found.bound <= cost + 1e-6
        assert not found.proved or every.offers.cost(found.best[None])[0] <= cost + 1e-6


@pytest.mark.parametrize(("seed", "easy"), [(23, 0.3), (39, 0.3), (76, 0.1), (112, 0.5)])
@pytest.mark.parametrize("patient", [False, True])
def test_the_bound_rises_level_by_level_and_never_above_the_shortest(
    seed: int, easy: float, patient: bool
) -> None:
    """From the dearest campaign that keeps the promise, with time for ever more of the cheaper ones."""
    every = Everything(cases.flight(cases.tree(seed)))
    counts = every.counts()
    price, quick = every.offers.cost(counts), every.quick(counts)
    told = np.all(np.isfinite(quick), axis=1)
    every = Everything(cases.flight(cases.limited(cases.tree(seed), np.quantile(quick[told], easy, axis=0))))
    limits = every.flight.limits
    surely = np.all(quick <= 0.97 * limits, axis=1)
    dearest, shortest = counts[surely][np.argmax(price[surely])], float(price[surely].min())
    p = replace(prover(every), exactly=lambda n: bool(np.all(every.quick(n[None])[0] <= limits)))
    bounds = []
    for campaigns in (0, 3, 10, 30, 100, 300, 10**6):
        found = p.bounded(dearest, Effort(10**6, campaigns, campaigns, patient=patient))
        assert found.bound <= shortest + 1e-6
        assert not found.proved or found.bound == pytest.approx(float(every.offers.cost(found.best[None])[0]))
        bounds.append(found.bound)
    assert found.proved
    assert np.all(np.diff(bounds) >= -1e-6)
    assert len({round(b, 3) for b in bounds}) > (3 if patient else 2)


def test_a_bound_that_all_but_meets_the_cost_is_proved_by_asking_too() -> None:
    """Sets that were not looked at cost as much to rounding: what waits to be asked is asked all the same."""
    every = Everything(cases.flight(cases.tree(39)))
    counts = every.counts()
    price, quick = every.offers.cost(counts), every.quick(counts)
    told = np.all(np.isfinite(quick), axis=1)
    limits = np.quantile(quick[told], 0.3, axis=0)
    p = prover(Everything(cases.flight(cases.limited(cases.tree(39), limits))))
    kept = np.all(quick <= limits, axis=1)
    p = replace(p, exactly=lambda n: bool(np.all(every.quick(n[None])[0] <= limits)))
    dearest, cost = counts[kept][np.argmax(price[kept])], float(price[kept].max())
    effort = Effort(10**6, 10**6, 10**6)
    survivors, _ = p.survivors(cost, effort)
    found = p._counted(sorted(survivors), min(survivors)[0], cost - EASIER / 2, dearest, effort)
    assert found.proved
    assert every.offers.cost(found.best[None])[0] < cost - EASIER


def test_a_campaign_without_soaks_costs_its_tests_in_the_room() -> None:
    """Where the same is on offer in soaked chambers none of them is needed; it seemed to cost nothing."""
    made = needed_and_cheap()
    tests = {name: made["tests"][name] for name in ("faces", "rates")}
    room = {f"{name}_in_the_room": test | {"temperatures": "room"} for name, test in tests.items()}
    made["tests"] = tests | room
    made["plan"] |= {"repeats": {"least": 1, "most": 1}, "fixed": {}}
    every = Everything(cases.flight(made))
    counts = every.counts()
    counts = counts[np.all(np.isfinite(every.quick(counts)), axis=1)]
    unsoaked = ~np.any(counts[:, every.offers.soaked] > 0, axis=1)
    least = every.offers.cost(counts[unsoaked]).min()
    assert 0.0 < prover(every)._least_floor(0) <= least + 1e-6


def test_no_set_is_ruled_out_by_other_curves_than_those_that_judge() -> None:
    """All of this figure is curves: those of the search make it 2 % larger than those that judge."""
    made = cases.tree(3024)
    made["plan"] |= {"seed": 14}
    every = Everything(cases.flight(made))
    one = np.array([0.0, 0.0, 2.0])
    limits = 1.002 * np.array(every.exact(one).largest)
    assert np.any(every.quick(one[None]) > 1.01 * limits)
    found = campaign_found(cases.flight(cases.limited(made, limits)))
    assert found.cost == every.offers.cost(one[None])[0]
    assert found.bound <= found.cost


def offered_fourteen_times() -> cases.Tree:
    """A case whose two tests stand there seven times each, as benches and lengths of records make them."""
    made = needed_and_cheap()
    two = {name: made["tests"][name] for name in ("faces", "rates")}
    made["tests"] = {f"{name}_{i}": test for i in range(7) for name, test in two.items()}
    made["plan"] |= {"fixed": {}}
    return made


def test_which_tests_are_needed_is_not_asked_of_all_their_sets(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fourteen tests have sixteen thousand sets; of eighteen, 7 GB of tables were asked for at once."""
    flight = cases.flight(offered_fourteen_times())
    offers, promise = on_offer(flight)
    sizes: list[int] = []

    def left(self: Promise, counts: Array) -> Left:
        sizes.append(len(counts))
        return [], np.ones(len(counts), dtype=bool)  # nothing tells all that flies

    monkeypatch.setattr(Promise, "left", left)
    found = Prover(flight, offers, Judge(promise), lambda n: True)
    assert found._needed == ()  # of so many nothing is known
    assert max(sizes) <= CHUNK
    assert sum(sizes) <= 14 * MOST_SETS_OF_TESTS
