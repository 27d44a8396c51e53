"""What a search believes → the effects as they are reported: sizes by the calibration's own fit, rivals.

Where that fit cannot speak the search's own sizes stand, and a note says so: effects that step,
accelerometers that are their own reference over several attitudes, too few rows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner import catalog
from planner.calibrate.reference_table import with_references
from planner.campaign.triad import shares
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.findings.bench_uncertainty import below_bench
from planner.diagnose.findings.declared_and_found import ChannelEstimates, declared_and_found
from planner.diagnose.findings.held_elsewhere import held_elsewhere
from planner.diagnose.findings.sure_by_the_fit import chance_by_the_fit, fewest
from planner.diagnose.findings.told_by_records import SURE, named, told_by_the_search
from planner.diagnose.hypotheses.estimates import Estimate, ParameterInterval, estimates, rivals
from planner.diagnose.hypotheses.found import ALPHA
from planner.diagnose.search.sensor import SensorFound
from planner.diagnose.vetoes.forms import TEMPERATURE, at_one_temperature, untested
from planner.diagnose.vetoes.verdicts import told_by_branches
from planner.dwells.table_rows import rows_of
from planner.errors import InputError
from planner.nouns.calibration import Coefficient
from planner.nouns.diagnosis import FoundEffect, FoundTerm, Rival
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import channel_name
from planner.protocols import Effect
from planner.spec.model import Spec

MOST_ORDERS = 3.0  # of e, by which a size may be off and still be one
WELL = 1e-3  # of a column's whitened length that the declared model must leave


def found_effects(
    found: Sequence[SensorFound], data: Prepared, table: DwellTable, spec: Spec
) -> tuple[list[FoundEffect], list[str]]:
    """Every effect that was found on the sensors of a table, and sentences on how their sizes came about."""
    names = list(dict.fromkeys(s.found.pool.blocks[b].name for s in found for b in named(s)))
    effects, notes = [], []
    for s in found:
        last = _last_word(s, data, table, spec, [name for name in names if _told(s, name)])
        budgeted = told_by_the_search(s, last.estimates, data, spec)
        held = dict(held_elsewhere(s, last.estimates, named(s)))
        own = {axis: e for axis, e in last.estimates.items() if axis not in budgeted and axis not in held}
        effects += _effects(s, own)
        notes += [*last.notes, *(_search_alone(s, axis) for axis in sorted(budgeted)), *_by_one_ramp(s, data)]
        notes += [f"{channel_name(s.sensor, axis)}: {why}" for axis, why in held.items()]
    return effects, notes


def _told(s: SensorFound, name: str) -> bool:
    """Whether the sensor's rows tell an effect well beside what is declared: what it found itself it tells.

    What only the other sensor lacks they may not: a cubic at 1 g is a scale factor, and beside 1e8 of it
    misalignments had a hundredth of their intervals.
    """
    pool = s.found.pool
    if name in {pool.blocks[b].name for b in named(s)}:
        return True
    for b, block in enumerate(pool.blocks):
        if block.name == name and not block.generic:
            white = [pool.state[a].noise.whiten(columns) for a, columns in block.columns.items()]
            whole = np.sqrt(sum(np.sum(columns**2, axis=0) for columns in white))
            if np.any(pool.size[pool.places[b]] > WELL * whole):
                return True
    return False


# ---------------------------------------------------------------- the calibration's own fit


@dataclass(frozen=True)
class _LastWord:
    """axis -> what calibrate says of the found effects, where it can; notes: sentences."""

    estimates: Mapping[int, ChannelEstimates]
    notes: list[str]


def _last_word(
    s: SensorFound, data: Prepared, table: DwellTable, spec: Spec, names: Sequence[str]
) -> _LastWord:
    """The fit of the channels on which something was found; those that share a coefficient in one."""
    axes = sorted({a for b in named(s) for a in s.found.axes(b)})
    together = [axes] if shares(s.sensor, (*spec.effects, *names)) else [[axis] for axis in axes]
    estimated: dict[int, ChannelEstimates] = {}
    notes: list[str] = []
    for mine in together:
        why = cannot_fit(s, data, mine)
        try:
            if mine and not why:
                rows = rows_to_fit(s, data, table, mine)
                found = declared_and_found(rows, spec, s.sensor, names, mine)
                own = _own(s, names, mine)
                if len(own) < len(names) and not _all_told(found, s, mine):
                    found = declared_and_found(rows, spec, s.sensor, own, mine)
                    notes.append(_without(s, mine, sorted(set(names).difference(own))))
                estimated |= {axis: found[axis] for axis in mine}
        except InputError as error:
            why = str(error)
        if why:
            channels = ", ".join(channel_name(s.sensor, axis) for axis in mine)
            notes.append(f"{channels}: sizes are those of the search, not of the calibration's fit: {why}")
    said = [f"{channel_name(s.sensor, axis)}: {note}" for axis, e in estimated.items() for note in e.notes]
    return _LastWord(estimated, [*said, *notes])


def _own(s: SensorFound, names: Sequence[str], axes: Sequence[int]) -> list[str]:
    """Of some effects those that were found on these channels."""
    mine = {s.found.pool.blocks[b].name for b in s.found.on(set(axes))}
    return [name for name in names if name in mine]


def _all_told(fits: Mapping[int, ChannelEstimates], s: SensorFound, axes: Sequence[int]) -> bool:
    """Whether of every effect that was found on these channels some coefficient is surely not zero.

    What another channel lacks is declared for all. A settling that lasts as long as the records hides the
    drift of this one, each coefficient as if it were nothing; on an arm the square of a load that another
    channel lacks leaves of this one's cubic of the rate, 34 sigma, three.
    """
    for axis in axes:
        for name in {s.found.pool.blocks[b].name for b in s.found.on({axis})}:
            mine = [c for (effect, _), c in fits[axis].terms.items() if effect == name]
            if mine and all(c.low <= 0.0 <= c.high for c in mine):
                return False
    return all(
        chance_by_the_fit(s.found.pool, fits, b) <= ALPHA for b in s.found.on(set(axes)) if b in named(s)
    )


def _search_alone(s: SensorFound, axis: int) -> str:
    return (
        f"{channel_name(s.sensor, axis)}: sizes are those of the search, not of the calibration's fit, which "
        "counts on more drift within a power-on, as the spec budgets it, than these records show"
    )


def _by_one_ramp(s: SensorFound, data: Prepared) -> Iterator[str]:
    """Of every name that one power-on alone can tell a sentence that says so."""
    for b in named(s):
        one = told_by_branches(s.found.without(b), b, data.starts)
        if one >= 0:
            channels = ", ".join(channel_name(s.sensor, a) for a in s.found.axes(b))
            name = s.found.pool.blocks[b].name
            yield (
                f"{channels}: run {s.runs[one]} alone can tell {name}; the branches of its temperature agree "
                "on it. Another such run would confirm it"
            )


def _without(s: SensorFound, axes: Sequence[int], others: Sequence[str]) -> str:
    channels = ", ".join(channel_name(s.sensor, axis) for axis in axes)
    return f"{channels}: fitted without {', '.join(others)}, found elsewhere, which hides what was found"


def cannot_fit(s: SensorFound, data: Prepared, axes: Sequence[int]) -> str:
    """Why the calibration's fit would not answer for what was found on these channels; "" when it does."""
    known = catalog.effects()
    mine = [s.found.pool.blocks[b] for b in s.found.on(set(axes))]
    wrong = sorted({b.name for b in mine if b.reference})
    if wrong:
        return f"the reference is suspect there ({', '.join(wrong)})"
    split = sorted({b.name for b in mine if b.place})
    if split:
        return f"turns have a level of their own beside {', '.join(split)}"
    names = {b.name for b in mine}
    stepped = sorted(name for name in names if any(p.stepped for p in known[name].parameters))
    if stepped:
        return f"{', '.join(stepped)} has no derivative by which a fit could find where it steps"
    if s.sensor == "accelerometer" and data.attitude is not None and data.attitude.max() > 0:
        return f"they are their own reference over {data.attitude.max() + 1} attitudes"
    return ""


def rows_to_fit(s: SensorFound, data: Prepared, table: DwellTable, axes: Sequence[int]) -> DwellTable:
    """The rows as they came, each once, with a calibration's references, without those that are far off.

    Of a table too large for that the rows of the search, averaged and chosen as its notes say.
    """
    if len(data.table) < len(data.once):
        return rows_of(data.table, ~np.any([s.far[axis] for axis in axes], axis=0))
    own_reference = s.sensor == "gyro" and table.ref_acc is None and table.acc is not None
    full = with_references(table) if own_reference else data.full
    judged = data.where[data.once]
    far = (judged >= 0) & np.any([s.far[axis][judged] for axis in axes], axis=0)
    return rows_of(replace(full, temperature_rate=table.temperature_rate), data.once[~far])


# ---------------------------------------------------------------- effects


def _effects(s: SensorFound, last: Mapping[int, ChannelEstimates]) -> list[FoundEffect]:
    """One entry an effect; one a channel where each channel has parameters of its own."""
    found, pool = s.found, s.found.pool
    library = [i for i, b in enumerate(pool.blocks) if not b.generic and not b.reference]
    groups: dict[tuple[str, int], list[int]] = {}
    for b in named(s):
        block = pool.blocks[b]
        groups.setdefault((block.name, b if block.nonlinear else -1), []).append(b)
    sizes = estimates(pool, found.all)
    return [_effect(s, last, blocks, library, sizes) for blocks in groups.values()]


def _effect(
    s: SensorFound,
    last: Mapping[int, ChannelEstimates],
    blocks: Sequence[int],
    library: Sequence[int],
    sizes: Sequence[Estimate],
) -> FoundEffect:
    found, pool = s.found, s.found.pool
    effect = catalog.effects()[pool.blocks[blocks[0]].name]
    terms = [t for b in blocks for t in _terms(s, last, b, effect, sizes)]
    opposed: dict[str, float] = {}
    for b in blocks:
        for name, apart in rivals(found, b, library):
            opposed[name] = min(apart, opposed.get(name, np.inf))
        slopes = s.slopes(b)
        course, elsewhere = untested(found, b, slopes), at_one_temperature(found, b, slopes)
        if course is not None and course[0] != effect.name:  # of that a table is the rival
            opposed.setdefault(*course)
        if elsewhere is not None:
            opposed.setdefault(TEMPERATURE, elsewhere)
    axes = sorted({a for b in blocks for a in pool.blocks[b].columns})
    return FoundEffect(
        effect=effect.name,
        sensor=s.sensor,
        channels=tuple(channel_name(s.sensor, a) for a in axes),
        terms=tuple(terms),
        p_value=min(found.p[b] for b in blocks),
        strength=float(np.sqrt(sum(found.share(b).delta for b in blocks))),
        rivals=tuple(Rival(name, apart) for name, apart in sorted(opposed.items(), key=lambda r: r[1])),
        below_bench_uncertainty=below_bench(s, blocks, [e for e in sizes if e.block in blocks]),
        nonlinear=_nonlinear(s, last, blocks[0], effect),
        chance_by_fit=min(chance_by_the_fit(pool, last, b) for b in blocks),
    )


def _nonlinear(
    s: SensorFound, last: Mapping[int, ChannelEstimates], b: int, effect: Effect
) -> dict[str, float]:
    block = s.found.pool.blocks[b]
    if block.channels[0] in last:
        return last[block.channels[0]].nonlinear(effect)
    return dict(block.nonlinear)


def _terms(
    s: SensorFound,
    last: Mapping[int, ChannelEstimates],
    b: int,
    effect: Effect,
    sizes: Sequence[Estimate],
) -> list[FoundTerm]:
    """The block's coefficients and then its parameters: the calibration's, else those of the search."""
    block = s.found.pool.blocks[b]
    names = [t for t in block.terms if t]
    fit = {key: c for axis in block.channels if axis in last for key, c in last[axis].terms.items()}
    if any(not _alone(fit.get((effect.name, t))) for t in names) or _hidden_by_others(s, b, effect, fit):
        return _of_the_search(s, b, effect, sizes)
    channel, unit = _where(s, b), effect.units[s.sensor]
    told = last[block.channels[0]].parameters
    strength = float(np.sqrt(s.found.share(b).delta)) if block.nonlinear and len(names) == 1 else 0.0
    coefficients = (fit[effect.name, t] for t in names)
    ends = [(c, *sizes_of_a_sign(c.value, c.low, c.high, strength)) for c in coefficients]
    return [
        *(FoundTerm(c.term, channel, c.value, low, high, c.freedom, unit) for c, low, high in ends),
        *(
            FoundTerm(p.name, channel, c.value, c.low, c.high, c.freedom, p.unit, True)
            for p in effect.parameters
            if (c := told.get((effect.name, p.name))) is not None
        ),
    ]


def _alone(c: Coefficient | None) -> bool:
    """Whether a fit has a coefficient, and does not have it only together with another (told_together)."""
    return c is not None and bool(np.isfinite(c.high - c.low))


def _hidden_by_others(
    s: SensorFound, b: int, effect: Effect, fit: Mapping[tuple[str, str], Coefficient]
) -> bool:
    """Whether a block has the fewest of an effect's coefficients that tell it, and the fit of all tells none.

    In tilted attitudes |f|² = g² to the last digit of the references: three squares and the bias are then
    told apart by a part in a million of themselves, and the one square that is there was 1.2 ± 10 mg/g².
    """
    block = s.found.pool.blocks[b]
    told = [fit[effect.name, t] for t in block.terms if t]
    return fewest(block) and all(c.low <= 0.0 <= c.high for c in told)


def sizes_of_a_sign(value: float, low: float, high: float, strength: float) -> tuple[float, float]:
    """The interval of a size beside a time constant; by its logarithm where it holds zero and a sign is sure.

        c exp(± h / |c|),   h half the interval

    The longer the time constant, the larger the size that goes with it: both together are sure at √Δ =
    `strength` sigma, though half the interval is as long as the size. It is its order that is not known.
    """
    half = (high - low) / 2.0
    if not low <= 0.0 <= high or strength < SURE or not half < MOST_ORDERS * abs(value):
        return low, high
    ends = sorted((value * float(np.exp(half / abs(value))), value * float(np.exp(-half / abs(value)))))
    return ends[0], ends[1]


def _where(s: SensorFound, b: int) -> str:
    """The block's channel; `all` where several have its coefficients in common."""
    channels = s.found.pool.blocks[b].channels
    return channel_name(s.sensor, channels[0]) if len(channels) == 1 else "all"


def _of_the_search(s: SensorFound, b: int, effect: Effect, sizes: Sequence[Estimate]) -> list[FoundTerm]:
    mine = [e for e in sizes if e.block == b]
    intervals: tuple[ParameterInterval, ...] = ()
    profiled: Mapping[str, tuple[float, float]] = {}
    if effect.parameters:
        shape = s.shape(b)
        intervals, profiled = shape.parameters, shape.sizes
        mine = [e for e in shape.estimates(s.found) if e.block == b]
    ends = {e.term: profiled.get(e.term, (e.value - e.half, e.value + e.half)) for e in mine}
    channel = _where(s, b)
    unit = effect.units[s.sensor]
    return [
        *(FoundTerm(e.term, channel, e.value, *ends[e.term], e.freedom, unit) for e in mine),
        *(
            FoundTerm(i.name, channel, i.value, i.low, i.high, i.freedom, p.unit, True)
            for p, i in zip(effect.parameters, intervals, strict=True)
        ),
    ]
