"""What one power-on of every kind tells: a test at a temperature, with the campaign model's own V.

    J_k = A_kᵀ V_k⁻¹ A_k     per channel, over what one unit of every term adds and the shared references

Tables are not resolved into nodes here: a soaked power-on sees a table at one temperature only, so its node
columns are its term's column times the hats at that temperature. J_k therefore serves every choice of nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from planner.campaign.channel_model import EXCITED, EXCITING
from planner.campaign.model import Campaign, ChannelCampaign, campaign
from planner.campaign.noise import (
    budget_of,
    columns_of_errors,
    squared_columns,
    strayed_variances,
    unfitted_columns,
)
from planner.campaign.power_ons import PowerOns
from planner.information.curves import Curves
from planner.measurement import sensed
from planner.nouns.array import Array
from planner.nouns.conditions import joined
from planner.nouns.sensor import ErrorName
from planner.plan.motions_to_records import RepeatRecords, repeat_records
from planner.protocols import Sensor
from planner.spec.model import Spec

Slopes = Mapping[str, Mapping[ErrorName, Array]]
"""Family of curves -> error -> (n,) root mean square of the slopes of its curves at records, SI/K."""
NONE: Slopes = MappingProxyType({})


@dataclass(frozen=True)
class Kind:
    """One kind of power-on: a repeat of a test at a temperature. bench: "" where nobody says it"""

    test: str
    temperature_degc: float
    bench: str = ""


@dataclass(frozen=True)
class Term:
    """One term of an error on a channel; tabled: a table over temperature carries it; driven: only where the
    input of the channel is large enough to tell a scale factor; shared: with the sensor's other channels;
    nodal: the value at a node, which only records near it tell."""

    error: ErrorName
    name: str
    tabled: bool
    driven: bool
    shared: bool = False
    nodal: bool = False


@dataclass(frozen=True)
class ChannelKinds:
    """One channel of all kinds. b terms, q shared references, g kinds, u terms of which nothing is fitted.

    information: (g, b + q, b + q) of one power-on
    unfitted: what the unit has of errors that no effect is declared for; astray: (g, b + q, u) A_kᵀ V_k⁻¹ z,
        what one unit of them does to the normal equations
    sigma: (q,) of the references, of walks over the campaign's days and of constants
    references: (q,) names of the references, which other channels have in common; empty: a walk of its own
    missing: (q,) which are the constants of `unfitted`, beside which the others are estimated
    rows: (n, b) columns without weights, inputs: (n,) their |u|, starts: (g,) first row of each kind
    strayed: family of curves -> (g, b + q, b + q) A_kᵀ V_k⁻¹ D_k V_k⁻¹ A_k; D: variances that a chamber's
        stray makes of its curves, less those of all families together, which V has
    """

    sensor: Sensor
    channel: int
    terms: tuple[Term, ...]
    information: Array
    unfitted: tuple[Term, ...]
    astray: Array
    sigma: Array
    references: tuple[str, ...]
    missing: NDArray[np.bool_]
    rows: Array
    inputs: Array
    starts: NDArray[np.int64]
    strayed: Mapping[str, Array] = field(default_factory=dict)

    @cached_property
    def shows(self) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """(g,) which class a kind is of, and (c, c) whether class j tells a scale factor beside class i.

        What is a large input is asked of the records of a campaign: 0.01 g is one where nothing larger is
        recorded, and none beside 1 g. A class tells a scale factor if it does beside each that is recorded.
        """
        sizes, which = np.unique(np.maximum.reduceat(self.inputs, self.starts), return_inverse=True)
        needed = np.minimum(EXCITED * sizes, EXCITING[self.sensor])
        return which, sizes >= needed[:, None]

    @cached_property
    def largest(self) -> Array:
        """(g, b) the largest size of every column in a power-on of each kind."""
        return np.asarray(np.maximum.reduceat(np.abs(self.rows), self.starts, axis=0))


@dataclass(frozen=True)
class Kinds:
    """All kinds of power-on that a spec's tests offer at some temperatures."""

    kinds: tuple[Kind, ...]
    channels: tuple[ChannelKinds, ...]

    @property
    def degc(self) -> Array:
        """(g,) temperatures."""
        return np.array([k.temperature_degc for k in self.kinds])

    @property
    def families(self) -> frozenset[str]:
        """Of the curves, those of which it is known what a chamber's stray makes of them."""
        return frozenset(name for c in self.channels for name in c.strayed)

    def together(self, counts: Array) -> Kinds:
        """What a campaign of counts (g,) tells at each temperature on each bench, as one kind."""
        each = [(k.temperature_degc, k.bench) for k in self.kinds]
        known = sorted(set(each))
        place = np.array([known.index(one) for one in each])
        weights = (place == np.arange(len(known))[:, None]) * counts
        kinds = tuple(Kind("", degc, bench) for degc, bench in known)
        return Kinds(kinds, tuple(_together(c, weights) for c in self.channels))


def kinds_of(spec: Spec, offered: Sequence[tuple[str, Sequence[float]]], curves: Curves) -> Kinds:
    """The kinds that tests offer, each (test, temperatures). Tests of unknown motions are left out.

    The days of a campaign are not known before it is chosen: the walk during it is left to the prediction.
    """
    kinds, records = [], []
    for test, temperatures in offered:
        one = repeat_records(spec, test)
        if one is not None:
            kinds += [Kind(test, float(t), spec.tests[test].bench) for t in temperatures]
            records += [one] * len(temperatures)
    if not kinds:
        return Kinds((), ())
    made = campaign_of(spec, _runs(spec, kinds, records), curves)
    return Kinds(tuple(kinds), tuple(map(channel_kinds, made.channels.values())))


def campaign_of(spec: Spec, runs: PowerOns, curves: Curves) -> Campaign:
    """A campaign to be made, before which nobody knows a unit's curves."""
    return campaign(spec, runs, slopes=cache(partial(curves.slopes, runs.conditions.temperature_degc)))


def _runs(spec: Spec, kinds: Sequence[Kind], records: Sequence[RepeatRecords]) -> PowerOns:
    sizes = [len(r.duration) for r in records]
    benches = list(spec.benches)
    parts = [
        replace(r.conditions, temperature_degc=np.full(n, k.temperature_degc))
        for k, r, n in zip(kinds, records, sizes, strict=True)
    ]
    return PowerOns(
        joined(parts),
        np.concatenate([r.duration for r in records]),
        np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64),
        np.ones(len(kinds)),
        np.repeat([k.bench for k in kinds], sizes),
        np.repeat([benches.index(k.bench) + 1 for k in kinds], sizes),
        np.concatenate([r.misplaced for r in records]),
    )


def channel_kinds(c: ChannelCampaign, slopes: Slopes = NONE) -> ChannelKinds:
    """One channel of a campaign, power-on by power-on.

    slopes: family -> error -> (n,) of its curves at the records, SI/K
    """
    model = c.model
    columns = columns_of_errors(model, c.parts)
    unfitted = _lead_astray(c)
    rows = np.column_stack([*columns.values()])
    white = c.whiten(np.column_stack([rows, c.prior.columns, *unfitted.values()]))
    known = rows.shape[1] + len(c.prior.sigma)
    per_kind = _products(white[:, :known], white, c.runs.starts)
    u = np.abs(sensed(model.sensor, model.conditions)[:, model.channel])
    return ChannelKinds(
        model.sensor,
        model.channel,
        tuple(_terms(c, list(columns))),
        per_kind[:, :, :known],
        tuple(Term(error, name, tabled=False, driven=False) for error, name in unfitted),
        per_kind[:, :, known:],
        c.prior.sigma,
        tuple(u.name if u.of == "reference" else "" for u in c.prior.unknowns),
        np.array([u.of == "undeclared" for u in c.prior.unknowns], dtype=bool),
        rows,
        u,
        c.runs.starts,
        {} if not slopes else _strayed(c, np.column_stack([rows, c.prior.columns]), slopes),
    )


def _together(c: ChannelKinds, weights: Array) -> ChannelKinds:
    """A channel of kinds that are sums (t, g) of others."""

    def sums(of_kinds: Array) -> Array:
        return np.asarray(np.tensordot(weights, of_kinds, axes=1))

    rows = [slice(a, z) for a, z in pairwise([*c.starts.tolist(), len(c.rows)])]
    made = [[rows[k] for k in np.flatnonzero(n) for _ in range(int(n[k]))] for n in weights]
    order = np.concatenate([np.arange(len(c.rows))[some] for each in made for some in each])
    sizes = [sum(some.stop - some.start for some in each) for each in made]
    return replace(
        c,
        information=sums(c.information),
        astray=sums(c.astray),
        rows=c.rows[order],
        inputs=c.inputs[order],
        starts=np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64),
        strayed={name: sums(each) for name, each in c.strayed.items()},
    )


def _products(A: Array, B: Array, starts: NDArray[np.int64]) -> Array:
    """(g, a, b) A_kᵀ B_k of every power-on: its rows of A (n, a) and B (n, b)."""
    sizes = np.diff(np.append(starts, len(A)))
    found = np.empty((len(starts), A.shape[1], B.shape[1]))
    for size in np.unique(sizes).tolist():
        those = np.flatnonzero(sizes == size)
        rows = starts[those, None] + np.arange(size)
        found[those] = np.swapaxes(A[rows], 1, 2) @ B[rows]
    return found


def _strayed(c: ChannelCampaign, A: Array, slopes: Slopes) -> dict[str, Array]:
    """Family -> (g, m, m) of columns A (n, m)."""
    W, columns = c.solved(A), squared_columns(c.model, c.parts, c.spec.unit)
    together = strayed_variances(columns, c.slopes())
    return {
        name: _products(W * np.reshape(strayed_variances(columns, of) - together, (-1, 1)), W, c.runs.starts)
        for name, of in slopes.items()
    }


def _lead_astray(c: ChannelCampaign) -> dict[tuple[ErrorName, str], Array]:
    """(n,) columns of the unfitted errors that have a constant or a curve; the rest is noise of records."""
    unit, found = c.spec.unit, {}
    for (error, term), z in unfitted_columns(c.model, c.parts, unit).items():
        budget = budget_of(unit, error)
        if budget is not None and budget.whole_variation > 0.0:
            found[error, term] = z
    return found


def _terms(c: ChannelCampaign, columns: Sequence[tuple[ErrorName, str]]) -> Iterator[Term]:
    carried = {one.effect.name: one for one in c.model.carried}
    for error, name in columns:
        own = carried[error.effect]
        tabled = own.nodes is not None
        shared = any(t.shared for t in own.effect.terms(c.model.sensor) if t.name == name)
        nodal = getattr(own.effect, "nodal", False)
        yield Term(error, name, tabled, tabled and own.effect.group == "scale_factor", shared, nodal)
