"""Upper limits of the effects that were looked for in vain, and why others could not be looked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from planner import catalog
from planner.campaign.channel_model import EXCITING
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.findings.suspects import alias_of
from planner.diagnose.hypotheses.candidates import (
    LEAST_DAYS,
    LEAST_OF_A_TABLE,
    follows_any_drift,
    is_shown,
    lasts,
)
from planner.diagnose.hypotheses.estimates import Estimate, estimates
from planner.diagnose.hypotheses.pool import Pool, given
from planner.diagnose.hypotheses.within_input import most_of_terms
from planner.diagnose.noise.channel_noise import LEAST_RUNS, least_freedom
from planner.diagnose.references.references import REFERENCES
from planner.diagnose.search.sensor import SensorFound
from planner.dwells.dwell_columns import SINGLES
from planner.nouns.conditions import Conditions
from planner.nouns.diagnosis import NotFound, Untestable
from planner.protocols import Condition, Effect, Sensor
from planner.units import from_si

LEAST_K = 1.0  # kelvins between records, below which a chamber is at one temperature
FLAT: Mapping[Condition, tuple[str, float]] = {
    "temperature_rate": ("the temperature never changes during a record", 0.0),
    "day": ("all records are of one day", 0.0),
    "time_on": ("all records are of one time since power-on", 0.0),
    "temperature_degc": ("all records are at one temperature", LEAST_K),
}
"""What is said of a condition that the records do not vary, and by how much it then varies at most."""
A_LIMIT = 0.1  # of the input, which no error of a unit that is worth calibrating comes to
BEYOND_INPUT = (
    "not testable with these records: they hardly drive it, and would miss a tenth of the input and more; "
    "faces and axes between those of the unit, other rates or loads would test it"
)


def limits(
    s: SensorFound, data: Prepared, declared: tuple[str, ...]
) -> tuple[list[NotFound], list[Untestable]]:
    """Every effect of the library that exists on the sensor, is not declared and was not found."""
    pool = s.found.pool
    here = given(pool, s.found.all)
    believed = [pool.blocks[b] for b in s.found.library]
    known = {b.name for b in believed if not b.reference}
    as_bench = {alias_of(b): b.name for b in believed if b.reference}
    driven = s.channels[0].model.conditions
    not_found, untestable = [], []
    for name, effect in catalog.effects().items():
        if name in declared or name in known or s.sensor not in effect.sensors:
            continue
        why = (
            _impossible(s, effect)
            or _of_the_bench(as_bench.get(name, ""))
            or _missing(effect, data)
            or _unseen(s, data, effect)
        )
        each = [] if why else list(_determined(here, effect, driven))
        within = [e for e, most in each if _at_most(e) < A_LIMIT * most]
        if within and max(map(_at_most, within)) > 0.0:
            not_found.append(_not_found(here, effect, s.sensor, within))
        else:
            why = why or (BEYOND_INPUT if each else _why(effect, data, s))
            untestable.append(Untestable(name, s.sensor, why))
    return not_found, untestable


def _at_most(e: Estimate) -> float:
    return abs(e.value) + e.half


def _not_found(here: Pool, effect: Effect, sensor: Sensor, within: Sequence[Estimate]) -> NotFound:
    """The limit of those terms that the data tell: a channel that never came near it has none."""
    widest = max(within, key=_at_most)
    terms = tuple(dict.fromkeys(e.term for e in within))
    some = terms if len(terms) < len(effect.terms(sensor)) else ()
    unit, at = effect.units[sensor], here.blocks[widest.block].nonlinear
    return NotFound(effect.name, sensor, _at_most(widest), unit, dict(at), some)


def _of_the_bench(name: str) -> str:
    """Why an effect has no limit where a reference is suspected of what it would do itself."""
    if not name:
        return ""
    record = REFERENCES[name].record
    return f"one with {name.replace('_', ' ')}, which is suspected" + (record and f": {record} would tell")


def _impossible(s: SensorFound, effect: Effect) -> str:
    """Why an effect is out of the question although something looks like it."""
    if effect.name not in s.impossible:
        return ""
    if effect.largest is None:
        return BEYOND_INPUT
    unit = effect.units[s.sensor]
    most = from_si(effect.largest[s.sensor], unit)
    return f"what looks like it is more than the {most:.3g} {unit} that there can be"


def _unseen(s: SensorFound, data: Prepared, effect: Effect) -> str:
    """Why a limit would be a number without meaning: no turn drives the effect, or the rows are too few."""
    if effect.name in s.faint and effect.group == "bias":
        return "the temperature never changes while the unit is on; records on a ramp would test it"
    if effect.name in s.faint:
        what = "a turn of 10 deg/s or more" if s.sensor == "gyro" else "a record with half of g or more"
        return (
            "not testable with these records: only records with hardly any input would tell it; "
            f"{what} under the same conditions would test it"
        )
    fitted = max(w.Q.shape[1] for w in s.found.pool.state.values())
    if len(data.table) - fitted < least_freedom(data.starts):
        return f"{len(data.table)} rows are too few beside the {fitted} coefficients of the declared model"
    if s.sensor == "gyro" and effect.group != "bias":
        fastest = float(np.abs(s.channels[0].model.conditions.rate).max())
        if fastest < EXCITING["gyro"]:
            return f"the gyros turn at {np.degrees(fastest):.2g} deg/s at most"
    return ""


def _determined(here: Pool, effect: Effect, driven: Conditions) -> Iterator[tuple[Estimate, float]]:
    """Every term on every channel that the data determine, and the most that it can be, SI."""
    for b in _nearest_to_default(here, effect):
        most = most_of_terms(here.blocks[b], driven)
        yield from ((e, most[e.term]) for e in estimates(here, [b]) if np.isfinite(e.half))


def _nearest_to_default(here: Pool, effect: Effect) -> list[int]:
    """On every channel the block whose parameters are nearest to their defaults, as shares of the ranges.

    Its own equation in every record: a limit on what acts at rest alone is none on the effect.
    """

    def off(b: int) -> float:
        value = here.blocks[b].nonlinear
        scaled = [
            (p.carried(value[p.name]) - p.carried(p.default)) / (p.bounds[1] - p.bounds[0])
            for p in effect.parameters
        ]
        return float(np.sum(np.square(scaled)))

    best: dict[tuple[int, ...], int] = {}
    mine = [i for i, b in enumerate(here.blocks) if b.name == effect.name and not (b.generic or b.place)]
    for b in sorted(mine, key=off):
        best.setdefault(here.blocks[b].channels, b)
    return list(best.values())


def _missing(effect: Effect, data: Prepared) -> str:
    absent = [c.name for c in SINGLES if c.field in effect.needs and c.name in data.full.absent]
    if absent:
        return f"the table has no column {', '.join(absent)}"
    if follows_any_drift(effect) and not lasts(effect, data.table):
        return f"{len(data.starts)} power-ons are fewer than the {LEAST_OF_A_TABLE} that tell it from a drift"
    if not lasts(effect, data.table):
        return f"the records span {np.ptp(data.table.day):.2g} days; {LEAST_DAYS:g} tells it from run-to-run"
    if "day" in effect.needs and len(data.starts) < LEAST_RUNS:
        return f"{len(data.starts)} power-ons are fewer than the {LEAST_RUNS} that tell it from run-to-run"
    return ""


def _why(effect: Effect, data: Prepared, s: SensorFound) -> str:
    """What the records do not vary of all that the effect needs."""
    for condition, (said, most) in FLAT.items():
        if condition in effect.needs and np.ptp(getattr(data.table, condition)) <= most:
            return said
    if not is_shown(effect, s.channels):
        return "nothing in these records tells it from a simpler effect"
    return "nothing in these records excites it, or the declared model takes it up whole"
