"""Measured residuals of units → accepted, rejected or undecided, and which channel and requirement decide.

What is judged of a unit is T(m; ρ) of `allowed_region` with the measured residual m in place of what the plan
had allowed for it: of the parts of a term that was measured, `estimate` falls away, and `temperature` too if
the check reached over the temperatures of the plan; a term that was not measured keeps all parts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.fleet.allowed_region import PARTS, AllowedRegion, Reserve, reserve_of
from planner.fleet.check_residual import MeasuredResidual
from planner.fleet.judge import MOST_RECORDS, ErrorRates, Judgement, Verdict, judged, quantile, room_left

Place = Literal["inside", "outside", "open", "not measured"]
REACH = 0.8  # share of the plan's temperature range that a check must span to show the temperature residual
FEWEST_TEMPERATURES = 3
MUCH = 2.0  # a load beyond this says that the readings were not corrected at all


@dataclass(frozen=True)
class ChannelAcceptance:
    """The term of a channel that comes nearest to its room, SI.

    uncertainty: half of the 95 % interval; planned: what the plan had left for it (temperature + estimate)
    room: the largest size that the region leaves it, all others being as measured; share: of the limit
    """

    channel: str
    term: str
    unit: str
    residual: float
    uncertainty: float
    planned: float
    room: float
    share: float
    temperature_degc: float
    place: Place


@dataclass(frozen=True)
class UnitAcceptance:
    """One unit. Of the group of records that is nearest to the limit, or furthest beyond it:

    value, limit: T and L of the constraint that binds, SI; low, high: load below or above which T lies, each
    with its error rate; sensors: share of the limit of the gyros, the accelerometers and the reserve (of
    its square unless the rule is worst_case)
    further: power-ons that would decide if the residual is what it seems, None when decided, infinite when
    more than any bench can make
    """

    unit: str
    verdict: Verdict
    constraint: int
    value: float
    limit: float
    low: float
    high: float
    sensors: tuple[float, float, float]
    temperatures_degc: tuple[float, ...]
    power_ons: int
    records: int
    further: float | None
    channels: tuple[ChannelAcceptance, ...]
    notes: tuple[str, ...] = ()

    @property
    def load(self) -> float:
        """Share of the limit that is used."""
        return self.value / self.limit

    @property
    def further_records(self) -> float | None:
        """As many records as the further power-ons would hold."""
        return None if self.further is None else self.further * self.records / max(self.power_ons, 1)


def accepted(
    found: Sequence[MeasuredResidual],
    region: AllowedRegion,
    temperatures: tuple[float, float],
    rates: ErrorRates,
) -> tuple[UnitAcceptance, ...]:
    """One entry per unit, in the order of their names; temperatures: range of the plan, degC."""
    units: dict[str, list[MeasuredResidual]] = {}
    for one in found:
        units.setdefault(one.unit, []).append(one)
    whole = {u: reaches([g.temperature_degc for g in groups], temperatures) for u, groups in units.items()}
    ordered = [(unit, one) for unit in sorted(units) for one in units[unit]]
    measured = np.array([one.measured for _, one in ordered]).reshape(len(ordered), -1)
    reserve = reserve_after(region, measured, np.array([whole[unit] for unit, _ in ordered]))
    residual = np.array([one.residual for _, one in ordered]).reshape(len(ordered), -1)
    values = np.stack([region.value(c, residual, reserve) for c in region.constraints], axis=1)
    answers, row = [], 0
    for unit in sorted(units):
        rows = range(row, row + len(units[unit]))
        row += len(rows)
        judgements = [
            judged(region, one, values[r], rates, len(rows)) for one, r in zip(units[unit], rows, strict=True)
        ]
        reserves = [reserve[r] for r in rows]
        answers.append(_unit(unit, units[unit], judgements, reserves, region, rates, whole[unit]))
    return tuple(answers)


def reaches(seen: Sequence[float], temperatures: tuple[float, float]) -> bool:
    """Whether a check at these temperatures reached over those at which the unit will fly."""
    span = temperatures[1] - temperatures[0]
    enough = len(seen) >= FEWEST_TEMPERATURES and max(seen) - min(seen) >= REACH * span
    return enough or span <= 0


def reserve_after(region: AllowedRegion, measured: NDArray[np.bool_], whole: NDArray[np.bool_]) -> Reserve:
    """(…, t) what flights add, and what a check could not show; measured: (…, t), whole: (…) flags."""
    kept = np.ones((*measured.shape, len(PARTS)))
    kept[..., PARTS.index("estimate")] = ~measured
    kept[..., PARTS.index("temperature")] = ~(measured & whole[..., None])
    return reserve_of(region, kept)


def _unit(
    unit: str,
    groups: Sequence[MeasuredResidual],
    judgements: Sequence[Judgement],
    reserves: Sequence[Reserve],
    region: AllowedRegion,
    rates: ErrorRates,
    whole: bool,
) -> UnitAcceptance:
    verdict = _verdict([j.verdict for j in judgements])
    g = int(np.argmax([j.load.max() for j in judgements]))
    worst, one = judgements[g], groups[g]
    c = worst.binding
    power_ons, records = sum(r.power_ons for r in groups), sum(r.records for r in groups)
    return UnitAcceptance(
        unit=unit,
        verdict=verdict,
        constraint=c,
        value=float(worst.value[c]),
        limit=float(worst.limit[c]),
        low=float(max(0.0, worst.value[c] - worst.to_reject[c]) / worst.limit[c]),
        high=float((worst.value[c] + worst.to_accept[c]) / worst.limit[c]),
        sensors=_sensors(region, c, one, reserves[g]),
        temperatures_degc=tuple(r.temperature_degc for r in groups),
        power_ons=power_ons,
        records=records,
        further=_further(verdict, judgements, groups),
        channels=_channels(region, groups, judgements, reserves),
        notes=_notes(groups, region, float(worst.load.max()), whole),
    )


def _verdict(each: Sequence[Verdict]) -> Verdict:
    if "rejected" in each:
        return "rejected"
    return "accepted" if all(v == "accepted" for v in each) else "undecided"


def _further(
    verdict: Verdict, judgements: Sequence[Judgement], groups: Sequence[MeasuredResidual]
) -> float | None:
    """Further power-ons, over all groups: until one rejects, or until all accept."""
    if verdict != "undecided":
        return None
    rejecting = [
        (j.needed() - 1) * g.power_ons
        for j, g in zip(judgements, groups, strict=True)
        if np.any(j.value > j.limit)
    ]
    open_ = [
        (j.needed() - 1) * g.power_ons
        for j, g in zip(judgements, groups, strict=True)
        if j.verdict != "accepted"
    ]
    total = min(rejecting) if rejecting else sum(open_)
    return float(np.ceil(max(total, 1.0))) if total <= MOST_RECORDS else np.inf


def _sensors(
    region: AllowedRegion, c: int, one: MeasuredResidual, reserve: Reserve
) -> tuple[float, float, float]:
    """Shares of the limit, or of its square, by slopes: of gyros, accelerometers, reserve."""
    constraint = region.constraints[c]
    slope = constraint.steepest
    if constraint.rule == "worst_case":
        own, rest = slope * np.abs(one.residual), float(slope @ reserve.sums)
        limit = constraint.limit
    else:
        own, rest = (slope * one.residual) ** 2, float(slope**2 @ reserve.squares)
        limit = constraint.limit**2
    gyro = np.array([t.error.startswith("gyro.") for t in region.terms])
    return (float(own[gyro].sum() / limit), float(own[~gyro].sum() / limit), rest / limit)


# ---------------------------------------------------------------- channels


def _channels(
    region: AllowedRegion,
    groups: Sequence[MeasuredResidual],
    judgements: Sequence[Judgement],
    reserves: Sequence[Reserve],
) -> tuple[ChannelAcceptance, ...]:
    found: dict[str, tuple[float, ChannelAcceptance]] = {}
    for one, judgement, reserve in zip(groups, judgements, reserves, strict=True):
        near = [int(i) for i in np.argsort(-judgement.load)[:4]]
        room = room_left(region, one.residual, reserve, near)
        slope = region.constraints[judgement.binding].steepest / judgement.limit[judgement.binding]
        for t in range(len(region.terms)):
            urgency, entry = _channel(region, one, t, float(room[t]), float(slope[t]))
            if entry.channel not in found or urgency > found[entry.channel][0]:
                found[entry.channel] = (urgency, entry)
    return tuple(entry for _, entry in (found[name] for name in sorted(found, key=_channel_order)))


def _channel_order(name: str) -> tuple[bool, str]:
    return (not name.startswith("gyro"), name)


def _channel(
    region: AllowedRegion, one: MeasuredResidual, t: int, room: float, slope: float
) -> tuple[float, ChannelAcceptance]:
    """How near a term is to its room, and its entry; a measured term goes before one that was not."""
    term = region.terms[t]
    planned = float(region.parts[t, PARTS.index("temperature")] + region.parts[t, PARTS.index("estimate")])
    size, error = abs(float(one.residual[t])), float(np.sqrt(one.covariance[t, t]))
    half = quantile(one, 0.025) * error
    place = _place(bool(one.measured[t]), size, half, room)
    share = size * slope
    entry = ChannelAcceptance(
        term.channel, term.name, term.unit, float(one.residual[t]), half, planned, room, share,
        one.temperature_degc, place,
    )  # fmt: skip
    return (share if one.measured[t] else -1.0), entry


def _place(measured: bool, size: float, half: float, room: float) -> Place:
    if not measured:
        return "not measured"
    if size + half <= room:
        return "inside"
    return "outside" if size - half > room else "open"


def _notes(
    groups: Sequence[MeasuredResidual], region: AllowedRegion, load: float, whole: bool
) -> tuple[str, ...]:
    notes = []
    unseen: NDArray[np.bool_] = ~np.any([g.measured for g in groups], axis=0)
    missing = list(dict.fromkeys(t.error for t, no in zip(region.terms, unseen, strict=True) if no))
    if missing:
        notes.append(f"not measured, so counted as the plan left it: {', '.join(missing)}")
    if not whole and np.any(region.parts[:, PARTS.index("temperature")] > 0):
        seen = ", ".join(f"{g.temperature_degc:.0f}" for g in groups)
        notes.append(f"checked at {seen} degC only: what the temperature table leaves is counted as planned")
    spread = max(g.spread for g in groups)
    if spread > 1:
        notes.append(
            f"it scatters {spread:.2g} times as much as the spec's run_to_run; its own spread was taken"
        )
    if load > MUCH:
        notes.append(f"{load:.3g} times the limit: were the readings corrected? `planner apply` does that")
    return tuple(notes)


def counts(units: Sequence[UnitAcceptance]) -> Mapping[Verdict, int]:
    """How many units have each verdict."""
    every: tuple[Verdict, ...] = ("accepted", "rejected", "undecided")
    return {v: sum(u.verdict == v for u in units) for v in every}
