"""Genetic algorithm with binary chromosomes as published (K 3.4.3), the whole population in one array.

Each generation the best individuals are selected and survive; pairs of them, drawn at random, fill the
population with children: two-point crossover of the bit string, then independent flips of bits.
DEAP holds the operators (toolbox) and the record of the run (statistics, logbook). Its individuals are not
used: at some 50 µs each they would cost 12 ms a generation, forty times all that happens here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from planner.nouns.allowances import GeneticHistory
from planner.nouns.array import Array
from planner.nouns.deadline import never

Chromosomes = NDArray[np.int64]  # (P, G): one Gray-coded integer a gene
Evaluate = Callable[[Array], Array]


@dataclass(frozen=True)
class GeneticSettings:
    """Settings with the defaults of K 3.4.3: individuals, best selected, probabilities, most generations.

    mutation: probability of a flip, for every bit; crossover: for every pair of parents.
    bits: a gene has 2^bits values between its bounds, so 16 resolve 1.5e-5 of the range. K's 32 bits a
        chromosome leave 8 for each of four genes, 0.4 % of the range: as coarse as the whole gap that is
        allowed to the exact optimum. Gray code, so that neighbouring values differ in one bit.
    patience, tolerance: the run has converged when in `patience` generations the best value fell by no more
        than `tolerance` of its modulus (or when it has reached the target that `minimise` was given).
    late: whether time is over; the generation that is there is then the last.
    """

    individuals: int = 256
    best: int = 32
    crossover: float = 0.5
    mutation: float = 0.01
    generations: int = 500
    bits: int = 16
    patience: int = 50
    tolerance: float = 1e-4
    late: Callable[[], bool] = never

    def __post_init__(self) -> None:
        if not 2 <= self.best < self.individuals:
            raise ValueError(
                f"best {self.best} must be at least 2 and less than individuals {self.individuals}"
            )
        if not 1 <= self.bits <= 52:  # more than a float's mantissa cannot be told apart
            raise ValueError(f"bits {self.bits} must be between 1 and 52")
        if self.generations < 1 or self.patience < 1:
            raise ValueError("generations and patience must be at least 1")


@dataclass(frozen=True)
class GeneticResult:
    """best: (G,) genes of the smallest `value` ever met; genes (P, G), values (P,): the last population.

    The last population stands in the order of its values, best first.
    """

    best: Array
    value: float
    genes: Array
    values: Array
    history: GeneticHistory


@dataclass(frozen=True)
class _Population:
    """P chromosomes with their genes (P, G) and values (P,)."""

    chromosomes: Chromosomes
    genes: Array
    values: Array


def minimise(
    evaluate: Evaluate,
    lower: Array,
    upper: Array,
    settings: GeneticSettings,
    rng: np.random.Generator,
    *,
    target: float | None = None,
    watch: Callable[[Array, Array], None] | None = None,
) -> GeneticResult:
    """Smallest `evaluate(genes)` over lower <= genes <= upper.

    evaluate: (P, G) genes of a whole population -> (P,) values; NaN counts as infinite. Genes that stand for
    integers are rounded there. lower, upper: (G,); equal bounds make a gene constant.
    target: a value that is good enough to stop at; watch: sees genes and values of every new generation.
    The same `rng` state gives the same bytes. Raises ValueError for bounds that are not finite or cross.
    """
    lower, upper = _checked_bounds(lower, upper)
    toolbox, statistics, logbook = _toolbox(settings, lower, upper, evaluate, rng), _statistics(), _logbook()
    population = toolbox.assess(toolbox.create())
    stopped: Literal["converged", "generations", "time"] = "generations"
    for generation in range(settings.generations):
        if generation > 0 and settings.late():
            stopped = "time"
            break
        population = population if generation == 0 else _next(population, toolbox)
        logbook.record(gen=generation, **statistics.compile([population.values]))
        if watch is not None:
            watch(population.genes, population.values)
        if _converged(logbook, settings, target):
            stopped = "converged"
            break
    return _result(population, logbook, settings, stopped)


def decode(chromosomes: Chromosomes, lower: Array, upper: Array, bits: int) -> Array:
    """(P, G) Gray-coded integers -> genes lower + (upper − lower)·b / (2^bits − 1), b the binary number."""
    number = chromosomes.copy()
    for shift in (1, 2, 4, 8, 16, 32):
        number ^= number >> shift
    share = number / float((1 << bits) - 1)
    between = (1.0 - share) * lower + share * upper  # this form meets both bounds exactly
    return np.asarray(np.clip(between, lower, upper))  # and equal bounds may round beyond them


def select_best(values: Array, count: int) -> NDArray[np.intp]:
    """Indices of the `count` smallest values, smallest first; of equals the earlier."""
    return np.asarray(np.argsort(values, kind="stable")[:count])


def cross_two_points(
    parents: Chromosomes, bits: int, probability: float, rng: np.random.Generator
) -> Chromosomes:
    """Parents 2i and 2i + 1 swap, with `probability`, all bits between two points of the bit string."""
    pairs, genes = len(parents) // 2, parents.shape[1]
    points = np.sort(rng.integers(0, genes * bits + 1, (pairs, 2)), axis=1)
    points[rng.random(pairs) >= probability] = 0  # nothing lies between 0 and 0
    inside = np.clip(points[:, :, None] - bits * np.arange(genes), 0, bits)
    masks = (np.int64(1) << inside[:, 1]) - (np.int64(1) << inside[:, 0])
    swapped = (parents[0::2] ^ parents[1::2]) & masks
    return np.asarray(parents ^ np.repeat(swapped, 2, axis=0))


def flip_bits(
    chromosomes: Chromosomes, bits: int, probability: float, rng: np.random.Generator
) -> Chromosomes:
    """Every bit flips independently with `probability`: their binomial number first, then which ones."""
    total = chromosomes.size * bits
    chosen = rng.choice(total, rng.binomial(total, probability), replace=False)
    flips = np.zeros(chromosomes.size, dtype=np.int64)
    np.bitwise_xor.at(flips, chosen // bits, np.int64(1) << (chosen % bits))
    return np.asarray(chromosomes ^ flips.reshape(chromosomes.shape))


def _toolbox(
    settings: GeneticSettings, lower: Array, upper: Array, evaluate: Evaluate, rng: np.random.Generator
) -> Any:
    """DEAP's registry of the operators, each acting on the whole population."""
    from deap import base

    toolbox, s = base.Toolbox(), settings
    shape = (s.individuals, len(lower))
    toolbox.register("create", rng.integers, 0, 1 << s.bits, shape)
    toolbox.register("assess", _assess, lower=lower, upper=upper, bits=s.bits, evaluate=evaluate)
    toolbox.register("select", select_best, count=s.best)
    toolbox.register("pair", rng.integers, 0, s.best, 2 * ((s.individuals - s.best + 1) // 2))
    toolbox.register("mate", cross_two_points, bits=s.bits, probability=s.crossover, rng=rng)
    toolbox.register("mutate", flip_bits, bits=s.bits, probability=s.mutation, rng=rng)
    return toolbox


def _next(population: _Population, toolbox: Any) -> _Population:
    """The selected survive in front, unevaluated; their children follow."""
    order = toolbox.select(population.values)
    parents = population.chromosomes[order]
    children = toolbox.mutate(toolbox.mate(parents[toolbox.pair()]))
    young = toolbox.assess(children[: len(population.values) - len(order)])
    return _Population(
        np.concatenate([parents, young.chromosomes]),
        np.concatenate([population.genes[order], young.genes]),
        np.concatenate([population.values[order], young.values]),
    )


def _assess(
    chromosomes: Chromosomes, lower: Array, upper: Array, bits: int, evaluate: Evaluate
) -> _Population:
    genes = decode(chromosomes, lower, upper, bits)
    values = np.asarray(evaluate(genes), dtype=float)
    if values.shape != (len(genes),):
        raise ValueError(f"evaluate returned shape {values.shape}, expected {(len(genes),)}")
    return _Population(chromosomes, genes, np.where(np.isnan(values), np.inf, values))


def _statistics() -> Any:
    """Best and mean of a generation; the mean leaves out individuals of infinite value."""
    from deap import tools

    statistics = tools.Statistics()  # sees one array, not 256 objects
    statistics.register("best", lambda values: float(np.min(values[0])))
    statistics.register("mean", lambda values: _finite_mean(values[0]))
    return statistics


def _logbook() -> Any:
    from deap import tools

    return tools.Logbook()


def _finite_mean(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else float("inf")


def _converged(logbook: Any, settings: GeneticSettings, target: float | None) -> bool:
    now = logbook[-1]["best"]
    if target is not None and now <= target:
        return True
    if len(logbook) <= settings.patience or not np.isfinite(now):
        return False
    return bool(logbook[-1 - settings.patience]["best"] - now <= settings.tolerance * abs(now))


def _result(
    population: _Population,
    logbook: Any,
    settings: GeneticSettings,
    stopped: Literal["converged", "generations", "time"],
) -> GeneticResult:
    order = select_best(population.values, len(population.values))
    young = settings.individuals - settings.best
    history = GeneticHistory(
        best=tuple(logbook.select("best")),
        mean=tuple(logbook.select("mean")),
        generations=len(logbook),
        evaluations=settings.individuals + young * (len(logbook) - 1),
        stopped=stopped,
    )
    genes, values = population.genes[order], population.values[order]
    return GeneticResult(genes[0], float(values[0]), genes, values, history)


def _checked_bounds(lower: Array, upper: Array) -> tuple[Array, Array]:
    lower, upper = np.atleast_1d(np.asarray(lower, float)), np.atleast_1d(np.asarray(upper, float))
    if lower.shape != upper.shape or lower.ndim != 1 or len(lower) == 0:
        raise ValueError(f"bounds of shapes {lower.shape} and {upper.shape} are not one pair a gene")
    if not (np.isfinite(lower).all() and np.isfinite(upper).all() and (lower <= upper).all()):
        raise ValueError("bounds must be finite, lower <= upper")
    return lower, upper
