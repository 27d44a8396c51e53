"""What one view of the flight sees of a group of channels: what their estimates leave, and make of curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.information.drawn import CurveWeights
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
    """

    temperature_degc: Array
    response: Mapping[int, Array]
    moments: Mapping[int, Array]
    misread: Mapping[int, Array]
    of_kind: NDArray[np.intp]
    of_flight: NDArray[np.intp]
    smooth: Mapping[int, tuple[Smooth, tuple[Sensor, str]]]

    def left(self, found: Told, R: Array, families: Sequence[int]) -> Array:
        """(B, families, S, ρ, ρ) what estimates leave, and what they make of the curves; R: of `reads`.

        Σ_channels R (C + Σ_e G_e (M_e + D_e) G_eᵀ) Rᵀ − X − Xᵀ,   X = Σ_e R G_e M_e,flight J_eᵀ

        D_e is what thermometers make of a curve, of which the flight has nothing. It is H + Hᵀ, with
        H = (½ R V − Σ_e J_e M_e,flightᵀ G_eᵀ) Rᵀ and V all that is in brackets.

        All channels, errors and families of a campaign are one product: small ones take longer to call.
        """
        a, B, S, r, P = R.shape
        V, k = found.covariance[:, :, None], found.kinds
        for i, M in self.moments.items():
            among = _among(M[[*families]], self.of_kind[k])
            if i in self.misread:
                among = among + _among(self.misread[i][[*families]], k)
            G = found.gains[i][:, :, None]
            V = V + G @ among @ np.swapaxes(G, -1, -2)
        F = V.shape[2]
        # laid out so that nothing as large as what is read of V is ever copied
        families_beside = np.ascontiguousarray(np.swapaxes(V, 2, 3)).reshape(a, B, P, F * P)
        read = (R.reshape(a, B, S * r, P) @ (0.5 * families_beside)).reshape(a, B, S, r, F, P)
        for i in self.moments:
            self._less_across(read, found, i, families)
        each = read.reshape(a, B, S, r * F, P) @ np.swapaxes(R, -1, -2)
        half = np.moveaxis(each.reshape(a, B, S, r, F, r).sum(axis=0), 3, 1)
        return np.asarray(half + np.swapaxes(half, -1, -2))

    def _less_across(self, read: Array, found: Told, i: int, families: Sequence[int]) -> None:
        """Takes J_e (G_e M_e,flight)ᵀ of one error from ½ R V (a, B, S, ρ, F, P): of this X is made."""
        a, B, P = found.covariance.shape[:3]
        S, m = self.of_flight.shape
        felt = self._in_flight[i][:, [*families]][self.of_kind[found.kinds]]  # (B, K, F, S m)
        seen = (found.gains[i] @ felt.reshape(*felt.shape[:2], -1)).reshape(a, B, P, -1, S, m)
        each, J = seen.transpose(5, 0, 1, 4, 3, 2), self.response[i]  # (m, a, B, S, F, P)
        for moment, one in enumerate(each):
            read -= J[:, None, :, :, None, None, moment] * one[:, :, :, None]

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
                noise = found.covariance[:, :, found.places[i], found.places[i]]
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
