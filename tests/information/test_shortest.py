"""The search against all campaigns of small specs (see benchmarks/study_shortest.py), its laws."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from planner.errors import InfeasibleError
from planner.information import pareto
from planner.information.choose import Found, campaign_found, keeps_exactly
from planner.information.curves import Curves
from planner.information.drawn import ROUGH
from planner.information.exact import foreseen, laid_out
from planner.information.exchange import Judge
from planner.information.model_of import on_offer
from planner.information.pareto import pareto_set
from tests.information import cases
from tests.information.cases import Everything, Tree
from tests.specs import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))
import study_shortest as study

SMALL = 300  # campaigns of a case
SEEDS = (0, 9)
DRAWN = (50002, 51095)  # drawn curves have 1 % less; of the last nothing can be changed


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.further("seed", [1, 5])
def test_no_campaign_is_shorter(seed: int) -> None:
    one = study.judged(seed, SMALL)
    assert one is not None
    assert not one.fault
    assert one.longer <= 1e-9


@pytest.mark.parametrize("seed", DRAWN)
@pytest.mark.further("seed", [50013])  # a seventh less
def test_a_limit_that_only_drawn_curves_keep_is_not_refused(seed: int) -> None:
    one = study.judged(seed, SMALL)
    assert one is not None
    assert not one.fault
    assert one.longer <= 1e-9


# ---------------------------------------------------------------- laws


def limits_of(made: Tree, seed: int) -> np.ndarray:
    """The figures of one campaign of a case, with a little room."""
    every = Everything(cases.flight(made))
    counts = every.counts()
    good = counts[np.all(np.isfinite(every.quick(counts)), axis=1)]
    return np.array(every.exact(good[np.random.default_rng(seed).integers(len(good))]).largest) * 1.01


def found(made: Tree, limits: np.ndarray) -> Found:
    return campaign_found(cases.flight(cases.limited(made, limits)))


def never_longer(before: Found, after: Found) -> None:
    """Within the printed gap of what is easier or has more on offer."""
    assert after.cost <= before.cost + 1e-6 or after.bound <= before.cost + 1e-6
    if after.proved:
        assert after.cost <= before.cost + 1e-6


@pytest.mark.parametrize("seed", [0])
@pytest.mark.further("seed", [1])
def test_a_looser_limit_never_lengthens(seed: int) -> None:
    made = cases.tree(seed)
    limits = limits_of(made, seed)
    never_longer(found(made, limits), found(made, limits * (1.05, 1.3)[seed]))


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [0])
def test_a_better_sensor_never_lengthens(seed: int) -> None:
    made = cases.tree(seed)
    limits = limits_of(made, seed)
    bias = made["unit"]["accelerometer"]["bias"]
    value, word = bias["run_to_run"].split()
    better = bias | {"run_to_run": f"{0.5 * float(value):.9g} {word}"}
    other = made | {
        "unit": made["unit"] | {"accelerometer": made["unit"]["accelerometer"] | {"bias": better}}
    }
    never_longer(found(made, limits), found(other, limits))


@pytest.mark.parametrize("seed", [2])
def test_more_candidate_temperatures_never_lengthen(seed: int) -> None:
    made = cases.tree(seed)
    made["plan"]["temperatures"]["step"] = "20 K"  # -20, 0, 20, 40 degC
    limits = limits_of(made, seed)
    finer = made | {"plan": made["plan"] | {"temperatures": made["plan"]["temperatures"] | {"step": "10 K"}}}
    never_longer(found(made, limits), found(finer, limits))


@pytest.mark.parametrize("seed", [9])
def test_fewer_repeats_at_least_never_lengthen(seed: int) -> None:
    made = cases.tree(seed)
    limits = limits_of(made, seed)
    freer = made | {"plan": made["plan"] | {"repeats": made["plan"]["repeats"] | {"least": 1}}}
    never_longer(found(made, limits), found(freer, limits))


@pytest.mark.parametrize("seed", [4])
def test_one_more_test_on_offer_never_lengthens(seed: int) -> None:
    made = cases.tree(seed)
    made["plan"] = made["plan"] | {"fixed": {t: v for t, v in made["plan"]["fixed"].items() if t != "faces"}}
    made["tests"]["faces"].pop("repeats", None)
    fewer = made | {"tests": {t: v for t, v in made["tests"].items() if t != "faces"}}
    fewer["benches"] = {
        b: v for b, v in made["benches"].items() if any(t["bench"] == b for t in fewer["tests"].values())
    }
    limits = limits_of(fewer, seed)
    never_longer(found(fewer, limits), found(made, limits))


# ---------------------------------------------------------------- refusals, Pareto set


@pytest.mark.parametrize("seed", [0])
@pytest.mark.further("seed", [1, 5])
def test_the_nearest_limit_can_be_met(seed: int) -> None:
    made = cases.tree(seed)
    made["requirement"] = made["requirement"][:1]
    with pytest.raises(InfeasibleError) as refused:
        found(made, np.array([1e-3]))
    nearest = refused.value.nearest_limit
    assert nearest is not None
    every = Everything(cases.flight(made))
    least = every.quick(every.counts())[:, 0].min()
    assert nearest <= 1.012 * least  # no campaign reaches clearly less
    campaign = found(made, np.array([nearest * (1.0 + 1e-5)]))
    assert campaign.foreseen.largest[0] <= nearest * (1.0 + 2e-5)


@pytest.mark.parametrize("seed", SEEDS[:1])
def test_the_genetic_set_is_never_shorter_than_the_bound(seed: int) -> None:
    """At a limit that is hardly met, and at one with room."""
    made = cases.tree(seed)
    made["requirement"] = made["requirement"][:1]
    every = Everything(cases.flight(made))
    counts = every.counts()
    figures = every.quick(counts)[:, 0]
    hardest = figures[np.isfinite(figures)].min()
    for limit in hardest * np.array([1.02, 1.5]):
        plan = found(made, np.array([limit]))
        judge = Judge(plan.judge.promise, np.ones(1), families=list(plan.judge.promise.families))
        points, _ = pareto_set(plan.offers, judge, 1)
        shorter = [p.counts for p in points if p.load <= 1.0 and p.cost < plan.bound - 1e-6]
        assert all(every.exact(n).largest[0] > limit for n in shorter)  # by quick figures only


def test_what_the_genetic_set_shows_is_the_largest_of_all_families(monkeypatch: pytest.MonkeyPatch) -> None:
    """Quick figures had the Matérn curves of a campaign 3 % below the cubic ones; they are 7 % above.

    Here they have three of four families at a hundredth of what these promise.
    """
    for few in ("GENERATIONS", "SHOWN"):
        monkeypatch.setattr(pareto, few, 3)
    made = cases.tree(SEEDS[0])
    one = found(made, limits_of(made, 0))
    promise = one.judge.promise
    assert len(promise.families) > 1
    flight = cases.flight(cases.limited(made, limits_of(made, 0)))
    tight = np.where(np.arange(len(promise.families))[:, None] > 0, 0.01, 1.0) * one.judge.tightened
    shown = pareto.genetic_beside(flight, replace(one, judge=replace(one.judge, tightened=tight)), 1)
    assert shown is not None
    for point, visits in zip(shown.front, shown.campaigns, strict=True):
        exact = foreseen(flight.unseen, laid_out(flight, visits, first_only=True), ROUGH)
        figures = [point[str(i)] for i in range(len(exact.largest))]
        np.testing.assert_allclose(figures, exact.largest, rtol=0.03)  # some are of more draws


def test_what_comes_after_the_search_is_judged_by_quick_figures() -> None:
    """Prices ask for other limits than the spec's: exact figures would forbid what these allow."""
    made = cases.tree(50002)
    one = found(made, limits_of(made, 0))
    forbidding = replace(one.judge, exactly=lambda n: False)
    assert not forbidding.keeps(one.counts)
    assert forbidding.quick().keeps(one.counts) == one.judge.keeps(one.counts)
    assert one.judge.exactly(one.counts + 1) is True


@pytest.mark.parametrize("seed", [0, 50002])
def test_the_promise_is_not_that_of_the_curves_that_chose(seed: int) -> None:
    """The campaign found is the luckiest of thousands under its curves: others, unseen, say what it does."""
    made = cases.tree(seed)
    limits = limits_of(made, 0)
    flight = cases.flight(cases.limited(made, limits))
    one = campaign_found(flight)
    judged = foreseen(flight.unseen, one.timeline).figures
    np.testing.assert_allclose(one.foreseen.figures, judged, rtol=1e-9)
    assert np.all(judged <= limits * (1.0 + 1e-5))
    other = flight.spec.plan.model_copy(update={"seed": flight.spec.plan.seed + 77})
    strange = flight.under(flight.spec.model_copy(update={"plan": other}))
    strange = replace(strange, curves=Curves(strange.spec))
    np.testing.assert_allclose(foreseen(strange.unseen, one.timeline).figures, judged, rtol=0.015)


@pytest.mark.parametrize("limit_m", [75.0, 130.0])
@pytest.mark.further("limit_m", [110.0])
def test_what_only_many_temperatures_keep_is_no_longer_than_one_test_at_all_of_them(limit_m: float) -> None:
    """A flight that warms to the end of the range keeps its limit from no few even temperatures.

    The search then began at all tests with the most repeats: at 75 m it ended 11 % above one test alone, at
    110 and 130 m it refused what that test keeps.
    """
    one = cases.flight(_warming(f"{limit_m:g} m"))
    found = campaign_found(one, effort="brief")
    offers, promise = on_offer(one)
    by_hand = np.array([2.0 if kind.test == "static" else 0.0 for kind in offers.kinds])
    assert keeps_exactly(one, offers, Judge(promise), by_hand)
    assert found.cost <= offers.cost(by_hand[None])[0] + 1e-6


def _warming(limit: str) -> Tree:
    """Two tests on two benches for the same errors, at thirteen temperatures; curves of one fast family."""

    def budget(s: float, left: float, word: str) -> Tree:
        return {
            "systematic": f"{20 * s:g} {word}",
            "run_to_run": f"{0.5 * s:g} {word}",
            "temperature_residual": {1: f"{left:g} {word}", "figure": "sigma", "curve": "cosines"},
        }

    def bench(soak: str) -> Tree:
        chamber = {"range": ["-60 degC", "80 degC"], "heating": "4 K/min", "cooling": "2 K/min", "soak": soak}
        return {"kind": "rate_table", "axes": 2, "install": "10 min", "chamber": chamber}

    scale = "scale_factor"
    static = {"calibrates": ["gyro.bias", "accelerometer.bias", f"accelerometer.{scale}"], "motions": 6}
    rates = {"calibrates": [f"gyro.{scale}"], "motions": 12, "record": "20 s"}
    return {
        "planner": 1,
        "name": "warming",
        "requirement": [{"error": "position", "limit": limit, "rule": "rss", "temperature": "worst"}],
        "trajectory": cases.TRAJECTORIES["warming"],
        "unit": {
            "gyro": {"bias": budget(0.003, 0.033, "deg/s"), scale: budget(0.03, 0.25, "%")},
            "accelerometer": {"bias": budget(1.0, 12.0, "mg"), scale: budget(0.03, 0.4, "%")},
        },
        "effects": ["bias", "bias_temperature", scale, f"{scale}_temperature"],
        "benches": {"table": bench("60 min"), "second": bench("90 min")},
        "tests": {
            "static": static | {"bench": "table", "record": "60 s", "cool_down": "5 min"},
            "rates": rates | {"bench": "second", "cool_down": "5 min"},
        },
        "plan": {
            "temperatures": {"range": ["-20 degC", "40 degC"], "step": "5 K"},
            "repeats": {"least": 2, "most": 2},
        },
    }
