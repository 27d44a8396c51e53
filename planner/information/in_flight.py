"""What a requirement sees of a flight: temperatures, the linear combination, what the flight draws itself.

    Σ_own(T) = J (s(T) s(T)ᵀ + σ² exp(−|Δt|/τ) + w²(D_flight)) Jᵀ
             + white noise + initial attitude + height aid

None of it depends on the campaign, so it is made once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner.campaign.noise import budget_of
from planner.nouns.array import Array
from planner.plan.flight_response import FlightResponse, Flying
from planner.spec.budget import STORAGE_DAYS
from planner.spec.model import PercentileRule, Requirement, Spec

SCENARIOS = 40  # temperatures at which a flight over the range is looked at: as the fastest curves ask
STEP_K = 0.5  # of a flight that warms: a day of it has then no more temperatures than a minute
UP = 2  # of position, velocity, attitude
STILL_K = 0.1  # a flight whose temperature changes by less is a flight at one temperature


@dataclass(frozen=True)
class Asked:
    """One requirement. S flight temperatures (scenarios), I instants, c components, F terms, m moments.

    limit: SI; share: of the flights, None for rss; weights: (S,) of the scenarios, None: the worst counts
    profile: (S, K) temperatures at the response's moments; instants: of the response
    temperature_degc: (S, m) along the flight; own: (S, I, c, I, c)
    response: (S or 1, I, c, F, m); S where an effect changes with temperature by its own equation
    """

    index: int
    limit: float
    share: float | None
    weights: Array | None
    profile: Array
    instants: tuple[int, ...]
    temperature_degc: Array
    response: Array
    own: Array


def asked(
    index: int,
    spec: Spec,
    response: FlightResponse,
    start_degc: Array,
    weights: Array | None,
    thinned: int,
    days: float,
) -> Asked:
    """A requirement of a spec on flights that start at temperatures (S,), for at most `thinned` instants.

    days: from the campaign's end, over which errors walk in store
    """
    wanted = spec.requirement[index]
    components, instants = response.of(wanted)
    chosen = _thinned(instants, thinned)
    along = profiles(spec, response, start_degc, clipped=wanted.temperature != "flight")
    J = response.started(along, chosen, components)
    own = drawn_by_flights(spec, response, J, along, days) + _white(spec, response, components, chosen)
    own = own + _of_height(response, components, len(chosen)) + _of_alignment(response, components, chosen)
    J, seen = collapsed(J, along)
    return Asked(index, wanted.limit.si, share_of(wanted), weights, along, tuple(chosen), seen, J, own)


def collapsed(J: Array, along: Array) -> tuple[Array, Array]:
    """Response (S or 1, ..., F, m) and temperatures (S, m); one moment where the temperature stands still."""
    if np.ptp(along, axis=1).max(initial=0.0) < STILL_K:
        return J.sum(axis=-1, keepdims=True), along[:, :1]
    return J, along


def share_of(wanted: Requirement) -> float | None:
    """The share of flights that a requirement promises; None for rss."""
    return wanted.rule.percentile if isinstance(wanted.rule, PercentileRule) else None


def profiles(spec: Spec, response: FlightResponse, start_degc: Array, *, clipped: bool) -> Array:
    """(S, K) the flight's temperature, shifted to start at (S,); clipped: kept in the range of use."""
    flown = response.temperature_degc
    warmed = np.round((flown - flown[0]) / STEP_K) * STEP_K
    shifted = start_degc[:, None] + warmed[None, :]
    return np.asarray(np.clip(shifted, *spec.plan.temperatures.range) if clipped else shifted)


def _thinned(instants: Sequence[int], most: int) -> list[int]:
    """So many of the instants, the last one among them."""
    if len(instants) <= most:
        return list(instants)
    place = np.linspace(0, len(instants) - 1, most + 1)[1:]
    return [instants[round(float(p))] for p in place]


def drawn_by_flights(spec: Spec, response: FlightResponse, J: Array, along: Array, days: float) -> Array:
    """(S, I, c, I, c) by power-on, drift and storage, each flight's own; J: (S or 1, I, c, F, K)."""
    at = response.moments
    apart = np.abs(at[:, None] - at[None, :])
    total = np.zeros((len(along), *J.shape[1:3], *J.shape[1:3]))
    for i, f in enumerate(response.flying):
        x = J[:, :, :, i].reshape(len(J), -1, J.shape[-1])
        if not np.any(x):
            continue
        still, drawn = drawn_in_flight(spec, f, along, apart, days)
        own = x @ (still if drawn is None else still + drawn) @ np.swapaxes(x, 1, 2)
        total += own.reshape(len(own), *total.shape[1:])
    return total


def drawn_in_flight(
    spec: Spec, f: Flying, along: Array, apart: Array, days: float
) -> tuple[Array, Array | None]:
    """(K, K) of drift and storage; (S, K, K) of the power-on."""
    budget = budget_of(spec.unit, f.error)
    if budget is None:
        return np.zeros_like(apart), None
    walk = budget.storage_sigma**2 * days / STORAGE_DAYS
    still = budget.in_run_sigma**2 * np.exp(-apart / budget.in_run_time) + walk
    s = budget.run_to_run_sigma(along)
    drawn = s[:, :, None] * s[:, None, :]
    length = budget.temperature_correlation
    if length is not None:
        drawn = drawn * np.exp(-0.5 * ((along[:, :, None] - along[:, None, :]) / length) ** 2)
    return still, drawn


def _of_height(response: FlightResponse, components: slice, instants: int) -> Array:
    """(I, c, I, c) by the height aid, whose error the computed height has all along."""
    up = np.tile(np.arange(*components.indices(9)) == UP, (instants, 1)).astype(float)
    return np.asarray(response.height**2 * np.einsum("xa,ye->xaye", up, up))


def _of_alignment(response: FlightResponse, components: slice, instants: Sequence[int]) -> Array:
    """(I, c, I, c) by the initial attitude's own chances; a self-alignment's tilt is in the response."""
    A = response.aligned[instants][:, components]
    return np.asarray(np.einsum("xas,yes->xaye", A, A))


def _white(spec: Spec, response: FlightResponse, components: slice, instants: Sequence[int]) -> Array:
    """(I, c, I, c) by the sensors' white noise."""
    W = response.white[instants][:, components]
    density = np.array([spec.unit.white("gyro"), spec.unit.white("accelerometer")])
    return np.asarray(np.einsum("xasb,yesb,s->xaye", W, W, density**2, optimize=True))
