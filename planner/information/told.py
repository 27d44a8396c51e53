"""What many campaigns tell of a sensor's channels at once: covariances, and what curves do to the estimates.

    M = Λ + Σ_k n_k Q_kᵀ J_k Q_k,   C = M⁻¹,   G_e = C Σ_k n_k Q_kᵀ J_k x_e 1_k

Q_k resolves the terms of a kind into the nodes of the campaign's tables; G_e is what the estimate makes of an
error's curve at the kinds' temperatures, whether anything is fitted of it or not. All campaigns are solved
together, those with fewer nodes with some that are none; and so are the channels of a sensor that have the
same errors and are driven by the same kinds.

What the three channels have a coefficient in common for (of the bench: its arm, its level) is told to each by
the other two: M of one channel, with the Schur complements of the others' on what they share, has the joint
fit's covariance of that channel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.information.inverses import UNSEEN, by_coefficients, inverse
from planner.information.kinds import ChannelKinds, Kinds
from planner.information.tables import hats_of
from planner.measurement import REACHED
from planner.nouns.array import Array
from planner.protocols import AXES
from planner.temperature_table import GAP_K, LEAST_ROWS, nodes_with_rows, temperature_nodes


@dataclass(frozen=True)
class Alike:
    """Channels that are solved together: as many terms of the same errors, driven by the same kinds.

    information: (a, g, b + q, b + q) of a channels; astray: (a, g, b + q, u); degc: (g,) of the kinds
    strayed: family -> (a, g, b + q, b + q) what a chamber's stray makes of its curves, where that is asked
    beside: the other groups of the same sensor, which may have coefficients in common with this one
    last: what the single campaign tells that was asked last, by its counts
    """

    channels: tuple[ChannelKinds, ...]
    information: Array
    astray: Array
    degc: Array
    strayed: Mapping[str, Array]
    beside: list[Alike] = field(default_factory=list, init=False, repr=False, compare=False)
    last: dict[bytes, Told] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def first(self) -> ChannelKinds:
        """One for all."""
        return self.channels[0]

    @cached_property
    def records(self) -> Array:
        """(g,) records of one power-on of each kind."""
        return np.diff(np.append(self.first.starts, len(self.first.rows)))

    @cached_property
    def tabling(self) -> tuple[bytes, ...]:
        """Equal for groups whose tables have the same nodes, whatever the campaign."""
        which, shows = self.first.shows
        return self.records.tobytes(), which.tobytes(), shows.tobytes()

    @cached_property
    def grid(self) -> tuple[Array, Array]:
        """(T,) the temperatures of all kinds, and (g, T) which kind is at which."""
        t, place = np.unique(self.degc, return_inverse=True)
        return t, np.eye(len(t))[place]


class Gains(dict[int, Array]):
    """Term -> (a, B, P, K) what the estimates make of its curve, for each that is asked.

    inverse: (a, B, P, P + q) of M; felt: term -> (a, B, K, P + q) what its curve does to the normal equations
    """

    def __init__(self, inverse: Array, felt: Callable[[int], Array]) -> None:
        super().__init__()
        self.inverse, self.felt = inverse, felt

    def __missing__(self, term: int) -> Array:
        found = self[term] = self.inverse @ np.swapaxes(self.felt(term), 2, 3)
        return found


class Strayed(dict[str, Array]):
    """Family of curves -> (a, B, P, P) C N C, what a chamber's stray makes of them beyond what V has.

    inverse: (a, B, P, P + q) of M; normal: family -> (a, B, P + q, P + q) N, of the normal equations
    """

    def __init__(self, inverse: Array, normal: Callable[[str], Array]) -> None:
        super().__init__()
        self.inverse, self.normal = inverse, normal

    def __missing__(self, family: str) -> Array:
        found = self[family] = self.inverse @ self.normal(family) @ np.swapaxes(self.inverse, -1, -2)
        return found


@dataclass(frozen=True)
class Told:
    """What B campaigns tell on a channels.

    kinds: (B, K) those used first; gains: of the terms, the unfitted ones behind the b fitted
    covariance: (a, B, P, P) of the estimates' errors, 1 of what is no node; whole: the same with what leads
    them astray of which nothing is fitted; beside: (a, B, P, q) with the q shared ones
    undetermined: (a, B, P); places: (b,) columns of each term
    nodes: (b,) (B, N) of its table, infinite where a campaign has no more of them, or None
    """

    kinds: NDArray[np.intp]
    covariance: Array
    whole: Array
    beside: Array
    gains: Gains
    undetermined: NDArray[np.bool_]
    places: tuple[slice, ...]
    nodes: tuple[Array | None, ...]
    tables: Tables
    strayed: Strayed

    def reads(self, temperature_degc: Array) -> list[Array | None]:
        """Per term (B, X, N) hats of its table at temperatures (X,); None: a constant."""
        every = (None if at is None else self.tables.hats_at(temperature_degc, at) for at in self.nodes)
        return list(every)


def alike(channels: Sequence[ChannelKinds], degc: Array) -> list[Alike]:
    """The channels by what can be solved together."""
    groups: dict[object, list[ChannelKinds]] = {}
    for c in channels:
        terms = tuple((t.error, t.tabled, t.driven, t.nodal) for t in c.terms)
        which, shows = c.shows
        driven = shows[which[:, None], which].tobytes()
        unfitted = tuple(t.error for t in c.unfitted)
        groups.setdefault((terms, unfitted, driven, c.sigma.tobytes(), c.references), []).append(c)
    found = [
        Alike(
            tuple(g),
            np.stack([c.information for c in g]),
            np.stack([c.astray for c in g]),
            degc,
            {family: np.stack([c.strayed[family] for c in g]) for family in g[0].strayed},
        )
        for g in groups.values()
    ]
    for one in found:
        one.beside.extend(g for g in found if g is not one and g.first.sensor == one.first.sensor)
    return found


@dataclass(frozen=True)
class Solved:
    """The channels of kinds, which every promise over these kinds has in common."""

    kinds: Kinds

    @cached_property
    def groups(self) -> list[Alike]:
        """By what can be solved together."""
        return alike(self.kinds.channels, self.kinds.degc)


@dataclass(frozen=True)
class Tables:
    """The tables of campaigns with counts (B, g): what is alike for several groups of channels is made once.

    nodes: of groups -> (B, N), (B, D) of tables and of scale factors; hats: temperatures, nodes -> (B, X, N)
    """

    counts: Array
    nodes: dict[object, tuple[Array, Array]] = field(default_factory=dict)
    hats: dict[tuple[bytes, int], Array] = field(default_factory=dict)

    @cached_property
    def kinds(self) -> NDArray[np.intp]:
        """(B, K) the kinds that each campaign uses, ascending, then one that it does not, of no weight."""
        used = self.counts > 0
        row, kind = np.nonzero(used)
        each = used.sum(axis=1)
        found = np.repeat(used.argmin(axis=1)[:, None], max(int(each.max(initial=1)), 1), axis=1)
        found[row, np.arange(len(row)) - np.repeat(np.cumsum(each) - each, each)] = kind
        return found

    def of(self, group: Alike) -> tuple[Array, Array]:
        """Nodes of a group's tables and of its scale factors, one array where they are the same."""
        if group.tabling not in self.nodes:
            nodes, driven = _nodes(group, self.counts)
            known = [*self.nodes.values()]
            nodes = next((x for x, _ in known if np.array_equal(x, nodes)), nodes)
            self.nodes[group.tabling] = nodes, nodes if np.array_equal(driven, nodes) else driven
        return self.nodes[group.tabling]

    def hats_at(self, temperature_degc: Array, nodes: Array) -> Array:
        """(B, X, N) weights of nodes that `of` gave."""
        key = temperature_degc.tobytes(), id(nodes)
        if key not in self.hats:
            self.hats[key] = hats_of(temperature_degc, nodes)
        return self.hats[key]


def told(group: Alike, counts: Array, tables: Tables | None = None) -> Told:
    """What campaigns with counts (B, g) tell; tables: theirs, if other groups have them already.

    A single one is asked for one requirement after the other, with curves and without: it is solved once.
    """
    tables = tables or Tables(counts)
    if len(counts) != 1:
        return _told(group, tables)
    key = counts.tobytes()
    if key not in group.last:
        group.last.clear()
        group.last[key] = _told(group, tables)
    return group.last[key]


@dataclass(frozen=True)
class _Equations:
    """Normal equations of campaigns. M: (a, B, P + q, P + q) of each channel by its own records

    Q: (B, K, b + q, P + q); JQ: (a, B, K, b + q, P + q); repeats: (B, K); places, own: as in Told
    """

    M: Array
    Q: Array
    JQ: Array
    repeats: Array
    places: tuple[slice, ...]
    own: tuple[Array | None, ...]


def _equations(group: Alike, tables: Tables) -> _Equations:
    kinds = tables.kinds
    n = np.take_along_axis(tables.counts, kinds, 1)
    nodes, driven = tables.of(group)
    c, a, (B, K) = group.first, len(group.channels), n.shape
    b, q = len(c.terms), len(c.sigma)
    Q, places = _columns(c, tables, group.degc[kinds], nodes, driven)
    P = Q.shape[-1] - q
    own = tuple((driven if x.driven else nodes) if x.tabled else None for x in c.terms)
    JQ = (group.information.take(kinds, axis=1) * n[:, :, None, None]) @ Q
    M = np.swapaxes(Q.reshape(B, K * (b + q), P + q), 1, 2) @ JQ.reshape(a, B, K * (b + q), P + q)
    if q:
        M[..., range(P, P + q), range(P, P + q)] += c.sigma**-2.0
    for place, at in zip(places, own, strict=True):
        if at is not None:  # what is no node is told by itself, and by nothing else
            M[..., range(place.start, place.stop), range(place.start, place.stop)] += ~np.isfinite(at)
    return _Equations(M, Q, JQ, n, places, own)


def _told(group: Alike, tables: Tables) -> Told:
    kinds, c, e = tables.kinds, group.first, _equations(group, tables)
    M, Q, JQ, places = e.M, e.Q, e.JQ, e.places
    b, q, repeats = len(c.terms), len(c.sigma), e.repeats[:, :, None, None]
    P = Q.shape[-1] - q
    if common := shared_places(group, places):
        M = _joined(M, common)
        for other in group.beside:
            there = _equations(other, tables)
            M[_at(M, common)] += _of_shared(there.M, shared_places(other, there.places)).sum(axis=0)
    C, inflated = inverse(M)
    scatter = C[..., :P, :P] - _led_astray(C, c, P)
    inflated = by_coefficients(inflated[..., :P], M[..., :P, :P]) if q else inflated

    @cache
    def astray() -> Array:
        return np.asarray(np.swapaxes(group.astray[:, kinds] * repeats, -1, -2) @ Q)

    def felt(i: int) -> Array:
        return np.asarray(JQ[:, :, :, i, :] if i < b else astray()[:, :, :, i - b, :])

    def strayed(family: str) -> Array:
        of_kinds = group.strayed[family][:, kinds] * repeats
        return np.asarray((np.swapaxes(Q, -1, -2) @ of_kinds @ Q).sum(axis=2))

    undetermined = inflated > UNSEEN
    for i, far in _far_from_nodes(c, kinds, e.repeats):
        undetermined[:, far, places[i]] = True
    gains, beyond = Gains(C[..., :P, :], felt), Strayed(C[..., :P, :], strayed)
    return Told(
        kinds, scatter, C[..., :P, :P], C[..., :P, P:], gains, undetermined, places, e.own, tables, beyond
    )


def _led_astray(C: Array, c: ChannelKinds, P: int) -> Array:
    """(a, B, P, P) what constants of which nothing is fitted make of the estimates, Σ C_c s⁻² C_cᵀ, C = M⁻¹.

    They err by −C_c c/s² where the unit has c; `gains` carry that to the flight, where c itself flies.
    """
    own = C[..., :P, P:][..., c.missing] / c.sigma[c.missing]
    return np.asarray(own @ np.swapaxes(own, -1, -2))


def _nodes(group: Alike, counts: Array) -> tuple[Array, Array]:
    """(B, N) nodes of tables, and (B, D) those of scale factors: ascending, infinite where there are no more.

    As the fit places them: among many records a temperature of a single one is no node, and temperatures that
    a soaked chamber cannot keep apart share theirs.
    """
    t, at = group.grid
    used = counts > 0
    records = (counts * group.records) @ at
    seen = records > 0
    drives = used & _drives(group.first, used)
    driven = drives.astype(float) @ at > 0
    driven = np.where(driven.any(axis=1, keepdims=True), driven, seen)
    nodes, own = (np.sort(np.where(mask, t, np.inf), axis=1) for mask in (seen, driven))
    close = np.isfinite(nodes[:, 1:]) & (nodes[:, 1:] <= nodes[:, :-1] + GAP_K)
    for b in np.flatnonzero((seen & (records < LEAST_ROWS)).any(axis=1) | close.any(axis=1)):
        fitted = temperature_nodes(np.repeat(group.degc, (counts[b] * group.records).astype(np.int64)))
        nodes[b], own[b] = np.inf, np.inf
        nodes[b, : len(fitted)] = fitted
        fitted = nodes_with_rows(fitted, group.degc[drives[b]])
        own[b, : len(fitted)] = fitted
    return _trimmed(nodes), _trimmed(own)


def _trimmed(nodes: Array) -> Array:
    """(B, N) as many as some campaign has."""
    return nodes[:, : int(np.isfinite(nodes).sum(axis=1).max(initial=1))]


def _drives(c: ChannelKinds, used: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(B, g) whether a kind tells a scale factor among those that each campaign uses (B, g)."""
    which, shows = c.shows
    classes = np.eye(len(shows))[which]
    hidden = (used.astype(float) @ classes > 0).astype(float) @ ~shows > 0
    return np.asarray(~hidden[:, which])


def _columns(
    c: ChannelKinds, tables: Tables, degc: Array, nodes: Array, driven: Array
) -> tuple[Array, tuple[slice, ...]]:
    """(B, K, b + q, P + q) what resolves kinds at (B, K) degC into coefficients; the places of the terms."""
    hats = {False: tables.hats_at(degc, nodes), True: tables.hats_at(degc, driven)}
    b, q = len(c.terms), len(c.sigma)
    ends = np.cumsum([0, *(hats[x.driven].shape[2] if x.tabled else 1 for x in c.terms)])
    places = tuple(slice(int(a), int(z)) for a, z in pairwise(ends))
    P = int(ends[-1])
    Q = np.zeros((*degc.shape, b + q, P + q))
    for i, term in enumerate(c.terms):
        Q[:, :, i, places[i]] = hats[term.driven] if term.tabled else 1.0
    for j in range(q):
        Q[:, :, b + j, P + j] = 1.0
    return Q, places


def _far_from_nodes(
    c: ChannelKinds, kinds: NDArray[np.intp], n: Array
) -> Iterator[tuple[int, NDArray[np.bool_]]]:
    """Nodal terms, and (B,) campaigns without a record near a term's node, as the fit asks (`reached`)."""
    nodal = [i for i, term in enumerate(c.terms) if term.nodal]
    if nodal:
        near = (c.largest[kinds][..., nodal] * (n > 0)[..., None]).max(axis=1)
        yield from zip(nodal, (near < REACHED).T, strict=True)


def shared_places(group: Alike, places: Sequence[slice]) -> list[int]:
    """Columns of the coefficients that all three channels have in common; none where not all are there."""
    if sum(len(g.channels) for g in (group, *group.beside)) < len(AXES):
        return []
    return [places[i].start for i, x in enumerate(group.first.terms) if x.shared and not x.tabled]


def _joined(M: Array, common: Sequence[int]) -> Array:
    """M (a, B, P, P) of every channel with what the others of its group tell of coefficients they share."""
    told = _of_shared(M, common)
    joined = M.copy()
    joined[_at(M, common)] += told.sum(axis=0) - told
    return joined


def _of_shared(M: Array, common: Sequence[int]) -> Array:
    """(a, B, s, s) what each channel by itself tells of some coefficients beside its others."""
    own = np.setdiff1d(np.arange(M.shape[-1]), common)
    across = M[..., own, :][..., common]
    known, _ = inverse(M[..., own, :][..., own])
    return np.asarray(M[_at(M, common)] - np.swapaxes(across, -1, -2) @ known @ across)


def _at(M: Array, common: Sequence[int]) -> tuple[NDArray[np.intp], ...]:
    """Where the rows and columns of some coefficients are in M (a, B, P, P)."""
    return np.ix_(range(len(M)), range(M.shape[1]), common, common)
