"""A genetic campaign beside the plan, and the Pareto set of hours, accuracy and power-on hours.

NSGA-II (Deb et al., IEEE Trans. Evol. Comput. 6, 2002; DEAP's selection) over the counts that the plan is
made of. A whole generation is judged at once by the model of the promise, so that it costs as much as its
information does. Where an individual breaks the promise it is not lost: what it would cost to promise less is
what the set shows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from planner.information.choose import Found, is_kept
from planner.information.drawn import DRAWS, ROUGH
from planner.information.even import even
from planner.information.exact import foreseen, laid_out
from planner.information.exchange import Judge
from planner.information.model_of import Flight
from planner.information.offers import Offer, Offers
from planner.information.spreads import spread_factors
from planner.nouns.allowances import GeneticHistory
from planner.nouns.array import Array
from planner.nouns.deadline import never
from planner.nouns.plan import GeneticPlan
from planner.plan.costs import repeat_power_on

INDIVIDUALS, GENERATIONS = 40, 24
USELESS = 4.0  # loads from which on an individual counts as breaking the promise alike
SHOWN = 10  # each is foreseen exactly, which takes as long as for the plan itself
TRIED = 6
ALIKE = (
    0.03  # share of the largest by which quick figures of two families may be the wrong way round: 0.01 was
)


@dataclass(frozen=True)
class Point:
    """One campaign of the set: counts (g,), weighted seconds, load (share of a limit), power-on s."""

    counts: Array
    cost: float
    load: float
    power_on_s: float


def pareto_set(
    offers: Offers,
    judge: Judge,
    seed: int,
    late: Callable[[], bool] = never,
    families: Sequence[str] | None = None,
) -> tuple[list[Point], GeneticHistory]:
    """The Pareto set that the genetic algorithm found, the shortest first, and how it got there.

    families: of curves, under which loads are the largest; None: those that have decided in the search
    """
    from deap import tools

    rng = np.random.default_rng(seed)
    powered = np.array([repeat_power_on(offers.spec, offers.spec.tests[k.test]) for k in offers.kinds])

    def judged(every: Sequence[Array]) -> list[_Individual]:
        return _judged(offers, judge, every, powered, families or judge.families)

    people = judged([_individual(offers, rng) for _ in range(INDIVIDUALS)])
    people = tools.selNSGA2(people, INDIVIDUALS, nd="log")
    best: list[float] = []
    mean: list[float] = []
    kept = list(people)
    for _ in range(GENERATIONS):
        if late():
            break
        children = [_child(offers, people, rng) for _ in range(INDIVIDUALS)]
        people = tools.selNSGA2([*people, *judged(children)], INDIVIDUALS, nd="log")
        kept += people
        keeping = [p.point.cost for p in people if p.point.load <= 1.0]
        best.append(min([*keeping, *best[-1:]], default=float("nan")))
        mean.append(float(np.mean([p.point.cost for p in people])))
    points = sorted(undominated([p.point for p in kept if p.point.load < USELESS]), key=lambda p: p.cost)
    evaluations = INDIVIDUALS * (len(best) + 1)
    history = GeneticHistory(
        tuple(best), tuple(mean), len(best), evaluations, "time" if len(best) < GENERATIONS else "generations"
    )
    return points, history


def undominated(points: Sequence[Point]) -> list[Point]:
    """The distinct points than which none is better in cost, load and power-on together."""
    distinct = [*{p.counts.tobytes(): p for p in points}.values()]
    of = np.array([[p.cost, p.load, p.power_on_s] for p in distinct]).reshape(-1, 3)
    return [distinct[i] for i in np.flatnonzero(_is_best(of))]


def _is_best(of: Array) -> NDArray[np.bool_]:
    """(n,) rows (n, k) than which no other is as small in everything and smaller in something."""
    better = (of[:, None] <= of[None, :]).all(axis=2) & (of[:, None] < of[None, :]).any(axis=2)
    return np.asarray(~better.any(axis=0))


def genetic_beside(
    flight: Flight, found: Found, seed: int, late: Callable[[], bool] = never
) -> GeneticPlan | None:
    """The genetic campaign beside the plan with its gap; None where it found none that keeps the promise.

    The search goes by quick figures; what is shown, and that a campaign keeps the promise, by exact ones.
    """
    if late():
        return None
    families = _binding(found.judge, found.counts)
    points, history = pareto_set(found.offers, found.judge, seed, late, families)
    shown = _exactly(flight.unseen, found, points, late)
    keeping = [p.cost for p in shown if p.keeps]
    if not keeping:
        return None
    best = min(keeping)
    gap = max(0.0, best - found.cost) / found.cost if found.cost else 0.0
    front = _undominated(shown)
    return GeneticPlan(
        round(best, 6),
        gap,
        history,
        tuple(_figures(p) for p in front),
        tuple(found.offers.visits(p.point.counts) for p in front),
    )


@dataclass(frozen=True)
class _Exact:
    """A point by its exact figures (requirements,), SI; keeps: whether with them every limit is kept."""

    point: Point
    figures: Array
    keeps: bool

    @property
    def cost(self) -> float:
        return self.point.cost


def _exactly(flight: Flight, found: Found, points: Sequence[Point], late: Callable[[], bool]) -> list[_Exact]:
    """At most SHOWN of the points, from the shortest on; and of those that keep the promise, the shortest.

    As many of these are tried as it takes until one keeps it exactly, within TRIED.
    """
    places = np.unique(np.linspace(0, len(points) - 1, min(SHOWN, len(points))).astype(int))
    known: dict[int, _Exact] = {}
    keeping = (i for i, p in enumerate(points) if p.load <= 1.0 and found.judge.keeps(p.counts))
    for i in islice(keeping, TRIED):
        known[i] = _exact(flight, found, points[i], DRAWS)
        if known[i].keeps or late():
            break
    for i in places.tolist():
        if late():
            break
        if i not in known:
            known[i] = _exact(flight, found, points[i], ROUGH)
    return [known[i] for i in sorted(known)]


def _binding(judge: Judge, n: Array) -> list[str]:
    """The families under one of which, by quick figures, some figure of a campaign (g,) is the largest."""
    figures = judge.promise.figures(n[None])[0] * judge.tightened
    near = (figures >= (1.0 - ALIKE) * figures.max(axis=0)).any(axis=1)
    return [name for name, is_near in zip(judge.promise.families, near, strict=True) if is_near]


def _exact(flight: Flight, found: Found, point: Point, draws: int) -> _Exact:
    """Under all families: of a few temperatures quick figures put two of them the wrong way round by 7 %."""
    visits = found.offers.visits(point.counts)
    exact = foreseen(flight, laid_out(flight, visits, first_only=True), draws)
    keeps = is_kept(flight, exact.figures, spread_factors(flight, visits)) and found.judge.allowed(
        point.counts
    )
    return _Exact(point, np.array(exact.largest), keeps)


def _undominated(shown: Sequence[_Exact]) -> list[_Exact]:
    """Those than which none is better in cost, power-on and every figure together."""
    of = np.array([[p.cost, p.point.power_on_s, *p.figures] for p in shown])
    return [shown[i] for i in np.flatnonzero(_is_best(of) & np.isfinite(of).all(axis=1)).tolist()]


def _figures(p: _Exact) -> dict[str, float]:
    """Hours, power-on hours and the figure of every requirement (SI)."""
    figures = {str(k): float(x) for k, x in enumerate(p.figures)}
    return {"time_s": p.cost, "power_on_s": p.point.power_on_s, **figures}


# ---------------------------------------------------------------- individuals


class _Fitness:
    """What DEAP's selection asks of a fitness: weighted values, larger is better."""

    def __init__(self, values: tuple[float, ...]) -> None:
        self.wvalues = tuple(-v for v in values)
        self.values = values
        self.valid = True
        self.crowding_dist = 0.0

    def dominates(self, other: _Fitness) -> bool:
        """No worse in all, better in one."""
        pairs = list(zip(self.wvalues, other.wvalues, strict=True))
        return all(a >= b for a, b in pairs) and any(a > b for a, b in pairs)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Fitness) and self.wvalues == other.wvalues

    def __hash__(self) -> int:
        return hash(self.wvalues)


@dataclass
class _Individual:
    point: Point
    fitness: _Fitness


def _judged(
    offers: Offers, judge: Judge, every: Sequence[Array], powered: Array, families: Sequence[str]
) -> list[_Individual]:
    """powered: (g,) s of power that one repeat of each kind takes."""
    counts = np.array(every)
    loads = np.minimum(judge.by_family(counts, families).max(axis=1), USELESS)
    each = zip(counts, offers.cost(counts).tolist(), loads.tolist(), (counts @ powered).tolist(), strict=True)
    points = [Point(n, cost, load, power) for n, cost, load, power in each]
    return [_Individual(p, _Fitness((p.cost, p.load, p.power_on_s))) for p in points]


def _individual(offers: Offers, rng: np.random.Generator) -> Array:
    """Tests at some even temperatures each, with a few repeats."""
    n = np.zeros(len(offers.kinds))
    for offer in offers.tests:
        alone = even(offers, int(rng.integers(1, 7)))
        n[offer.places] = alone[offer.places] + rng.integers(0, 3) * (alone[offer.places] > 0)
    return _allowed(offers, n)


def _child(offers: Offers, parents: Sequence[_Individual], rng: np.random.Generator) -> Array:
    """Each test as one of two parents has it; then a visit more, less, moved, or a repeat more or less."""
    mother, father = (parents[i].point.counts for i in rng.integers(len(parents), size=2))
    child = mother.copy()
    for offer in offers.tests:
        if rng.random() < 0.5:
            child[offer.places] = father[offer.places]
    for _ in range(int(rng.integers(1, 3))):
        child = _mutated(offers, child, rng)
    return _allowed(offers, child)


def _mutated(offers: Offers, n: Array, rng: np.random.Generator) -> Array:
    free = [o for o in offers.tests if o.fixed is None]
    if not free:
        return n
    offer, changed = free[int(rng.integers(len(free)))], n.copy()
    used = [int(k) for k in offer.places if n[k] > 0]
    what = rng.integers(4)
    if what == 0 or not used:
        k = int(rng.choice(offer.places))
        changed[k] = max(n[k], offer.least)
    elif what == 1:
        changed[int(rng.choice(used))] = 0.0
    elif what == 2:
        k = int(rng.choice(used))
        changed[k] = n[k] + rng.choice([-1, 1])
    else:
        k = int(rng.choice(used))
        place = int(np.flatnonzero(offer.places == k)[0]) + int(rng.integers(-3, 4))
        to = int(offer.places[int(np.clip(place, 0, len(offer.places) - 1))])
        changed[k], changed[to] = 0.0, n[k]
    return changed


def _allowed(offers: Offers, n: Array) -> Array:
    """Within what the spec allows: the least and most repeats, what hands fixed, at least one test."""
    found = n.copy()
    for offer in offers.tests:
        found[offer.places] = _of_offer(offer, found[offer.places])
    return found if np.any(found > 0) else even(offers, 1)


def _of_offer(offer: Offer, n: Array) -> Array:
    if offer.fixed is not None:
        return np.array(offer.fixed, dtype=float)
    if offer.everywhere:
        n = np.full(len(n), n.max(initial=0.0))
    return np.where(n > 0, np.clip(n, offer.least, offer.most), 0.0)
