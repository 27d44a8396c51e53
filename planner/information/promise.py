"""What campaigns promise: the navigation error that each requirement sees, for every family of curves.

    d = R (θ̂ − θ) + Σ_e (J_e f_e(T) − R G_e f_e(T_k)) + own,   R = Σ_terms J_term h(T)

R reads the campaign's coefficients at the flight's temperature, with straight lines between the nodes or with
the weights of the posterior mean (`smooth`); f_e, the curve that either misses, goes through its second
moment. Of an error that no effect is declared for nothing is fitted, and f_e is all of it, its constant too:
it flies whole, and leads the estimates of the others astray. The posterior part and the curves depend on the
campaign, `own` does not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from planner.information.curve_weights import CurveWeights
from planner.information.figures import figure_of, is_within
from planner.information.in_common import Common
from planner.information.in_flight import Asked
from planner.information.kinds import Kinds
from planner.information.misread import Misread
from planner.information.remembered import Left, Remembered
from planner.information.seen import Seen, each_start
from planner.information.smooth import Moments, Smooth
from planner.information.tables import nearest
from planner.information.told import Alike, Solved, Tables, Told, told
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.plan.flight_response import Flying
from planner.protocols import Sensor


@dataclass(frozen=True)
class Promise:
    """The model of a promise: kinds of power-on, requirements in flight, second moments of curves.

    points: (N,) degC at which curves are known; families: name -> (sensor, effect) -> (N, N), SI²
    smooth: how tables are read, None: by straight lines; unbudgeted: errors of which the unit has nothing,
        but the fit's noise flies
    constants: (sensor, effect) -> variance of a term of an error that no effect is declared for, SI²
    unread: error -> terms that no temperature of use reaches
    misread: what thermometers do to the curves; None: they are right
    means: (sensor, effect) -> (N,) what all units' curves have in common, SI; in the second moments, too
    strays: family -> that of the kinds whose curves stray as its own do, if it has another name
    solved: the channels of the kinds, handed on to promises of the same kinds
    """

    kinds: Kinds
    asked: tuple[Asked, ...]
    flying: tuple[Flying, ...]
    points: Array
    families: Mapping[str, Moments]
    smooth: Smooth | None = None
    unbudgeted: frozenset[ErrorName] = frozenset()
    constants: Mapping[tuple[Sensor, str], float] = field(default_factory=dict)
    unread: Mapping[ErrorName, frozenset[str]] = field(default_factory=dict)
    misread: Misread | None = None
    means: Mapping[tuple[Sensor, str], Array] = field(default_factory=dict)
    strays: Mapping[str, str] = field(default_factory=dict)
    solved: Solved | None = field(default=None, repr=False, compare=False)
    remembered: Remembered = field(default_factory=Remembered, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.solved is None or self.solved.kinds is not self.kinds:  # else it is of another promise
            object.__setattr__(self, "solved", Solved(self.kinds))

    def figures(self, counts: Array, families: Sequence[str] | None = None) -> Array:
        """(B, families, requirements) quantile or rms in SI, infinite where a coefficient is undetermined."""
        made = np.any(counts > 0, axis=1)
        if not made.all():  # a campaign of nothing tells nothing
            none = np.full((len(counts), len(families or self.families), len(self.asked)), np.inf)
            if made.any():
                none[made] = self.figures(counts[made], families)
            return none
        return self._figures(self.left(counts, families))

    def known_figures(self, counts: Array, families: Sequence[str]) -> Array:
        """`figures`, to rounding; those of one campaign are found once."""
        if not np.any(counts > 0, axis=1).all():
            return self.figures(counts, families)
        return self.remembered.figures(counts, self._chosen(families), self._left, self._figures)

    def _figures(self, left: Left) -> Array:
        """(B, families, requirements) of what campaigns leave."""
        covariances, undetermined = left
        found = [figure_of(a, S) for a, S in zip(self.asked, covariances, strict=True)]
        return np.where(undetermined[:, None, None], np.inf, np.stack(found, axis=2))

    def within(self, counts: Array, lengths: Array, families: Sequence[str]) -> NDArray[np.bool_]:
        """(B,) whether every figure under some families is at most lengths (families, requirements), SI.

        As `figures` says, without looking for the figures.
        """
        covariances, undetermined = self.left(counts, families)
        each = zip(self.asked, covariances, lengths.T, strict=True)
        kept = np.all([is_within(a, S, most).all(axis=1) for a, S, most in each], axis=0)
        return np.asarray(kept & ~undetermined & np.any(counts > 0, axis=1))

    def left(self, counts: Array, families: Sequence[str] | None = None) -> Left:
        """Per requirement (B, families, S, I, c, c) of d; (B,) whether what flies is undetermined."""
        return self.remembered.left(counts, self._chosen(families), self._left)

    def _chosen(self, families: Sequence[str] | None) -> list[int]:
        """The places of the families that are named; None: of all."""
        return [i for i, name in enumerate(self.families) if families is None or name in families]

    def _left(self, counts: Array, families: Sequence[int]) -> Left:
        whole, undetermined = self._whole(counts, families)
        return [self._blocks(a, whole) for a in self.asked], undetermined

    def untold(self, counts: Array) -> dict[ErrorName, tuple[str, ...]]:
        """The errors that fly and of which no record of one campaign (g,) tells some terms: these."""
        names: dict[ErrorName, tuple[str, ...]] = {}
        for group in self._groups:
            found = told(group.alike, counts[None])
            for i, c in product(group.asked, range(len(group.alike.channels))):
                if found.undetermined[c, :, found.places[i]].any():
                    term = group.alike.channels[c].terms[i]
                    names[term.error] = (*names.get(term.error, ()), term.name)
        return names

    def estimated(self, counts: Array) -> Array:
        """(B, n) variances of the estimates of every term that flights read, of a table the largest, SI².

        Infinite where a coefficient is undetermined.
        """
        each: list[Array] = []
        for group in self._groups:
            found = told(group.alike, counts)
            for i in group.asked:
                place, nodes = found.places[i], found.nodes[i]
                own = np.diagonal(found.covariance, axis1=-2, axis2=-1)[..., place]
                own = np.where(found.undetermined[..., place], np.inf, own)
                each += [*(own if nodes is None else np.where(np.isfinite(nodes), own, 0.0)).max(axis=-1)]
        return np.stack(each, axis=1) if each else np.empty((len(counts), 0))

    def seen(self, counts: Array) -> Iterator[tuple[Mapping[int, slice], Seen, Told]]:
        """Every group of channels as counts (B, g) tell it, from every view with its requirements' rows."""
        for group in self._groups:
            found = told(group.alike, counts)
            for view, seen in zip(self._views, group.seen_from, strict=True):
                yield view.rows, seen, found

    def covariances(self, counts: Array) -> tuple[list[Array], NDArray[np.bool_]]:
        """Per requirement (B, families, S, I c, I c) with what goes between its instants.

        And (B,) whether what flies is undetermined.
        """
        whole, undetermined = self._whole(counts, range(len(self.families)))
        return [self._rows(a, whole) for a in self.asked], undetermined

    def _whole(self, counts: Array, families: Sequence[int]) -> tuple[list[Array], NDArray[np.bool_]]:
        """Per view (B, families, S, ρ, ρ) of d; (B,) whether what flies is undetermined."""
        whole = [np.zeros((len(counts), len(families), *v.own.shape)) for v in self._views]
        undetermined = np.zeros(len(counts), dtype=bool)
        common, tables = [Common() for _ in self._views], Tables(counts)
        for group in self._groups:
            found = told(group.alike, counts, tables)
            undetermined |= group.misses(found)
            for v, total, of in zip(group.seen_from, whole, common, strict=True):
                R = v.reads(found)
                total += v.left(found, R, families)
                of.add(group.alike, found, R)
                of.add_means(v.of_means(found, R, group.means))
                of.add_misread(v.of_misread(found, R, group.misread))
        for view, alone, total, of in zip(self._views, self._alone, whole, common, strict=True):
            of.add_means(self._means_alone(view))
            total += alone[[*families]] + of.between()
        return whole, undetermined

    def through_curves(self, counts: Array) -> list[list[CurveWeights]]:
        """What each requirement takes from every curve, with one campaign (g,): what tables miss included."""
        each = [[*self._through_curves(counts, v)] for v in range(len(self._views))]
        return [[p.of_rows(rows) for p in each[v]] for v, rows in map(self._place, self.asked)]

    def _through_curves(self, counts: Array, v: int) -> Iterator[CurveWeights]:
        """Of all that is asked from one view."""
        for group in self._groups:
            one = told(group.alike, counts[None])
            yield from group.seen_from[v].through_curves(one, self.flying, group.flown)
        view = self._views[v]
        place = self.places(view.temperature_degc)
        tabled = set().union(*self.families.values())
        for k, f in enumerate(self.flying):
            J = view.response[:, :, k]
            if k not in self._read and f.error.parts in tabled and np.any(J):
                yield CurveWeights(f.error.parts, place, each_start(J, len(place)))

    def _place(self, a: Asked) -> tuple[int, slice]:
        """From which view a requirement is seen, and its rows there."""
        return next((i, v.rows[a.index]) for i, v in enumerate(self._views) if a.index in v.rows)

    def _rows(self, a: Asked, whole: Sequence[Array]) -> Array:
        view, rows = self._place(a)
        return whole[view][..., rows, rows]

    def _blocks(self, a: Asked, whole: Sequence[Array]) -> Array:
        instants, c = a.response.shape[1:3]
        own = self._rows(a, whole)
        split = own.reshape(*own.shape[:3], instants, c, instants, c)
        return np.asarray(np.moveaxis(np.diagonal(split, axis1=3, axis2=5), -1, 3))

    def without_curves(self) -> Promise:
        """The same where tables miss nothing of the curves; what thermometers do to these is as it was.

        One family by no name where thermometers are right and chambers keep still: without curves all are
        alike.
        """
        differ = self.misread is not None or self.kinds.families
        none: dict[str, Moments] = {name: {} for name in self.families} if differ else {"": {}}
        return replace(self, families=none, means={})

    def under(self, family: str, moments: Moments | None = None) -> Promise:
        """One family alone, with its second moments or others; by no name."""
        known = self.families[family] if moments is None else moments
        means = {error: mean for error, mean in self.means.items() if error in known}
        misread = None if self.misread is None else self.misread.under(family, "")
        strays = {"": self.strayed_as(family)}
        return replace(self, families={"": known}, misread=misread, means=means, strays=strays)

    def among(self, families: Sequence[str]) -> Promise:
        """Some of the families, by their names."""
        known = {name: self.families[name] for name in families}
        return replace(self, families=known, misread=self.misread and self.misread.among(families))

    def strayed_as(self, family: str) -> str:
        """The family of the kinds whose curves stray as those of a family do."""
        return self.strays.get(family, family)

    def reads(self, error: ErrorName, term: str) -> bool:
        """Whether a term must be told: the unit has something of it, and flights read it."""
        return error not in self.unbudgeted and term not in self.unread.get(error, ())

    def moments_of(self, error: ErrorName) -> list[Array | float]:
        """(N, N) or 0 per family: of an error's curve, and of its constant where nothing is fitted of it."""
        constant = self.constants.get(error.parts, 0.0)
        return [constant + family.get(error.parts, 0.0) for family in self.families.values()]

    def misread_of(self, error: ErrorName) -> list[Array | float]:
        """(g, g) or 0 per family: of what thermometers make of an error's curve at the kinds' records."""
        return [0.0] * len(self.families) if self.misread is None else self.misread.of(error.parts)

    @cached_property
    def _views(self) -> list[_View]:
        """Requirements by the temperatures at which they are flown."""
        groups: dict[bytes, list[Asked]] = {}
        for a in self.asked:
            groups.setdefault(a.temperature_degc.tobytes(), []).append(a)
        return [_view(self, group) for group in groups.values()]

    @cached_property
    def _alone(self) -> list[Array]:
        """Per view (families, S, ρ, ρ) of d without any campaign: flights' own draws and the curves."""
        return [_alone(self, view) for view in self._views]

    @cached_property
    def _groups(self) -> list[_Group]:
        """Channels of which something flies; of a sensor without any budget nothing does."""
        assert self.solved is not None  # `__post_init__`
        found = (_group(self, g) for g in self.solved.groups)
        return [group for group in found if group.flown]

    @cached_property
    def _read(self) -> set[int]:
        """The terms that fly and have curves which some estimate reads."""
        return {int(k) for group in self._groups for i in group.curved for k in group.flown[i]}

    def _means_alone(self, view: _View) -> Iterator[Array]:
        """(1, S, ρ) what flies of the mean of every term's curve that no estimate reads."""
        place = self.places(view.temperature_degc)
        for k, f in enumerate(self.flying):
            if f.error.parts in self.means and k not in self._read:
                J = each_start(view.response[:, :, k], len(place))
                yield np.einsum("srm,sm->sr", J, self.means[f.error.parts][place])[None]

    def places(self, degc: Array) -> NDArray[np.intp]:
        """Where temperatures stand among the points."""
        return nearest(self.points, degc)


@dataclass(frozen=True)
class _View:
    """Requirements flown at the same temperatures. rows: requirement -> its rows among ρ

    temperature_degc: (S, m); response: (S or 1, ρ, F, m); own: (S, ρ, ρ) the flights' own draws
    """

    temperature_degc: Array
    response: Array
    rows: Mapping[int, slice]
    own: Array


def _view(promise: Promise, group: Sequence[Asked]) -> _View:
    sizes = [a.response.shape[1] * a.response.shape[2] for a in group]
    ends = np.cumsum([0, *sizes])
    rows = {a.index: slice(int(x), int(y)) for a, (x, y) in zip(group, pairwise(ends), strict=True)}
    flat = [
        a.response.reshape(len(a.response), n, *a.response.shape[3:])
        for a, n in zip(group, sizes, strict=True)
    ]
    starts = max(map(len, flat))
    response = np.concatenate([each_start(J, starts) for J in flat], axis=1)
    degc = group[0].temperature_degc
    own = np.zeros((len(degc), ends[-1], ends[-1]))
    for a, n in zip(group, sizes, strict=True):
        own[:, rows[a.index], rows[a.index]] += a.own.reshape(len(degc), n, n)
    return _View(degc, response, rows, own)


def _alone(promise: Promise, view: _View) -> Array:
    alone = np.repeat(view.own[None], len(promise.families), axis=0)
    place = promise.places(view.temperature_degc)
    for i, f in enumerate(promise.flying):
        J = view.response[:, :, i]
        for k, moment in enumerate(promise.moments_of(f.error)):
            if np.any(moment) and np.any(J):
                M = np.broadcast_to(moment, (len(promise.points),) * 2)
                alone[k] += J @ M[place[:, :, None], place[:, None, :]] @ np.swapaxes(J, 1, 2)
    return alone


@dataclass(frozen=True)
class _Group:
    """Channels that are solved together. flown: term -> (a,) index in the response, fitted ones first

    asked: the terms among these that must be determined: of an error without a budget an undetermined
    coefficient is left at zero, which is what the unit has
    means: term -> (N,) of its curve; misread: term -> (b, g) what each thermometer makes of it
    """

    alike: Alike
    flown: Mapping[int, NDArray[np.intp]]
    asked: tuple[int, ...]
    curved: tuple[int, ...]
    means: Mapping[int, Array]
    misread: Mapping[int, Array]
    seen_from: tuple[Seen, ...]

    def misses(self, found: Told) -> NDArray[np.bool_]:
        """(B,) whether a coefficient that the flight reads is undetermined."""
        read = [found.undetermined[:, :, found.places[i]].any(axis=(0, 2)) for i in self.asked]
        return np.any(read, axis=0) if read else np.zeros(len(found.kinds), dtype=bool)


def _per_term(terms: Mapping[int, Sequence[Array | float]], size: int) -> dict[int, Array]:
    """term -> (families, size, size), of those of which some family has anything."""
    return {
        i: np.stack([np.broadcast_to(m, (size, size)) for m in each])
        for i, each in terms.items()
        if any(map(np.any, each))
    }


def _group(promise: Promise, g: Alike) -> _Group:
    known = {(f.error, f.term, f.channel): i for i, f in enumerate(promise.flying)}
    fitted, terms = len(g.first.terms), [(*c.terms, *c.unfitted) for c in g.channels]
    flown = {}
    for i in range(len(terms[0])):
        each = [known.get((t[i].error, t[i].name, c.channel)) for c, t in zip(g.channels, terms, strict=True)]
        if all(k is not None for k in each):
            flown[i] = np.array(each, dtype=np.intp)
    misread = _per_term({i: promise.misread_of(terms[0][i].error) for i in flown}, len(g.degc))
    N = len(promise.points)
    moments = _per_term({i: promise.moments_of(terms[0][i].error) for i in flown}, N)
    moments |= {i: np.zeros((len(promise.families), N, N)) for i in misread if i not in moments}
    s, read = promise.smooth, {i: terms[0][i].error.parts for i in flown if i < fitted}
    smooth = {} if s is None else {i: (s, error) for i, error in read.items() if error in s.prior}
    strays = tuple(map(promise.strayed_as, promise.families))
    seen = tuple(
        Seen(
            v.temperature_degc,
            {i: np.moveaxis(v.response[:, :, f], 2, 0) for i, f in flown.items()},
            moments,
            misread,
            promise.places(g.degc),
            promise.places(v.temperature_degc),
            smooth,
            strays if promise.kinds.families.issuperset(strays) else (),
        )
        for v in promise._views
    )
    asked = tuple(i for i in flown if i < fitted and promise.reads(terms[0][i].error, terms[0][i].name))
    errors = {i: terms[0][i].error.parts for i in moments}
    common = promise.means, {} if promise.misread is None else promise.misread.means
    means, misled = ({i: of[error] for i, error in errors.items() if error in of} for of in common)
    return _Group(g, flown, asked, tuple(moments), means, misled, seen)
