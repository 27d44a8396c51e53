"""Variances of what a requirement asks, at many starts at once.

A root mean square, and the search for the worst start, need the diagonal of d's covariance alone (`asked` has
all of it). With own what is asked of the unit's values in flight and G what is asked of coefficients, a curve
adds

    var (own f − G C f_bench) = own M ownᵀ − 2 G C M' ownᵀ + G C M'' Cᵀ Gᵀ,     M, M', M'': second moments

The first is the flight's alone and is kept for other campaigns, as are its drift and its draw of run to run;
the last is one matrix of the coefficients for all starts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.nouns.array import Array
from planner.spec.budget import STORAGE_DAYS
from planner.verify.asked import Navigation
from planner.verify.foreseen import Foresight, Seen
from planner.verify.second_moments import Error, Moment

ROOM = 4_000_000  # numbers of one array: starts are taken so many at a time
Moments = Mapping[Error, Moment]


@dataclass(frozen=True)
class AtStarts:
    """One requirement, foreseen at temperatures degc (S, K) along the flight from S starts."""

    asked: Navigation
    foresight: Foresight
    degc: Array

    def variances(self, family: str, moments: Moments) -> Array:
        """(S, R) with the curves of a family, which has these moments."""
        return self._rest + self._kept(family, moments) + self._tabled(moments) + self._coherent(moments)

    @cached_property
    def seen(self) -> list[Seen]:
        """Every start by itself, for whole covariances."""
        return [self.foresight.seen(self.asked.at(one), one) for one in self.degc]

    @property
    def _rows(self) -> int:
        return len(self.asked.beside)

    @cached_property
    def _reads(self) -> Array:
        """G (S, R, P): what is asked of every coefficient, as tables are read in flight."""
        G = np.zeros((len(self.degc), self._rows, len(self.foresight.estimates.noise)))
        for error, term, places, weights in self.foresight.read(self.degc):
            if error in self.asked.asked:
                for at, asked in self._of(error):
                    G[at, :, places] = np.ascontiguousarray(asked[:, :, term]) @ weights[at]
        return G

    def _of(self, error: Error) -> Iterator[tuple[slice, Array]]:
        """(R, K, t) asked of an error that stands for itself, and the starts at which it is that."""
        own, effect, columns = self.asked.asked[error], error[1], self.asked.columns
        if len(columns.warmer(effect)):
            for s, one in enumerate(self.degc):
                yield slice(s, s + 1), columns.at(own, effect, one)
        else:
            known = self.foresight.estimates
            numbers = own.shape[0] * own.shape[2] * max(len(known.degc), len(known.days) + 1)
            each = max(1, ROOM // numbers)
            for first in range(0, len(self.degc), each):
                yield slice(first, min(first + each, len(self.degc))), own

    def _flown(self) -> Iterator[tuple[Error, slice, Array]]:
        """Every budgeted error: itself, starts, and (t, R, K) what is asked of it there."""
        f = self.foresight
        for error in f.unit.budgets:
            by = f.by(error)
            for at, asked in self._of((error[0], by)):
                if by == error[1]:
                    yield error, at, _by_term(asked)
                else:  # its share in the other error's table changes with the temperature
                    for s in range(at.start, at.stop):
                        yield error, slice(s, s + 1), _by_term(f.own(error, asked, self.degc[s]))

    # ------------------------------------------------------------ the flight's own

    def _kept(self, family: str = "", moments: Moments | None = None) -> Array:
        """(S, R) of drift and run to run, or of a family's curves themselves: no campaign changes them."""
        f = self.foresight  # the share of an error in another one's table may go by the flight's day
        carried = any(f.by(error) != error[1] for error in f.unit.budgets)
        key = (family, f.day if carried else None, *self.degc.shape, self.degc.tobytes())
        if key not in self.asked.kept:
            found = np.zeros((len(self.degc), self._rows))
            for error, at, own in self._flown():
                if moments is None:
                    found[at] += self._of_power_on(error, own, self.degc[at])
                elif error in moments:
                    found[at] += [moments[error].squares(own, one) for one in self.degc[at]]
            self.asked.kept[key] = found
        return self.asked.kept[key]

    def _of_power_on(self, error: Error, own: Array, degc: Array) -> Array:
        """(S, R) of an error's drift and of its draw of run to run; own (t, R, K)."""
        budget = self.foresight.unit.budgets[error]
        found = np.zeros((len(degc), own.shape[1]))
        if budget.in_run_sigma > 0:
            found += _through(own, self.foresight.drift[error])
        s, length = budget.run_to_run_sigma(degc), budget.temperature_correlation
        if length is None:
            return found + _squares(own @ s.T, "trs")
        for i, one in enumerate(degc):
            found[i] += _through(own * s[i], np.exp(-0.5 * (np.subtract.outer(one, one) / length) ** 2))
        return found

    # ------------------------------------------------------------ the campaign's

    @cached_property
    def _rest(self) -> Array:
        """(S, R) of all but the curves: noise, runs and references of the campaign, constants, walks."""
        f, G = self.foresight, self._reads
        found = np.diag(self.asked.beside) + self._kept() + _quadratic(G, f.estimates.noise)
        for error, at, own in self._flown():
            budget, whole = f.unit.budgets[error], own.sum(axis=2).T  # (R, t)
            constant = whole - _over(G[at], f.estimates.constant[error])
            found[at] += budget.systematic_size**2 / 3.0 * _squares(constant, "srt")
            if budget.storage_sigma > 0:
                found[at] += budget.storage_sigma**2 * self._walked(error, G[at], whole)
        return found

    def _walked(self, error: Error, G: Array, whole: Array) -> Array:
        """(S, R) of a walk of unit sigma in STORAGE_DAYS, as `Foresight.walked`; whole (R, t)."""
        known, day = self.foresight.estimates, self.foresight.day
        steps = -_over(G, known.walk[error])  # (S, R, t, D); then the flight's own
        flown = np.broadcast_to(whole[..., None], (*steps.shape[:3], 1))
        later = np.cumsum(np.concatenate([steps, flown], axis=3)[..., ::-1], axis=3)[..., ::-1]
        width = np.diff(np.concatenate([[0.0], known.days, [max(day, known.days[-1])]])) / STORAGE_DAYS
        return _squares(later * np.sqrt(width), "srtd")

    def _coherent(self, moments: Moments) -> Array:
        """(S, R) of the curves' means, which all terms and units have at once, beyond their own squares."""
        known, G = self.foresight.estimates, self._reads
        whole, squares = np.zeros((2, len(self.degc), self._rows))
        for error, at, own in self._flown():
            if error in moments and moments[error].mean is not None:
                told = np.moveaxis(_over(G[at], known.curve[error]), 2, 1)  # (S, t, R, N)
                each = [moments[error].common(own, one) for one in self.degc[at]]
                z = np.array(each) - [moments[error].common(one, known.degc) for one in told]  # (S, R, t)
                whole[at] += z.sum(axis=2)
                squares[at] += _squares(z, "srt")
        return np.asarray(whole**2 - squares)

    def _tabled(self, moments: Moments) -> Array:
        """(S, R) of what tables say of curves, G C M'' Cᵀ Gᵀ − 2 G C M' ownᵀ, and of misread curves."""
        known, G = self.foresight.estimates, self._reads
        found = _quadratic(G, self.foresight.told(moments))
        for error, at, own in self._flown():
            if error in moments:
                told = _over(G[at], known.curve[error])  # (S, R, t, N)
                met = np.stack([moments[error].between(one, known.degc) for one in self.degc[at]], axis=1)
                across = (own @ met.reshape(own.shape[2], -1)).reshape(*own.shape[:2], *met.shape[1:])
                found[at] -= 2.0 * np.einsum("srtn,trsn->sr", told, across)
        return found


def _by_term(asked: Array) -> Array:
    """(t, R, K) of (R, K, t), side by side: products of strided arrays take ten times as long."""
    return np.ascontiguousarray(np.moveaxis(asked, 2, 0))


def _squares(rows: Array, axes: str) -> Array:
    """(S, R) sums of squares over all axes but those named s and r."""
    return np.asarray(np.einsum(f"{axes},{axes}->sr", rows, rows))


def _through(own: Array, kernel: Array) -> Array:
    """(R,) diagonal of Σ over terms of own K ownᵀ; own (t, R, K)."""
    return np.asarray(np.einsum("trk,trk->r", own @ kernel, own))


def _quadratic(G: Array, kernel: Array) -> Array:
    """(S, R) diagonals of G K Gᵀ; G (S, R, P)."""
    return np.asarray(np.einsum("srp,srp->sr", G @ kernel, G))


def _over(G: Array, estimates: Array) -> Array:
    """(S, R, P) · (P, ...) -> (S, R, ...)."""
    return np.asarray((G @ estimates.reshape(len(estimates), -1)).reshape(*G.shape[:2], *estimates.shape[1:]))
