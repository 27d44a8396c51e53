"""What one view of the flight sees of a group of channels: what their estimates leave, and make of curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.information.curve_weights import CurveWeights
from planner.information.smooth import Smooth
from planner.information.told import Told
from planner.nouns.array import Array
from planner.plan.flight_response import Flying
from planner.protocols import Sensor


@dataclass(frozen=True)
class Seen:
    """A group of channels as one view sees it.

    response: term -> (a, S or 1, ρ, m); moments: term -> (families, N, N); misread: term -> (families, g, g)
    of_kind: (g,), of_flight: (S, m) places among the points
    smooth: term -> the error as which its table is read smoothly
    strays: (families,) as which of the kinds' families the curves of each stray; empty: chambers keep still
    """

    temperature_degc: Array
    response: Mapping[int, Array]
    moments: Mapping[int, Array]
    misread: Mapping[int, Array]
    of_kind: NDArray[np.intp]
    of_flight: NDArray[np.intp]
    smooth: Mapping[int, tuple[Smooth, tuple[Sensor, str]]]
    strays: tuple[str, ...] = ()

    def left(self, found: Told, R: Array, families: Sequence[int]) -> Array:
        """(B, families, S, ρ, ρ) what estimates leave, and what they make of the curves; R: of `reads`.

        Σ_channels R (C + C N C + Σ_e G_e (M_e + D_e) G_eᵀ) Rᵀ − X − Xᵀ,   X = Σ_e R G_e M_e,flight J_eᵀ

        D_e is what thermometers make of a curve, of which the flight has nothing; N, what the chamber's stray
        from record to record makes of the family's curves, less what the fit expects of all families.

        All channels, errors and families of a campaign are one product: small ones take longer to call.
        """
        a, B, S, r, P = R.shape
        V = found.covariance[:, :, None]
        if self.strays:
            V = V + np.stack([found.strayed[self.strays[f]] for f in families], axis=2)
        for i, M in self.moments.items():
            G, k = found.gains[i][:, :, None], found.kinds
            among = _among(M[[*families]], self.of_kind[k])
            if i in self.misread:
                among = among + _among(self.misread[i][[*families]], k)
            V = V + G @ among @ np.swapaxes(G, -1, -2)
        F = V.shape[2]
        # laid out so that nothing as large as what is read of V is ever copied
        families_beside = np.ascontiguousarray(np.swapaxes(V, 2, 3)).reshape(a, B, P, F * P)
        read = (R.reshape(a, B, S * r, P) @ families_beside).reshape(a, B, S, r * F, P)
        each = (read @ np.swapaxes(R, -1, -2)).reshape(a, B, S, r, F, r)
        whole = np.moveaxis(each.sum(axis=0), 3, 1)
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
        u = (R @ each).reshape(*R.shape[:-1], F, -1).transpose(2, 1, 3, 4, 0, 5)
        J = self.response[i].transpose(
            1, 0, 3, 2
        )  # one product per start over channels and parts of the flight
        X = u.reshape(S, -1, a * u.shape[-1]) @ J.reshape(len(J), a * u.shape[-1], -1)
        return np.asarray(X.reshape(*u.shape[:4], -1).transpose(1, 3, 0, 2, 4))

    @cached_property
    def _in_flight(self) -> dict[int, Array]:
        """term -> (N, families, S m) moments of its curve between the points and the flight's places."""
        flight = self.of_flight.ravel()
        return {i: np.swapaxes(M[:, :, flight], 0, 1) for i, M in self.moments.items()}

    def of_means(self, found: Told, R: Array, means: Mapping[int, Array]) -> Iterator[Array]:
        """(B, S, ρ) of every term of every channel with a mean, J m(T) − R G m(T_k); means: term -> (N,)."""
        for i, m in means.items():
            there = np.einsum("asrm,sm->asr", self.response[i], m[self.of_flight])
            told = (found.gains[i] @ m[self.of_kind[found.kinds]][None, :, :, None])[..., 0]
            yield from there[:, None] - (R @ told[:, :, None, :, None])[..., 0]

    def of_misread(self, found: Told, R: Array, means: Mapping[int, Array]) -> Iterator[Array]:
        """(b, B, S, ρ) of every term of every channel, −R G m; means: term -> (b, g) by each thermometer."""
        for i, m in means.items():
            told = found.gains[i][:, None] @ m[:, found.kinds][None, ..., None]  # (a, b, B, P, 1)
            yield from -(R[:, None] @ told[:, :, :, None])[..., 0]

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
                weights = np.concatenate([own, each_start(J, len(own))], axis=2)
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
                noise = found.whole[:, :, found.places[i], found.places[i]]
                smooth, error = self.smooth[i]
                h = smooth.weights(error, self.temperature_degc.ravel(), nodes, noise)
            each = h.reshape(*h.shape[:-2], S, m, -1)
            table = R[..., found.places[i]]
            np.multiply(J[:, None, ..., 0, None], each[..., None, 0, :], out=table)
            for k in range(1, m):
                table += J[:, None, ..., k, None] * each[..., None, k, :]
        if found.undetermined.any():
            R *= ~found.undetermined[:, :, None, None]
        return R


def _among(moments: Array, places: NDArray[np.intp]) -> Array:
    """(B, families, K, K) of moments (families, N, N) at places (B, K)."""
    at = places[:, :, None] * moments.shape[-1] + places[:, None, :]
    return np.moveaxis(moments.reshape(len(moments), -1).take(at, axis=1), 0, 1)


def each_start(J: Array, starts: int) -> Array:
    """Responses (S or 1, ...) at each of so many starts (S, ...)."""
    return np.broadcast_to(J, (starts, *J.shape[1:]))
