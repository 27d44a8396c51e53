"""The parameters that were found, a time constant, in the name under which the plan takes the effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from planner import catalog
from planner.effects._shaped import plain_names, shaped_name
from planner.nouns.diagnosis import FoundEffect, FoundTerm
from planner.spec.model import Spec


def not_declared(found: Sequence[FoundEffect], spec: Spec) -> list[FoundEffect]:
    """Those that the spec lacks, under whatever name."""
    return [e for e in found if e.effect not in plain_names(tuple(spec.effects), e.sensor)]


def at_its_parameters(e: FoundEffect) -> FoundEffect:
    """Under the name that says its parameters, of several channels the best known: the plan takes those.

    Under its own where the data tell none, or where it steps.
    """
    smooth = {p.name for p in catalog.effects()[e.effect].parameters if not p.stepped}
    told: dict[str, FoundTerm] = {}
    for t in e.terms:
        if t.parameter and t.name in smooth:
            told[t.name] = min(told.get(t.name, t), t, key=_width)
    name = shaped_name(e.effect, e.sensor, {n: t.value for n, t in told.items()})
    return replace(e, effect=name) if told and name in catalog.effects() else e


def _width(t: FoundTerm) -> float:
    """Of its interval, as a ratio where it has one."""
    return t.high / t.low if t.low > 0.0 else float("inf")


def parameter_notes(e: FoundEffect) -> list[str]:
    """A sentence for each parameter of which the plan takes another value than some channel's."""
    notes = []
    for p in catalog.effects()[e.effect].parameters:
        mine = [t for t in e.terms if t.parameter and t.name == p.name]
        told = [f"{p.shown(t.value)} on {t.channel.replace('accelerometer_', 'acc_')}" for t in mine]
        if not told and p.name in e.nonlinear:
            told = [p.shown(e.nonlinear[p.name])]
        taken = p.shown(p.default)
        if any(not said.startswith(taken) for said in told):
            notes.append(
                f"{e.sensor}.{e.effect}: the plan takes {p.name} {taken}; the data say {', '.join(told)}"
            )
    return notes
