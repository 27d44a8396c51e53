"""Is the promise kept? Shares of flights with exact intervals, percentiles, and what the error is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.solvers.distributions import binomial_interval, normal_quantile
from planner.spec.model import NAVIGATION_ERRORS, PercentileRule, Requirement, Spec
from planner.spec.own_units import own_unit
from planner.units import to_si, unit_factor
from planner.verify.beside import HEIGHT, noise_name
from planner.verify.experiment import Experiment
from planner.verify.flights import instants_at
from planner.verify.residuals import PARTS
from planner.verify.tally import Tally

Verdict = Literal["kept", "broken", "undecided"]
SURE = 0.95  # confidence of the interval on the share of flights
PERCENTILES = (50.0, 68.27, 90.0, 95.0, 99.0)


@dataclass(frozen=True)
class Part:
    """What a part of an error adds to a requirement, and its size beside the plan's.

    adds: root mean square of what it adds to the navigation error, SI; share: of the sum of all squares
    size, largest: root mean square and largest modulus, SI of the error; planned: the plan's part
    """

    error: str
    part: str
    unit: str
    adds: float
    share: float
    size: float
    largest: float
    planned: float


@dataclass(frozen=True)
class Claim:
    """Estimates at the calibration temperatures: share within the half-width that the plan claims for one."""

    error: str
    share: float
    low: float
    high: float
    claimed: float


@dataclass(frozen=True)
class TypesOutcome:
    """In which share of the types a requirement is kept, with its exact interval; promised: in which."""

    types: int
    share: float
    low: float
    high: float
    promised: float
    verdict: Verdict


@dataclass(frozen=True)
class RequirementOutcome:
    """One requirement over all flights, SI.

    family: of the curves; starts: at which temperatures, in words; instants: (k,) s, when it was looked at
    promised: share of the flights that the rule promises; None for rss, which promises the root mean square
    share, low, high: of the flights within the limit, with its exact interval; rms with rms_low, rms_high
    foreseen: what verify's own linear model says of these flights, curves drawn; None for a worst case
    types: where spreads are estimates, in how many types of unit it is kept: then the verdict is theirs
    achieved: what the plan says; at_promise: what it should be compared with, the promised percentile or the
    rms; pessimism: achieved over at_promise; apart: rms of nonlinear − linear over the rms of the flights
    """

    index: int
    family: str
    starts: str
    error: str
    at: str
    instants: Array
    rule: str
    unit: str
    limit: float
    promised: float | None
    share: float
    low: float
    high: float
    rms: float
    rms_low: float
    rms_high: float
    achieved: float
    at_promise: float
    percentiles: tuple[tuple[float, float], ...]
    largest: float
    apart: float
    verdict: Verdict
    too_small: tuple[str, ...]
    parts: tuple[Part, ...]
    lengths: Array
    types: TypesOutcome | None = None
    foreseen: float | None = None

    def over_types(self, types: TypesOutcome) -> RequirementOutcome:
        """Where spreads are estimates, the promise is that of the types."""
        return replace(self, types=types, verdict=types.verdict)

    @property
    def pessimism(self) -> float:
        """How much more the rule predicted than what the promised share of the flights did."""
        return self.achieved / self.at_promise if self.at_promise > 0 else float("inf")


def share_interval(hits: int, of: int, confidence: float = SURE) -> tuple[float, float]:
    """Clopper, Pearson (Biometrika 26, 1934): exact interval of a binomial share."""
    return binomial_interval(hits, of, (1.0 - confidence) / 2.0)


def outcomes(
    e: Experiment,
    tally: Tally,
    document: Mapping[str, Any],
    spec: Spec,
    which: Sequence[int] | None = None,
) -> tuple[RequirementOutcome, ...]:
    """Requirements of the spec, judged: all of them, or some."""
    every = range(len(spec.requirement)) if which is None else which
    return tuple(_outcome(e, tally, document, spec, r) for r in every)


def _outcome(
    e: Experiment, tally: Tally, document: Mapping[str, Any], spec: Spec, index: int
) -> RequirementOutcome:
    wanted = spec.requirement[index]
    lengths = tally.lengths[index]
    limit, unit = wanted.limit.si, NAVIGATION_ERRORS[wanted.error]
    hits, flights = int(np.sum(lengths <= limit)), len(lengths)
    low, high = share_interval(hits, flights)
    promised = promised_share(wanted, spec)
    rms, rms_low, rms_high = _rms(tally, index, flights, wanted)
    verdict = _verdict(limit, promised, (low, high), (rms_low, rms_high))
    parts = _parts(e, tally, document, index)
    return RequirementOutcome(
        index=index,
        family=e.family,
        starts=e.starts.words,
        error=wanted.error,
        at=wanted.at if isinstance(wanted.at, str) else f"{wanted.at:g} s",
        instants=np.zeros(0)
        if e.flight is None
        else e.flight.instants[instants_at(e.flight.instants, wanted)],
        rule=rule_name(wanted),
        unit=unit,
        limit=limit,
        promised=promised,
        share=hits / flights,
        low=low,
        high=high,
        rms=rms,
        rms_low=rms_low,
        rms_high=rms_high,
        achieved=predicted(document, index, e.family),
        at_promise=rms if promised is None else float(np.quantile(lengths, promised)),
        percentiles=tuple((p, float(np.percentile(lengths, p))) for p in PERCENTILES),
        largest=float(lengths.max()),
        apart=float(np.sqrt(tally.apart[index] / flights)) / rms if rms > 0 else 0.0,
        verdict=verdict,
        too_small=_too_small(parts) if verdict == "broken" else (),
        parts=parts,
        lengths=lengths,
    )


def predicted(document: Mapping[str, Any], index: int, family: str) -> float:
    """What the plan says of a requirement, of that family if it has a figure for each, SI."""
    said = document["requirements"][index]
    of_family = document.get("families", {}).get(family, {})
    return to_si(f"{of_family.get(str(index), said['achieved'])} {said['unit']}", said["unit"])


def promised_share(wanted: Requirement, spec: Spec) -> float | None:
    """Share of the flights within the limit: the percentile, or the plan's confidence for a worst case."""
    if isinstance(wanted.rule, PercentileRule):
        return wanted.rule.percentile
    return None if wanted.rule == "rss" else spec.plan.confidence


def rule_name(wanted: Requirement) -> str:
    """`worst_case`, `rss` or `percentile 95 %`."""
    if isinstance(wanted.rule, PercentileRule):
        return f"percentile {100 * wanted.rule.percentile:g} %"
    return wanted.rule


def _verdict(
    limit: float, promised: float | None, share: tuple[float, float], rms: tuple[float, float]
) -> Verdict:
    if promised is None:
        return "kept" if rms[1] <= limit else "broken" if rms[0] > limit else "undecided"
    return "kept" if share[0] >= promised else "broken" if share[1] < promised else "undecided"


def _rms(tally: Tally, index: int, flights: int, wanted: Requirement) -> tuple[float, float, float]:
    """Root mean square with its interval: the mean of squares of independent flights is nearly normal.

    What holds at any moment by its rss holds at the moment at which the root mean square is largest.
    """
    sums, fourth = tally.at_instants[index]
    if wanted.rule != "rss":  # beside a share of the flights: of their largest errors
        sums, fourth = (np.array([np.sum(tally.lengths[index] ** power)]) for power in (2, 4))
    worst = int(np.argmax(sums))
    return rms_interval(float(sums[worst]), float(fourth[worst]), flights)


def rms_interval(squares: float, fourth: float, flights: int) -> tuple[float, float, float]:
    """Root mean square, its least and its most, from sums of |d|² and |d|⁴."""
    mean, most = squares / flights, float(normal_quantile((1 + SURE) / 2))
    if not np.isfinite(mean) or flights < 2:
        return float(np.sqrt(mean)), 0.0, float("inf")
    spread = max(fourth - flights * mean**2, 0.0) / (flights - 1)
    half = most * float(np.sqrt(spread / flights))
    return float(np.sqrt(mean)), float(np.sqrt(max(mean - half, 0.0))), float(np.sqrt(mean + half))


# ---------------------------------------------------------------- what it is made of


def names_of(e: Experiment) -> list[ErrorName]:
    """Errors in the order of the tallies."""
    return [ErrorName.of(sensor, effect) for sensor, effect in e.errors]


def _parts(e: Experiment, tally: Tally, document: Mapping[str, Any], index: int) -> tuple[Part, ...]:
    adds = np.sqrt(tally.squares[index] / tally.flights)
    beside = np.sqrt(tally.beside[index] / tally.flights)
    sizes = np.sqrt(tally.sizes / tally.counts[:, None])
    whole = float(np.sum(adds**2) + np.sum(beside**2)) or 1.0
    sigmas = sigmas_planned(document, e.spec)
    found = [
        _beside(e, name, add, add**2 / whole) for name, add in zip(e.beside, beside.tolist(), strict=True)
    ]
    for i, name in enumerate(names_of(e)):
        claimed = document["allowances"].get(name)
        unit = own_unit(e.spec, name.sensor, name.effect)
        for p, part in enumerate(PARTS):
            said = 0.0 if claimed is None else float(claimed["parts"][part])
            planned = said * unit_factor(unit if claimed is None else claimed["unit"])[0] / sigmas
            share = float(adds[i, p] ** 2) / whole
            numbers = (float(adds[i, p]), share, float(sizes[i, p]), float(tally.largest[i, p]), planned)
            found.append(Part(name, part, unit, *numbers))
    return tuple(sorted(found, key=lambda part: -part.adds))


def sigmas_planned(document: Mapping[str, Any], spec: Spec) -> float:
    """How many sigmas a plan's parts are: one, or what a plan by information multiplies them with."""
    if document.get("method") != "information":
        return 1.0
    return max(quantile_of(wanted) for wanted in spec.requirement)


def quantile_of(wanted: Requirement) -> float:
    """How many sigmas of one error a requirement's figure is: z of its percentile, 1 for rss."""
    rule = wanted.rule
    return float(normal_quantile(0.5 + rule.percentile / 2.0)) if isinstance(rule, PercentileRule) else 1.0


def _beside(e: Experiment, name: str, adds: float, share: float) -> Part:
    """Noise (of one second), alignment, height aid: as large as the spec has it, so nothing is too small."""
    assert e.flight is not None
    beside = e.flight.beside
    for sensor, density in beside.noise.items():
        if name == noise_name(sensor):
            unit = "deg/s" if sensor == "gyro" else "g"
            return Part(sensor, "noise", unit, adds, share, density, density, density)
    if name == HEIGHT:
        return Part("height aid", "height", "m", adds, share, *(3 * (beside.height,)))
    assert beside.alignment is not None
    one = beside.alignment.roll_pitch, beside.alignment.roll_pitch, beside.alignment.heading
    size = float(np.sqrt(np.mean(np.square(one))))
    return Part("attitude", "alignment", "deg", adds, share, size, size, size)


def _too_small(parts: tuple[Part, ...]) -> tuple[str, ...]:
    """Parts whose root mean square alone exceeds what the plan allows, those that cost most first."""
    over = [x for x in parts if x.size > x.planned * (1 + 1e-6) and x.share > 1e-3]
    cost = {x: x.adds**2 * (1.0 - min(1.0, x.planned / x.size) ** 2) for x in over}
    return tuple(f"{x.error} {x.part}" for x in sorted(over, key=lambda x: -cost[x])) or ("the rule itself",)


def claims_of(e: Experiment, tally: Tally, confidence: float) -> tuple[Claim, ...]:
    """Every calibrated error's estimates against the half-width that the plan claims for them."""
    found = []
    for (inside, every), name in zip(tally.claimed, names_of(e), strict=True):
        if e.half_widths.get(name, 0.0) > 0 and every > 0:
            # as if a unit were one observation: its nodes and axes are drawn together
            low, high = share_interval(round(inside / every * tally.flights), tally.flights)
            found.append(Claim(name, inside / every, low, high, confidence))
    return tuple(found)
