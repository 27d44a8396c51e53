"""What a campaign leaves unobservable, in words: which error, where, what is missing, and what to do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner import catalog
from planner.campaign.observability import Unobservable
from planner.campaign.power_ons import PowerOns
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import ErrorName
from planner.plan.excitation import excitation
from planner.plan.unobservable_to_remedy import Remedy
from planner.spec.model import Spec
from planner.spec.unused_tests import unused_tests
from planner.temperature_table import GAP_K

BASIC = ("misalignment", "scale_factor", "bias")


def named_once(found: Sequence[Unobservable]) -> list[ErrorName]:
    """Errors to name: of two that are mixed up with each other only the one beside bias and scale factor."""
    partners: dict[ErrorName, set[ErrorName]] = {}
    for u in found:
        partners.setdefault(u.error, set()).update(u.partners)
    named: list[ErrorName] = []
    for error in sorted(partners, key=lambda e: BASIC.index(e.effect) if e.effect in BASIC else -1):
        if not partners[error] or not partners[error] & set(named):
            named.append(error)
    return named


def fault_of(spec: Spec, runs: PowerOns, found: Sequence[Unobservable], remedy: Remedy | None) -> str:
    """One error on all its channels.

    `tests.faces: the records cannot tell accelerometer.scale_factor (z) from accelerometer.bias at -60 and
    20 degC: the specific force along z is 1 g only; make faces at -60 and 20 degC too`
    """
    error, first = found[0].error, found[0]
    begin, terms = _asked_for(spec, found)
    partners = tuple(dict.fromkeys(p for u in found for p in u.partners))
    what = f"cannot tell {error}{terms}" + (f" from {listed(partners)}" if partners else " at all")
    where = "" if first.everywhere else f" at {degrees(first.nodes_degc)}"
    asked = next((p for p in (error, *map(ErrorName, partners)) if catalog.effects()[p.effect].needs), error)
    seen, advice = excitation(asked, first.channel, first.term, _at(runs, first), partners)
    return f"{begin} {what}{where}: {seen}; {_advice(spec, remedy, advice)}"


def _asked_for(spec: Spec, found: Sequence[Unobservable]) -> tuple[str, str]:
    """(`tests.faces: the records`, ` (x, z)`) of one error's terms."""
    tests = [name for name, test in spec.tests.items() if found[0].error in test.calibrates]
    return f"tests.{listed(tests)}: the records", f" ({', '.join(dict.fromkeys(u.term for u in found))})"


def hidden_by_references(spec: Spec, found: Sequence[Unobservable], stated: Sequence[str]) -> str:
    """One error behind what its references may be off by; stated: the keys that say so.

    `tests.rates: the records cannot tell gyro.scale_factor (x) better than its budget does:
    benches.table.accuracy.rate is in the way; calibrate it on a more accurate bench, or …`
    """
    error, (begin, end) = found[0].error, _asked_for(spec, found)
    verb = "are" if len(stated) > 1 else "is"
    return (
        f"{begin} cannot tell {error}{end} better than its budget does: {listed(stated)} {verb} in the way; "
        f"calibrate it on a more accurate bench, or take it out of calibrates"
    )


def hidden_by_noise(error: ErrorName, longer: int) -> str:
    """`; or give them records 64 times as long: unit.noise.gyro hides what these would tell`."""
    hides = f"unit.noise.{error.sensor} hides what these would tell"
    return f"; or give them records {longer} times as long: {hides}"


def _at(runs: PowerOns, u: Unobservable) -> Conditions:
    """The records at the nodes that are unobservable."""
    c, nodes = runs.conditions, np.array(u.nodes_degc)
    if not len(nodes):
        return c
    rows = np.abs(c.temperature_degc[:, None] - nodes).min(axis=1) <= GAP_K
    return c.at(rows)


def _advice(spec: Spec, remedy: Remedy | None, motions: str) -> str:
    if remedy is None:
        return motions
    if remedy.idle:
        unused = unused_tests(spec)
        but = f" ({listed(unused)}: 0 repeats)" if unused else ""
        verb, it = ("are", "them") if len(remedy.idle) > 1 else ("is", "it")
        return (
            f"{listed(remedy.idle)} {verb} declared, but no test calibrates {it}{but}: take {it} out of "
            f"effects, or let a test calibrate {it} and {motions}"
        )
    advice = f"make {listed(remedy.tests)} at {degrees(remedy.temperatures)} too"
    if remedy.into is None:
        return advice
    other = spec.tests[remedy.tests[0]]
    return f"{advice}, or give {remedy.into} its {other.motion_count} motions and what it calibrates"


def degrees(temperatures: Sequence[float]) -> str:
    """`-60, -20 and 20 degC`."""
    return f"{listed([f'{t:g}' for t in sorted(temperatures)])} degC"


def listed(names: Sequence[str]) -> str:
    """`a, b and c`."""
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)
