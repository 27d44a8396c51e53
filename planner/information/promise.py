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

from planner.information.drawn import CurveWeights
from planner.information.in_common import Common
from planner.information.in_flight import Asked
from planner.information.kinds import Kinds
from planner.information.remembered import Remembered
from planner.information.smooth import Moments, Smooth
from planner.information.tables import nearest
from planner.information.told import Alike, Told, alike, told
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.plan.flight_response import Flying
from planner.protocols import Sensor
from planner.solvers.length_share import length_within, variances_along, within


@dataclass(frozen=True)
class Promise:
    """The model of a promise: kinds of power-on, requirements in flight, second moments of curves.

    points: (N,) degC at which curves are known; families: name -> (sensor, effect) -> (N, N), SI²
    smooth: how tables are read, None: by straight lines; unbudgeted: errors of which the unit has nothing,
        but the fit's noise flies
    constants: (sensor, effect) -> variance of a term of an error that no effect is declared for, SI²
    unread: error -> terms that no temperature of use reaches
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
    remembered: Remembered = field(default_factory=Remembered, init=False, repr=False, compare=False)

    def figures(self, counts: Array, families: Sequence[str] | None = None) -> Array:
        """(B, families, requirements) quantile or rms in SI, infinite where a coefficient is undetermined."""
        made = np.any(counts > 0, axis=1)
        if not made.all():  # a campaign of nothing tells nothing
            none = np.full((len(counts), len(families or self.families), len(self.asked)), np.inf)
            if made.any():
                none[made] = self.figures(counts[made], families)
            return none
        covariances, undetermined = self.left(counts, families)
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

    def left(
        self, counts: Array, families: Sequence[str] | None = None
    ) -> tuple[list[Array], NDArray[np.bool_]]:
        """Per requirement (B, families, S, I, c, c) of d; (B,) whether what flies is undetermined."""
        named = [*self.families] if families is None else families
        chosen = [i for i, name in enumerate(self.families) if name in named]
        return self.remembered.left(counts, chosen, self._left)

    def _left(self, counts: Array, families: Sequence[int]) -> tuple[list[Array], NDArray[np.bool_]]:
        whole, undetermined = self._whole(counts, families)
        return [self._blocks(a, whole) for a in self.asked], undetermined

    def untold(self, counts: Array) -> dict[ErrorName, tuple[str, ...]]:
        """The errors that fly and of which no record of one campaign (g,) tells some terms: these."""
        names: dict[ErrorName, tuple[str, ...]] = {}
        for group in self._groups:
            found = told(group.alike, counts[None], group.curved)
            for i, c in product(group.asked, range(len(group.alike.channels))):
                if found.undetermined[c, :, found.places[i]].any():
                    term = group.alike.channels[c].terms[i]
                    names[term.error] = (*names.get(term.error, ()), term.name)
        return names

    def covariance(self, counts: Array, requirement: int) -> tuple[Array, NDArray[np.bool_]]:
        """(B, families, S, I c, I c) of one requirement with what goes between its instants.

        And (B,) whether what flies is undetermined.
        """
        only = replace(self, asked=(self.asked[requirement],))
        whole, undetermined = only._whole(counts, range(len(self.families)))
        return whole[0], undetermined

    def _whole(self, counts: Array, families: Sequence[int]) -> tuple[list[Array], NDArray[np.bool_]]:
        """Per view (B, families, S, ρ, ρ) of d; (B,) whether what flies is undetermined."""
        whole = [np.zeros((len(counts), len(families), *v.own.shape)) for v in self._views]
        undetermined = np.zeros(len(counts), dtype=bool)
        common = [Common() for _ in self._views]
        for group in self._groups:
            found = told(group.alike, counts, group.curved)
            undetermined |= group.misses(found)
            for v, total, of in zip(group.seen_from, whole, common, strict=True):
                R = v.reads(found)
                total += v.left(found, R, families)
                of.add(group.alike, found, R)
        for alone, total, of in zip(self._alone, whole, common, strict=True):
            total += alone[[*families]] + of.between()
        return whole, undetermined

    def through_curves(self, counts: Array, requirement: int) -> list[CurveWeights]:
        """What one requirement takes from every curve, with one campaign (g,): what tables miss included."""
        only = replace(self, asked=(self.asked[requirement],))
        view, found = only._views[0], list[CurveWeights]()
        read: set[int] = set()
        for group in only._groups:
            one = told(group.alike, counts[None], group.curved)
            found += group.seen_from[0].through_curves(one, self.flying, group.flown)
            read |= {int(k) for i in group.curved for k in group.flown[i]}
        place = self.places(view.temperature_degc)
        tabled = {error for family in self.families.values() for error in family}
        for k, f in enumerate(self.flying):
            J = view.response[:, :, k]
            if k not in read and f.error.parts in tabled and np.any(J):
                found.append(CurveWeights(f.error.parts, place, _each_start(J, len(place))))
        return found

    def _blocks(self, a: Asked, whole: Sequence[Array]) -> Array:
        view = next(i for i, v in enumerate(self._views) if a.index in v.rows)
        rows = self._views[view].rows[a.index]
        instants, c = a.response.shape[1:3]
        own = whole[view][..., rows, rows]
        split = own.reshape(*own.shape[:3], instants, c, instants, c)
        return np.asarray(np.moveaxis(np.diagonal(split, axis1=3, axis2=5), -1, 3))

    def reads(self, error: ErrorName, term: str) -> bool:
        """Whether a term must be told: the unit has something of it, and flights read it."""
        return error not in self.unbudgeted and term not in self.unread.get(error, ())

    def moments_of(self, error: ErrorName) -> list[Array | float]:
        """(N, N) or 0 per family: of an error's curve, and of its constant where nothing is fitted of it."""
        constant = self.constants.get(error.parts, 0.0)
        return [constant + family.get(error.parts, 0.0) for family in self.families.values()]

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
        found = (_group(self, g) for g in alike(self.kinds.channels, self.kinds.degc))
        return [group for group in found if group.flown]

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
    response = np.concatenate([_each_start(J, starts) for J in flat], axis=1)
    degc = group[0].temperature_degc
    own = np.zeros((len(degc), ends[-1], ends[-1]))
    for a, n in zip(group, sizes, strict=True):
        own[:, rows[a.index], rows[a.index]] += a.own.reshape(len(degc), n, n)
    return _View(degc, response, rows, own)


def _each_start(J: Array, starts: int) -> Array:
    """Responses (S or 1, ...) at each of so many starts (S, ...)."""
    return np.broadcast_to(J, (starts, *J.shape[1:]))


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
    """

    alike: Alike
    flown: Mapping[int, NDArray[np.intp]]
    asked: tuple[int, ...]
    curved: tuple[int, ...]
    seen_from: tuple[_Seen, ...]

    def misses(self, found: Told) -> NDArray[np.bool_]:
        """(B,) whether a coefficient that the flight reads is undetermined."""
        read = [found.undetermined[:, :, found.places[i]].any(axis=(0, 2)) for i in self.asked]
        return np.any(read, axis=0) if read else np.zeros(len(found.kinds), dtype=bool)


@dataclass(frozen=True)
class _Seen:
    """A group of channels as one view sees it.

    response: term -> (a, S or 1, ρ, m); moments: term -> (families, N, N)
    of_kind: (g,), of_flight: (S, m) places among the points
    smooth: term -> the error as which its table is read smoothly
    """

    temperature_degc: Array
    response: Mapping[int, Array]
    moments: Mapping[int, Array]
    of_kind: NDArray[np.intp]
    of_flight: NDArray[np.intp]
    smooth: Mapping[int, tuple[Smooth, tuple[Sensor, str]]]

    def left(self, found: Told, R: Array, families: Sequence[int]) -> Array:
        """(B, families, S, ρ, ρ) what estimates leave, and what they make of the curves; R: of `reads`.

        Σ_channels R (C + Σ_e G_e M_e G_eᵀ) Rᵀ − X − Xᵀ,   X = Σ_e R G_e M_e,flight J_eᵀ

        All channels, errors and families of a campaign are one product: small ones take longer to call.
        """
        a, B, S, r, P = R.shape
        V = found.covariance[:, :, None]
        for i, M in self.moments.items():
            G, k = found.gains[i][:, :, None], self.of_kind[found.kinds]
            among = np.moveaxis(M[[*families]][:, k[:, :, None], k[:, None, :]], 0, 1)
            V = V + G @ among @ np.swapaxes(G, -1, -2)
        F = V.shape[2]
        read = np.swapaxes(R.reshape(a, B, S * r, P), 2, 3)
        Y = (V.reshape(a, B, F * P, P) @ read).reshape(a, B, F, P, S, r).transpose(1, 4, 0, 3, 2, 5)
        X = np.ascontiguousarray(R.transpose(1, 2, 3, 0, 4)).reshape(B, S, r, a * P)
        whole = X @ np.ascontiguousarray(Y).reshape(B, S, a * P, F * r)
        whole = np.moveaxis(whole.reshape(B, S, r, F, r), 3, 1)
        for i in self.moments:
            across = self._across(found, R, i, families)
            whole = whole - across - np.swapaxes(across, -1, -2)
        return np.asarray(whole)

    def _across(self, found: Told, R: Array, i: int, families: Sequence[int]) -> Array:
        """(B, families, S, ρ, ρ) X of one error."""
        a, B, S, _, P = R.shape
        felt = self._in_flight[i][:, [*families]][self.of_kind[found.kinds]]  # (B, K, F, S m)
        F = felt.shape[2]
        seen = (found.gains[i] @ felt.reshape(*felt.shape[:2], -1)).reshape(a, B, P, F, S, -1)
        each = np.ascontiguousarray(seen.transpose(0, 1, 4, 2, 3, 5)).reshape(a, B, S, P, -1)
        u = (R @ each).reshape(*R.shape[:-1], F, -1)
        J = self.response[i]
        return np.asarray(np.einsum("absrfm,asqm->bfsrq", u, np.broadcast_to(J, (a, S, *J.shape[2:]))))

    @cached_property
    def _in_flight(self) -> dict[int, Array]:
        """term -> (N, families, S m) moments of its curve between the points and the flight's places."""
        flight = self.of_flight.ravel()
        return {i: np.swapaxes(M[:, :, flight], 0, 1) for i, M in self.moments.items()}

    def through_curves(
        self, found: Told, flying: Sequence[Flying], flown: Mapping[int, NDArray[np.intp]]
    ) -> Iterator[CurveWeights]:
        """Of every curved term of every channel, for the only campaign that is told."""
        R = self.reads(found)
        used, which = np.unique(self.of_kind[found.kinds[0]], return_inverse=True)
        together = np.eye(len(used))[which]  # repeats at one temperature see one value of a curve
        places = np.concatenate(
            [np.broadcast_to(used, (len(self.of_flight), len(used))), self.of_flight], axis=1
        )
        for i in self.moments:
            gain = found.gains[i][:, 0, None]
            seen = -(R[:, 0] @ (gain @ together))
            for k, own, J in zip(flown[i], seen, self.response[i], strict=True):
                weights = np.concatenate([own, _each_start(J, len(own))], axis=2)
                yield CurveWeights(flying[int(k)].error.parts, places, weights)

    def reads(self, found: Told) -> Array:
        """(a, B, S, ρ, P) what d takes from the coefficients."""
        S, m = self.temperature_degc.shape
        hats = found.reads(self.temperature_degc.ravel())
        a, B, P = found.covariance.shape[:3]
        first = next(iter(self.response.values()))
        R = np.zeros((a, B, S, first.shape[2], P))
        for i, J in self.response.items():
            if i >= len(hats):
                continue  # nothing is fitted of it
            h, nodes = hats[i], found.nodes[i]
            if h is None or nodes is None:
                R[..., found.places[i]] = J.sum(axis=3)[:, None, :, :, None]
                continue
            if i in self.smooth:
                noise = found.covariance[:, :, found.places[i], found.places[i]]
                smooth, error = self.smooth[i]
                h = smooth.weights(error, self.temperature_degc.ravel(), nodes, noise)
            each = h.reshape(*h.shape[:-2], S, m, -1)
            R[..., found.places[i]] = sum(J[:, None, ..., k, None] * each[..., None, k, :] for k in range(m))
        R *= ~found.undetermined[:, :, None, None]
        return R


def _group(promise: Promise, g: Alike) -> _Group:
    known = {(f.error, f.term, f.channel): i for i, f in enumerate(promise.flying)}
    fitted, terms = len(g.first.terms), [(*c.terms, *c.unfitted) for c in g.channels]
    flown = {}
    for i in range(len(terms[0])):
        each = [known.get((t[i].error, t[i].name, c.channel)) for c, t in zip(g.channels, terms, strict=True)]
        if all(k is not None for k in each):
            flown[i] = np.array(each, dtype=np.intp)
    moments, N = {}, len(promise.points)
    for i in flown:
        each_family = promise.moments_of(terms[0][i].error)
        if any(map(np.any, each_family)):
            moments[i] = np.stack([np.broadcast_to(m, (N, N)) for m in each_family])
    s, errors = promise.smooth, {i: terms[0][i].error.parts for i in flown if i < fitted}
    smooth = {} if s is None else {i: (s, error) for i, error in errors.items() if error in s.prior}
    seen = tuple(
        _Seen(
            v.temperature_degc,
            {i: np.moveaxis(v.response[:, :, f], 2, 0) for i, f in flown.items()},
            moments,
            promise.places(g.degc),
            promise.places(v.temperature_degc),
            smooth,
        )
        for v in promise._views
    )
    asked = tuple(i for i in flown if i < fitted and promise.reads(terms[0][i].error, terms[0][i].name))
    return _Group(g, flown, asked, tuple(moments), seen)


def figure_of(a: Asked, S: Array) -> Array:
    """(B, families) the largest figure over the instants: quantile of |d| or its root mean square."""
    if a.share is None:
        square = np.einsum("bfsicc->bfsi", S)
        each = square.max(axis=2) if a.weights is None else np.einsum("bfsi,s->bfi", square, a.weights)
        return np.asarray(np.sqrt(each.max(axis=2)))
    along, c = variances_along(np.moveaxis(S, 3, 2))
    return np.asarray(length_within(along, c, a.share, a.weights).max(axis=2))


def is_within(a: Asked, S: Array, most: Array) -> NDArray[np.bool_]:
    """(B, families) whether `figure_of` is at most (families,)."""
    if a.share is None:
        return np.asarray(figure_of(a, S) <= most)
    along, c = variances_along(np.moveaxis(S, 3, 2))
    each = within(along, c, most[:, None, None])
    share = each.min(axis=-1) if a.weights is None else each @ a.weights
    return np.asarray(share.min(axis=2) >= a.share)
