"""Errors that a campaign knows from tests that do not list them under `calibrates`.

A record tells whatever excites it. Where a test of cheaper power-ons tells an error that another test is
there for, the shortest campaign rests on it; who reads the plan should know.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np

from planner.information.choose import Found
from planner.information.kinds import ChannelKinds
from planner.information.parts import left_by_campaign
from planner.information.promise import Promise
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.plan.costs import repeat_time
from planner.spec.model import Spec

MUCH = 2.0  # times the sigma that the campaign leaves, from which on an error rests on records of others
UNTOLD = 1e3


@dataclass(frozen=True)
class Borrowed:
    """An error, the tests that tell it unlisted, and by how much its sigma would grow without them."""

    error: str
    by: tuple[str, ...]
    growth: float


def borrowed(spec: Spec, found: Found) -> Iterator[Borrowed]:
    """The errors that would be at least twice as uncertain without the tests that do not list them."""
    made = {visit.test for visit in found.visits}
    for error in dict.fromkeys(f.error for f in found.judge.promise.flying):
        listing = tuple(name for name, test in spec.tests.items() if error in test.calibrates)
        others = tuple(name for name in spec.tests if name in made - set(listing))
        if not listing or not others:
            continue
        growth = _alone(spec, found, error, listing) / _sigma(found, found.judge.promise, found.counts, error)
        if growth >= MUCH:
            yield Borrowed(str(error), others, growth)


def _alone(spec: Spec, found: Found, error: ErrorName, tests: tuple[str, ...]) -> float:
    """The same by the records of these tests, all errors that none of them lists being known.

    Known, because the tests left out may be there to tell those.
    """
    kept = np.isin([kind.test for kind in found.offers.kinds], tests)
    counts = np.where(kept, found.counts, 0.0)
    if not np.any(counts):
        return float("inf")
    listed = {name for test in tests for name in spec.tests[test].calibrates}
    kinds = found.judge.promise.kinds
    channels = tuple(_known(channel, listed) for channel in kinds.channels)
    promise = replace(found.judge.promise, kinds=replace(kinds, channels=channels))
    return _sigma(found, promise, counts, error)


def _sigma(found: Found, promise: Promise, counts: Array, error: ErrorName) -> float:
    """What counts leave of the largest term of an error in flight, SI."""
    variances = left_by_campaign(promise, counts, 0, found.foreseen.binding(0))
    return float(np.sqrt(max(v for f, v in zip(promise.flying, variances, strict=True) if f.error == error)))


def _known(channel: ChannelKinds, but: Collection[str]) -> ChannelKinds:
    """The channel with nothing but its diagonal of all errors but some: these owe nothing to those."""
    known = [i for i, term in enumerate(channel.terms) if term.error not in but]
    J = channel.information.copy()
    own = J[:, known, known]
    J[:, known, :] = J[:, :, known] = 0.0
    J[:, known, known] = own
    astray = channel.astray.copy()
    astray[:, known] = 0.0
    return replace(channel, information=J, astray=astray)


def borrowed_notes(spec: Spec, found: Found) -> tuple[str, ...]:
    """One note for the errors that rest on the same tests, with what their power-ons take."""
    groups: dict[tuple[str, ...], list[Borrowed]] = {}
    for one in borrowed(spec, found):
        groups.setdefault(one.by, []).append(one)
    return tuple(_note(spec, by, errors) for by, errors in groups.items())


def _note(spec: Spec, by: tuple[str, ...], errors: list[Borrowed]) -> str:
    names = [e.error for e in errors]
    listing = [name for name, test in spec.tests.items() if set(names) & set(test.calibrates)]
    takes = ", ".join(f"{name} {repeat_time(spec, spec.tests[name]):.0f} s" for name in (*by, *listing))
    one, it = len(names) == 1, "it" if len(names) == 1 else "them"
    return (
        f"tests.{by[0]}.calibrates: {', '.join(names)} {'is' if one else 'are'} told mostly by "
        f"{' and '.join(by)}, which {'does' if len(by) == 1 else 'do'} not list {it}: without these records "
        f"{_without(errors, it)} (one power-on: {takes})"
    )


def _without(errors: list[Borrowed], it: str) -> str:
    known = [f"{e.growth:.1f}" for e in errors if e.growth < UNTOLD]
    grown = " to ".join(dict.fromkeys((min(known, key=float), max(known, key=float)))) if known else ""
    if not known:
        return f"nothing would tell {it}"
    if len(known) == len(errors):
        return f"{it.replace('them', 'they')} would be {grown} times as uncertain"
    return f"nothing would tell some of them, the others would be {grown} times as uncertain"
