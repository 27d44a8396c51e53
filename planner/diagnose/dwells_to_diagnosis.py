"""One unit's dwell table and a spec → what the declared error model lacks, on what evidence."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sequence

import numpy as np

from planner import catalog
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.evidence_veto import BEYOND_DOUBT, verdict_of
from planner.diagnose.findings.assumptions import assumptions, exceeded
from planner.diagnose.findings.beside_the_bench import beside_the_bench, thermometer_beside
from planner.diagnose.findings.common_scale import common_scale, untold_scale
from planner.diagnose.findings.curves import with_curve
from planner.diagnose.findings.evidence import among, evidence
from planner.diagnose.findings.lagging_thermometer import NAME as LAGS
from planner.diagnose.findings.limits import limits
from planner.diagnose.findings.of_one_temperature import Temperatures
from planner.diagnose.findings.one_law import one_laws
from planner.diagnose.findings.reported import found_effects
from planner.diagnose.findings.suspects import suspects
from planner.diagnose.findings.unlike_power_ons import of_their_power_ons, unlike_power_ons
from planner.diagnose.findings.unsteady_rate import unsteady_rate
from planner.diagnose.hypotheses.found import ALPHA
from planner.diagnose.noise.channel_noise import LEAST_RUNS
from planner.diagnose.records.fahrenheit import in_fahrenheit
from planner.diagnose.records.gravity_of_turns import gravity_of_turns
from planner.diagnose.records.left_out import copies, left_out, off_as_a_whole
from planner.diagnose.records.not_as_said import Screened, screened
from planner.diagnose.records.put_right import Judged, Search, channels_searched, put_right, without_off
from planner.diagnose.records.records_that_stay import records_that_stay
from planner.diagnose.records.temperature_of_before import temperature_of_before
from planner.diagnose.references.thermometer_offset import untold_offset
from planner.diagnose.search.sensor import SensorFound
from planner.diagnose.shapes.generic import variable_of
from planner.diagnose.vetoes.refusals import SURE
from planner.effects._shaped import plain_names
from planner.errors import InputError
from planner.nouns.diagnosis import (
    FoundEffect,
    NotFound,
    ReferenceSuspect,
    Refused,
    UnitDiagnosis,
    Unknown,
    Untestable,
)
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import channel_name
from planner.protocols import Sensor
from planner.spec.model import Spec

AGAIN = 2  # searches, of what explains a channel instead of an effect that the fit leaves nothing of
UNSURE = "fitted with all that is declared, it is no surer than chance among as many effects as were asked"
LEAST_ROWS = 8  # a channel has about as many declared coefficients at one temperature


def diagnose(
    table: DwellTable, spec: Spec, *, seed: int = 1, progress: Callable[[str], None] = lambda _: None
) -> UnitDiagnosis:
    """What the data of one unit say beyond the spec's `effects`.

    Every effect of the library that is not declared, and generic alternatives without a name, are tested
    together (diagnose.search); the seed is of the sign flips. Evidence is in the table's own order.
    Raises InputError when the table has no readings or too few rows.
    """
    _check(table, len(table))
    table, rewritten = _as_meant(table, spec)
    table, seen, late = _screened(table)
    _check(table, int(seen.kept.sum()))
    search = Search(spec, seed, progress)
    stays = without_off(table, seen.kept, search)
    kept, every = stays.kept, bool(stays.kept.all())
    judged = put_right(stays, search)
    table, data = judged.table, judged.data
    found, effects, said, spans, rest = _fitted(judged, search)
    names = list(dict.fromkeys(e.effect for e in effects))
    unnamed = [with_curve(u, s, data, table, spec, names) for s in found for u in _unknown(s)]
    unknown = [*unnamed, *rest]
    not_found, untestable = _limits(found, data, spec)
    assumed = tuple(a for s in found for a in assumptions(s, spec, data))
    told = [c for e in effects for c in e.channels] + [c for u in unknown for c in u.channels]
    unknown += records_that_stay(found, assumed, told, data.starts)
    left = [*stays.off, *copies(data), *left_out(found, data)]
    wrong = (
        *rewritten,
        *late,
        *seen.suspects,
        *_of_the_bench(found, judged, spec),
        *stays.suspects,
        *off_as_a_whole(left),
    )
    unlike = unlike_power_ons(assumed, wrong)
    if unlike is not None:
        wrong = (*wrong, unlike)
        effects, theirs = of_their_power_ons(effects, data)
        spans = [*spans, *theirs]
    wrong, effects, falls, rest = _without_the_bench(found, data, effects, unknown, wrong, spec)
    spans, unknown = [*spans, *falls], [*unknown, *rest]
    untestable += _of_references(found, spec, {one.hypothesis for one in wrong})
    return UnitDiagnosis(
        unit=str(table.unit[0]),
        verdict=verdict_of((*effects, *(s for s in wrong if not s.expected)), unknown, not_found),
        effects=tuple(effects),
        unknown=tuple(unknown),
        not_found=tuple(not_found),
        untestable=tuple(untestable),
        evidence=tuple(e if every else among(e, kept) for s in found for e in evidence(s, data)),
        assumptions=assumed,
        notes=(*seen.notes, *data.notes, *_notes(found, data), *said, *_not_looked_for()),
        reference_suspects=wrong,
        budget_exceeded=exceeded(assumed),
        rows_left_out=(*seen.left_out, *left),
        refused=(*(r for s in found for r in _refused(s)), *spans),
        kept=None if every else kept,
    )


def _without_the_bench(
    found: Sequence[SensorFound],
    data: Prepared,
    effects: Sequence[FoundEffect],
    unknown: Sequence[Unknown],
    wrong: tuple[ReferenceSuspect, ...],
    spec: Spec,
) -> tuple[tuple[ReferenceSuspect, ...], list[FoundEffect], list[Refused], list[Unknown]]:
    """The suspects with what the channels say of each other's references, and `beside_the_bench` of them."""
    temperatures = Temperatures(found, data)
    wrong = (*wrong, *thermometer_beside(effects, wrong, temperatures))
    laws = list(one_laws(found, data, effects, unknown))
    wrong = (*wrong, *(law.suspect for law in laws))
    rate = unsteady_rate(found, wrong, spec)
    wrong = wrong if rate is None else (*wrong, rate)
    return wrong, *beside_the_bench(effects, unknown, wrong, temperatures, laws)


def _of_the_bench(found: Sequence[SensorFound], judged: Judged, spec: Spec) -> Iterator[ReferenceSuspect]:
    """What was put right, what a search believes of the references, and what all channels have in common.

    A thermometer that lags was put right where that was seen: what a search says of it is said already.
    """
    late = any(one.hypothesis == LAGS for one in judged.suspects)
    yield from judged.suspects
    yield from (s for s in suspects(found) if not (late and s.hypothesis == LAGS))
    yield from (one for s in found if (one := common_scale(s, spec)) is not None)


def _as_meant(table: DwellTable, spec: Spec) -> tuple[DwellTable, list[ReferenceSuspect]]:
    """The table with what was written in it otherwise than it is meant, and what is said of that."""
    chambers = [b.chamber.range for b in spec.benches.values() if b.chamber is not None]
    said = []
    for asked in (gravity_of_turns, lambda t: in_fahrenheit(t, chambers)):
        one = asked(table)
        if one is not None:
            table = one.table
            said.append(one.suspect)
    return table, said


def _screened(table: DwellTable) -> tuple[DwellTable, Screened, list[ReferenceSuspect]]:
    """The table with a thermometer that was read a record late put right, screened, and what is said of that.

    Asked again of the rows that stay: turned labels of two power-ons were as much likelier with it.
    """
    late = temperature_of_before(table)
    if late is None:
        return table, screened(table), []
    seen = screened(late.table)
    if not seen.kept.all() and temperature_of_before(table, seen.kept) is None:
        return table, screened(table), []
    return late.table, seen, [late.suspect]


def _fitted(
    judged: Judged, search: Search
) -> tuple[list[SensorFound], list[FoundEffect], list[str], list[Refused], list[Unknown]]:
    """What was found, fitted with what is declared; where that leaves nothing of it, what explains it else.

    The search saw something on that channel: "nothing is missing" is no answer to it.
    """
    table, data, found = judged.table, judged.data, judged.found
    refused, unsure = list(judged.barred), list[Unknown]()
    for again in range(AGAIN + 1):
        search.progress(f"{table.unit[0]}: fitting what was found with what is declared")
        effects, said = found_effects(found, data, table, search.spec)
        effects, falls, rest = told_from_zero(effects)
        refused, unsure = [*refused, *falls], [*unsure, *rest]
        if not falls or again == AGAIN:
            break
        fallen = {c for r in falls for c in r.channels}
        stays = [s for s in found if fallen.isdisjoint(channels_searched(s))]
        found = search.of(data, refused, stays)
        _forget_the_faint(found, refused[len(judged.barred) :])
    told = {c for e in effects for c in e.channels}
    told |= {c for s in found for u in _unknown(s) for c in u.channels}
    return found, effects, said, refused, [u for u in unsure if told.isdisjoint(u.channels)]


def _forget_the_faint(found: Sequence[SensorFound], falls: Sequence[Refused]) -> None:
    """Take no variable for what the fit was not sure of, where that is faint: it is the same few sigma.

    A drift of four sigma that the spec's in-run explains came back as something that goes with the time.
    """
    for s in found:
        for b in list(s.found.unknown):
            block = s.found.pool.blocks[b]
            channels = {channel_name(s.sensor, a) for a in block.columns}
            same = [
                r
                for r in falls
                if channels & set(r.channels)
                and variable_of(catalog.effects()[r.effect], s.sensor) == block.name
            ]
            if same and s.found.share(b).delta < SURE**2:
                s.found.unknown.remove(b)


def _check(table: DwellTable, rows: int) -> None:
    """rows: that are left of it to be judged."""
    if table.gyro is None and table.acc is None:
        raise InputError(f"{table.source}: no readings: neither gyro_x_dps … nor acc_x_g … are there")
    if rows < LEAST_ROWS:
        raise InputError(
            f"{table.source}: {rows} rows of unit {table.unit[0]} are too few for a diagnosis, "
            f"which needs {LEAST_ROWS} at least"
        )


# ---------------------------------------------------------------- what does not stand


def told_from_zero(
    effects: Sequence[FoundEffect],
) -> tuple[list[FoundEffect], list[Refused], list[Unknown]]:
    """The effects of which some coefficient's interval leaves zero out; the others; what is sure of those.

    A size and a time constant may hide each other, and so may the coefficients of one curve: that something
    follows the variable is then sure, no more. All coefficients together must be as sure as a name among so
    many must be (`sure_by_the_fit`).
    """
    stands, falls, rest = [], [], []
    for e in effects:
        linear = [t for t in e.terms if not t.parameter]
        if all(t.low <= 0.0 <= t.high for t in linear):
            why = "fitted with all that is declared, the interval of each of its coefficients holds zero"
            variable = variable_of(catalog.effects()[e.effect], e.sensor)
            if variable and len(linear) > 1 and e.strength > BEYOND_DOUBT and len(e.channels) == 1:
                rest.append(Unknown(e.channels, variable, e.p_value, e.strength))
                continue
            falls.append(Refused(e.effect, e.channels, why))
            if variable and e.nonlinear and e.strength > SURE:
                rest.append(Unknown(e.channels, variable, e.p_value, e.strength))
        elif e.chance_by_fit > ALPHA:
            falls.append(Refused(e.effect, e.channels, UNSURE))
        else:
            stands.append(e)
    return stands, falls, rest


def _refused(s: SensorFound) -> list[Refused]:
    """What the power-ons refuse, in words."""
    out = []
    for veto in s.refused:
        block = s.found.pool.blocks[veto.block]
        channels = tuple(channel_name(s.sensor, a) for a in sorted(block.columns))
        where = f" (run {int(s.runs[veto.run])})" if veto.run >= 0 else ""
        out.append(Refused(block.name, channels, veto.why + where))
    return out


# ---------------------------------------------------------------- what was found


def _unknown(s: SensorFound) -> list[Unknown]:
    found, pool = s.found, s.found.pool
    out = []
    for b in found.unknown:
        block = pool.blocks[b]
        strength = found.share(b).delta
        channels = tuple(channel_name(s.sensor, a) for a in block.columns)
        out.append(Unknown(channels, block.name, found.p[b], float(np.sqrt(strength))))
    return out


# ---------------------------------------------------------------- what was not


def _limits(
    found: Sequence[SensorFound], data: Prepared, spec: Spec
) -> tuple[list[NotFound], list[Untestable]]:
    not_found: list[NotFound] = []
    untestable: list[Untestable] = []
    for s in found:
        seen, unseen = limits(s, data, plain_names(tuple(spec.effects), s.sensor))
        not_found += seen
        untestable += unseen
    judged = {s.sensor for s in found}
    for name, effect in catalog.effects().items():
        missing = [sensor for sensor in effect.sensors if sensor not in judged]
        untestable += [
            Untestable(name, sensor, _no_sensor(sensor, data))
            for sensor in missing
            if name not in plain_names(tuple(spec.effects), sensor)
        ]
    return not_found, untestable


def _of_references(found: Sequence[SensorFound], spec: Spec, told: Container[str]) -> list[Untestable]:
    """What these records cannot show of the references."""
    scales = [one for s in found if (one := untold_scale(s)) is not None and one.effect not in told]
    return [*scales, *(one for one in untold_offset(spec) if one.effect not in told)]


def _no_sensor(sensor: Sensor, data: Prepared) -> str:
    short = "gyro" if sensor == "gyro" else "acc"
    there = data.full.gyro if sensor == "gyro" else data.full.acc
    return f"no columns {short}_x …" if there is None else f"no reference for the {sensor}s"


def _not_looked_for() -> list[str]:
    return [f"not looked for: {one}" for one in catalog.unloadable("effects")]


def _notes(found: Sequence[SensorFound], data: Prepared) -> list[str]:
    notes = []
    for s in found:
        rest: dict[str, list[str]] = {}
        for b in sorted(s.found.misfit):
            block = s.found.pool.blocks[b]
            for a in block.columns:
                names = rest.setdefault(channel_name(s.sensor, a), [])
                names += [block.name] if block.name not in names else []
        notes += [
            f"{name}: what was found does not have exactly the shape of its equation; a small rest "
            f"varies with {', '.join(variables)}"
            for name, variables in rest.items()
        ]
    if len(data.starts) < LEAST_RUNS:
        notes.append(
            f"{len(data.starts)} power-ons are too few for effects that act only between them: the level of "
            "each is its own, and what changes only between power-ons cannot be seen"
        )
    return list(dict.fromkeys(notes))
