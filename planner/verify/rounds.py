"""Which flights a verification makes: every family of curves with every start that requirements ask for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from planner.errors import InputError
from planner.spec.curve_names import families_of
from planner.spec.model import Requirement, Spec
from planner.verify.curve_shapes import SHAPES
from planner.verify.families import MEASURED, usual_family
from planner.verify.starts import Starts, anywhere, as_flown, starts_of

ALL = "all"
BINDING = "binding"  # the family that the plan says binds each requirement
CURVES = (BINDING, ALL, *SHAPES, MEASURED)
OWN = "own"  # each requirement's own temperatures
TEMPERATURES = (OWN, "flight", "range")
Worst = Callable[[int, str], Starts]
"""(requirement, family) -> the temperature at which it is worst."""


@dataclass(frozen=True)
class Round:
    """Flights with curves of one family from one choice of starts, and the requirements judged by them."""

    family: str
    starts: Starts
    requirements: tuple[int, ...]


def rounds(
    document: Mapping[str, Any], spec: Spec, curves: str, temperature: str, worst: Worst
) -> tuple[Round, ...]:
    """Every requirement is judged in every family asked for; those that start alike fly together."""
    found: dict[tuple[Any, ...], tuple[str, Starts, list[int]]] = {}
    for family, i in _wanted(document, spec, curves):
        starts = _starts(spec, spec.requirement[i], temperature) or worst(i, family)
        key = (family, starts.word, *starts.degc.tolist())
        found.setdefault(key, (family, starts, []))[2].append(i)
    return tuple(Round(family, starts, tuple(which)) for family, starts, which in found.values())


def _wanted(document: Mapping[str, Any], spec: Spec, curves: str) -> list[tuple[str, int]]:
    """(family, requirement), family by family."""
    every = range(len(spec.requirement))
    if curves == BINDING:
        found = [(binding(document, spec, i), i) for i in every]
        return sorted(found, key=lambda pair: _order(pair[0]))
    return [(family, i) for family in families_asked(spec, curves) for i in every]


def families_asked(spec: Spec, curves: str) -> Sequence[str]:
    """Those of a word. Raises InputError for a measured curve that the spec has not."""
    if curves == ALL:
        return families_of(spec)
    if curves == MEASURED and MEASURED not in families_of(spec):
        raise InputError(
            "--curves measured: no error of the spec has a curve measured on a unit; "
            f"fly {', '.join(families_of(spec))}"
        )
    return (curves,)


def binding(document: Mapping[str, Any], spec: Spec, index: int) -> str:
    """The family that the plan says binds a requirement, or the usual one where it says none."""
    said = document["requirements"][index].get("family")
    return said if said in (*SHAPES, MEASURED) else usual_family(spec)


def _order(family: str) -> int:
    return (*SHAPES, MEASURED).index(family)


def _starts(spec: Spec, wanted: Requirement, temperature: str) -> Starts | None:
    if temperature == OWN:
        return starts_of(wanted, spec)
    return anywhere(spec) if temperature == "range" else as_flown(spec)
