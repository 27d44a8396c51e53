"""Small random specs and everything that can be made of them: the adversary of the search.

Nothing here comes from the search: campaigns are counted out one by one, exact figures are those of the steps
laid out, hours those of the steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import product
from typing import Any

import numpy as np

from planner.information.choose import laid_out
from planner.information.exact import Foreseen, foreseen
from planner.information.model_of import Flight, flight_of, on_offer
from planner.information.offers import Offers
from planner.information.promise import Promise
from planner.nouns.array import Array
from planner.nouns.choices import TestVisits
from planner.nouns.trajectory import Trajectory
from planner.plan.spec_to_trajectory import trajectory_of
from tests.specs import ROOT, loaded

Tree = dict[str, Any]

TRAJECTORIES: dict[str, Tree] = {
    "level": {"name": "level", "duration": "60 s", "sampling_rate": "20 Hz"},
    "static": {"name": "static", "duration": "120 s", "sampling_rate": "20 Hz"},
    "turn": {"name": "turn", "duration": "90 s", "sampling_rate": "20 Hz"},
    "warming": {
        "name": "level",
        "duration": "90 s",
        "sampling_rate": "20 Hz",
        "temperature": {"start": "0 degC", "end": "25 degC"},
    },
}
FAMILIES = ("cosines", "kink", "cubic", "matern")


@cache
def _trajectory(name: str) -> Trajectory:
    return trajectory_of(TRAJECTORIES[name], ROOT)


def flight(tree: Tree) -> Flight:
    """A tree with its flight. Its trajectory is one of TRAJECTORIES."""
    (name,) = (name for name, t in TRAJECTORIES.items() if t == tree["trajectory"])
    return flight_of(loaded(tree).spec, _trajectory(name))


# ---------------------------------------------------------------- random trees


def tree(seed: int) -> Tree:
    """A small spec: at most five candidate temperatures, one to three tests, at most three repeats."""
    rng = np.random.default_rng([seed, 14])
    tests, fixed = _tests(rng)
    least = int(rng.integers(1, 3))
    step = float(rng.choice([15.0, 20.0, 30.0]))
    return {
        "planner": 1,
        "name": f"case {seed}",
        "requirement": [_requirement(rng) for _ in range(1 + int(rng.random() < 0.25))],
        "trajectory": TRAJECTORIES[str(rng.choice(list(TRAJECTORIES)))],
        "unit": unit(rng, "rates" in tests),
        "effects": ["bias", "bias_temperature", *(["scale_factor"] if "rates" in tests else [])],
        "benches": _benches(rng, tests),
        "tests": tests,
        "flown_after": f"{rng.integers(1, 60)} d",
        "plan": {
            "temperatures": {"range": ["-20 degC", "40 degC"], "step": f"{step:g} K"},
            "repeats": {"least": least, "most": least + int(rng.integers(0, 3 if len(tests) < 3 else 2))},
            "fixed": fixed,
            "overlap": ["cool_down"] if rng.random() < 0.3 else [],
            "redundancy": 0,  # all campaigns count here; which may lose a record: test_redundancy
            "genetic": {"generations": 5},
        },
    }


def _requirement(rng: np.random.Generator) -> Tree:
    rule: Any = "rss" if rng.random() < 0.4 else {"percentile": f"{rng.choice([50, 80, 90, 95, 99])} %"}
    warm: list[Any] = [
        "range",
        "worst",
        "flight",
        {"distribution": {"-15 degC": 1, "10 degC": 2, "33 degC": 1}},
    ]
    return {
        "error": str(rng.choice(["position", "horizontal", "north", "east", "up"])),
        "limit": "1000000 m",
        "rule": rule,
        "temperature": warm[int(rng.integers(4))],
    }


def unit(rng: np.random.Generator, scaled: bool) -> Tree:
    """Budgets of gyros and accelerometers whose parts may be nothing; scaled: with scale factors."""

    def sized(largest: float, word: str) -> str:
        return f"{0.0 if rng.random() < 0.15 else largest * rng.uniform(0.1, 1.0):.6g} {word}"

    def budget(s: float, word: str) -> Tree:
        made: Tree = {
            "systematic": f"{20 * s:g} {word}",
            "run_to_run": f"{s * rng.uniform(0.02, 1.0):.6g} {word}",
            "in_run": sized(0.5 * s, word),
            "storage": sized(s, word),
        }
        residual: Tree = {n: f"{c * s:.6g} {word}" for n, c in ((1, 10.0), (3, 3.0), (5, 1.2))}
        if rng.random() < 0.7:
            residual["curve"] = str(rng.choice(FAMILIES))
        if rng.random() < 0.8:
            made["temperature_residual"] = residual
        return made

    scale = {"scale_factor": {"systematic": "0.5 %", "run_to_run": "0.01 %"}} if scaled else {}
    return {
        "noise": {"gyro": "0.1 deg/sqrt(h)", "accelerometer": "0.05 m/s/sqrt(h)"},
        "gyro": {"bias": budget(0.003, "deg/s"), **scale},
        "accelerometer": {"bias": budget(1.0, "mg"), **scale},
    }


def _benches(rng: np.random.Generator, tests: Tree) -> Tree:
    def chamber() -> Tree:
        made: Tree = {"range": ["-60 degC", "80 degC"], "soak": f"{rng.integers(0, 60)} min"}
        if rng.random() < 0.8:
            made |= {
                "heating": f"{rng.uniform(0.5, 20):.3g} K/min",
                "cooling": f"{rng.uniform(0.5, 20):.3g} K/min",
            }
        return made

    each = {
        "table": {
            "kind": "rate_table",
            "axes": 2,
            "install": f"{rng.integers(0, 40)} min",
            "chamber": chamber(),
        },
        "second": {
            "kind": "rate_table",
            "axes": 2,
            "install": f"{rng.integers(0, 40)} min",
            "chamber": chamber(),
        },
        "plain": {"kind": "rate_table", "axes": 2, "install": f"{rng.integers(0, 40)} min"},
    }
    return {name: each[name] for name in dict.fromkeys(t["bench"] for t in tests.values())}


def _tests(rng: np.random.Generator) -> tuple[Tree, Tree]:
    """One to three tests of six faces or six turns; each may be fixed by hand, or in the room."""

    turned = rng.random() < 0.55

    def timed(bench: str, errors: list[str]) -> Tree:
        return {
            "bench": bench,
            **({"temperatures": "room"} if bench == "plain" else {}),
            "calibrates": errors,
            "motions": 6,
            "power_on": f"{rng.integers(0, 300)} s",
            "record": f"{rng.integers(10, 200)} s",
            "cool_down": f"{rng.integers(0, 40)} min",
        }

    static = ["gyro.bias", "accelerometer.bias", *(["accelerometer.scale_factor"] if turned else [])]
    tests: Tree = {"static": timed("table", static)}
    if turned:
        other = str(rng.choice(["table", "second", "plain"]))
        tests["rates"] = timed(other, ["gyro.scale_factor"])
    if rng.random() < 0.4:
        tests["faces"] = timed(str(rng.choice(["table", "second", "plain"])), static)
    return tests, {name: by_hand for name in tests if (by_hand := _by_hand(rng, tests[name]))}


def _by_hand(rng: np.random.Generator, test: Tree) -> Tree:
    found: Tree = {}
    if test["bench"] != "plain" and rng.random() < 0.25:
        chosen: list[Any] = ["room", 2, ["12 degC"], ["-20 degC", "33 degC"], ["20 degC"]]
        found["temperatures"] = chosen[int(rng.integers(len(chosen)))]
    if rng.random() < 0.2:
        found["repeats"] = int(rng.integers(1, 4))
    return found


# ---------------------------------------------------------------- all that can be made of one


@dataclass(frozen=True)
class Everything:
    """All campaigns of a flight's spec. Exact figures are kept."""

    flight: Flight

    @cached_property
    def _offer(self) -> tuple[Offers, Promise]:
        return on_offer(self.flight)

    @property
    def offers(self) -> Offers:
        """What is on offer."""
        return self._offer[0]

    @property
    def promise(self) -> Promise:
        """The quick model of the promise."""
        return self._offer[1]

    @property
    def size(self) -> float:
        """How many campaigns there are at most."""
        return float(np.prod([float(len(ways)) for ways in self._ways()]))

    def _ways(self) -> list[list[tuple[float, ...]]]:
        """Per test all it may be: repeats at each of its places."""
        found = []
        for o in self.offers.tests:
            n = len(o.places)
            free = range(o.least, o.most + 1)
            if o.fixed is not None:
                ways: list[tuple[float, ...]] = [tuple(map(float, o.fixed))]
            elif o.everywhere:
                ways = [(0.0,) * n, *product(map(float, free), repeat=n)]
            else:
                ways = list(product((0.0, *map(float, free)), repeat=n)) if (len(free) + 1) ** n < 1e6 else []
            found.append(ways)
        return found

    def counts(self) -> Array:
        """(B, g) every campaign with a record in it."""
        ways = [np.array(w, dtype=np.float64) for w in self._ways()]
        places = np.concatenate([o.places for o in self.offers.tests])
        total = np.zeros((1, 0))
        for w in ways:
            total = np.hstack([np.repeat(total, len(w), axis=0), np.tile(w, (len(total), 1))])
        n = np.zeros((len(total), len(self.offers.kinds)))
        n[:, places] = total
        return n[(n > 0).any(axis=1)]

    def quick(self, counts: Array) -> Array:
        """(B, requirements) the largest quick figure over the families."""
        some = [self.promise.figures(counts[k : k + 512]).max(axis=1) for k in range(0, len(counts), 512)]
        return np.concatenate(some) if some else np.empty((0, len(self.promise.asked)))

    def exact(self, n: Array) -> Foreseen:
        """What the steps of one campaign promise, under the curves by which a plan is judged."""
        return foreseen(self.flight.unseen, laid_out(self.flight, self.offers.visits(n)))

    def hours(self, n: Array) -> float:
        """Seconds of its steps."""
        return max(s.end_s for s in laid_out(self.flight, self.offers.visits(n)))

    def shorter(self, counts: Array, cost: float, loads_of: Array, margin: float) -> Iterator[Array]:
        """Campaigns that cost less and keep the limits exactly; asked are those that quickly come near."""
        prices = self.offers.cost(counts)
        limits = np.array([r.limit.si for r in self.flight.spec.requirement])
        for i in np.argsort(prices, kind="stable"):
            near = prices[i] < cost - 1e-6 and loads_of[i] <= margin
            if near and np.all(np.array(self.exact(counts[i]).largest) <= limits * (1.0 + 1e-6)):
                yield counts[i]


def limited(made: Tree, values: Array) -> Tree:
    """The tree with limits (requirements,) in SI."""
    wanted = [r | {"limit": f"{v:.9g} m"} for r, v in zip(made["requirement"], values, strict=True)]
    return made | {"requirement": wanted}


def visits(*each: tuple[str, tuple[float, ...], tuple[int, ...]]) -> tuple[TestVisits, ...]:
    """(test, temperatures, repeats) as visits."""
    return tuple(TestVisits(t, degc, n) for t, degc, n in each)


def counts_of(offers: Offers, made: Sequence[TestVisits]) -> Array:
    """(g,) counts of visits, each of which is on offer."""
    n = np.zeros(len(offers.kinds))
    for visit in made:
        offer = next(o for o in offers.tests if o.test == visit.test)
        for t, repeats in zip(visit.temperatures_degc, visit.repeats, strict=True):
            n[next(k for k in offer.places if abs(offers.kinds[k].temperature_degc - t) < 1e-6)] = repeats
    return n
