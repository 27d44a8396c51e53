"""References that a search believes to be wrong → how they are reported, one entry over both sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.estimates import Estimate, estimates
from planner.diagnose.hypotheses.found import free, on
from planner.diagnose.hypotheses.pool import given
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.references.bench_of_rows import ON_BENCH
from planner.diagnose.references.references import BY_BENCH, REFERENCES, Reference
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.sensor import channel_name
from planner.solvers.distributions import TWO_SIDED, chi_square_tail

DEGREES = 180.0 / np.pi
HOUR_S = 3600.0
FEW = 5  # power-ons that are named
BY_LEVEL = frozenset({"table_rate_by_level", "arm_rate_by_level"})  # of shares beside that of the last level


def suspects(found: Sequence[SensorFound]) -> list[ReferenceSuspect]:
    """Every reference that is believed wrong on some sensor; of one that both show the stronger size."""
    each = [_suspect(s, b) for s in found for b in s.found.library if s.found.pool.blocks[b].reference]
    merged: dict[str, ReferenceSuspect] = {}
    for one in each:
        before = merged.get(one.hypothesis)
        if before is None:
            merged[one.hypothesis] = one
            continue
        best = max(before, one, key=lambda x: x.strength)
        merged[one.hypothesis] = replace(
            best,
            channels=(*before.channels, *one.channels),
            p_value=min(before.p_value, one.p_value),
            strength=float(np.hypot(before.strength, one.strength)),
            separated_by=float(np.hypot(before.separated_by, one.separated_by)),
        )
    return list(merged.values())


def _suspect(s: SensorFound, b: int) -> ReferenceSuspect:
    block = s.found.pool.blocks[b]
    r = REFERENCES[block.name]
    sizes = [e for e in estimates(s.found.pool, s.found.all) if e.block == b]
    value, half = _size(r, sizes, block.place)
    return ReferenceSuspect(
        hypothesis=r.said or r.name,
        value=value,
        low=value - half,
        high=value + half,
        unit=r.unit,
        channels=tuple(channel_name(s.sensor, a) for a in sorted(block.columns)),
        p_value=s.found.p[b],
        strength=float(np.sqrt(s.found.share(b).delta)),
        check=r.check + _where(s, b),
        separated_by=_apart(s, b),
        alias=alias_of(block),
        record=r.record,
        stated=block.stated * (DEGREES if r.unit == "deg" else 1.0),
        chance=_chance(sizes, block.stated),
    )


def alias_of(block: Block) -> str:
    """The sensor's error that no data tell from what a reference does in its place; nothing for an effect."""
    r = REFERENCES.get(block.name)
    return (r.alias_at(block.place) or r.alias) if r is not None else ""


def _where(s: SensorFound, b: int) -> str:
    """The power-ons of one bench among several, in words; nothing of what acts on all of them."""
    block = s.found.pool.blocks[b]
    if block.name not in BY_BENCH or block.place < ON_BENCH:
        return ""
    starts = next(iter(s.found.pool.state.values())).noise.starts
    here = np.any([np.any(x != 0.0, axis=1) for x in block.columns.values()], axis=0)
    runs = s.runs[np.logical_or.reduceat(here, starts)]
    named = ", ".join(map(str, runs[:FEW].tolist())) + (", …" if len(runs) > FEW else "")
    return f"; it is the bench of run {named}"


def _chance(sizes: Sequence[Estimate], stated: float) -> float:
    """Chance of so large an error on a bench of the stated accuracy: Σ γ² / (σ² + its own variance) is χ²."""
    known = [e for e in sizes if np.isfinite(e.half)]
    if stated <= 0.0 or not known:
        return 1.0
    square = sum(e.value**2 / (stated**2 + (e.half / TWO_SIDED) ** 2) for e in known)
    return float(chi_square_tail(square, len(known)))


def _size(r: Reference, sizes: Sequence[Estimate], place: float) -> tuple[float, float]:
    """The length of the coefficients in the hypothesis' unit, with the half-width along them."""
    scale = {"deg": DEGREES, "deg/h": DEGREES * HOUR_S, "s": place}.get(r.unit, 1.0)
    values: Array = np.array([e.value for e in sizes])
    halves: Array = np.array([e.half if np.isfinite(e.half) else 0.0 for e in sizes])
    if r.name in BY_LEVEL:
        return _most_off(values * scale, halves * abs(scale))
    if len(values) == 1:
        return float(values[0] * scale), float(halves[0] * abs(scale))
    length = float(np.linalg.norm(values))
    along = values / max(length, 1e-300)
    return length * scale, float(np.linalg.norm(along * halves)) * abs(scale)


def _most_off(values: Array, halves: Array) -> tuple[float, float]:
    """The share by which the level is off that is most unlike the others, with its half-width.

    values, halves: (levels − 1,) beside the last level. Of one level that is 0.1 % off either way the length
    of all coefficients says 0.14 %. What most levels have in common is the scale factor of each gyro.
    """
    shares, unsure = np.append(values, 0.0), np.append(halves, 0.0)
    middle = np.argsort(shares)[[(len(shares) - 1) // 2, len(shares) // 2]]
    common = int(middle[np.argmin(np.abs(shares[middle]))])
    off = shares - shares[common]
    most = int(np.argmax(np.abs(off)))
    return float(off[most]), float(np.hypot(unsure[most], unsure[common]))


def _apart(s: SensorFound, b: int) -> float:
    """√Δ that the hypothesis explains beside the best single effect of the sensor in its place."""
    pool, others = s.found.pool, s.found.others(b)
    here = given(pool, others)
    library = [i for i, x in enumerate(pool.blocks) if not x.generic and not x.reference]
    rivals = {c: score(here, [c]).delta for c in free(pool, on(pool, library, s.found.axes(b)), [*others, b])}
    if not rivals:
        return float(np.sqrt(s.found.share(b).delta))
    best = max(rivals, key=lambda c: rivals[c])
    return float(np.sqrt(max(score(given(pool, [*others, best]), [b]).delta, 0.0)))
