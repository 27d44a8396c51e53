"""What a campaign leaves in flight: the covariance of every error's rest, and of the navigation error.

    e(t) = −(estimate's error) + (curve that straight lines miss) + r' + g'(t) + (w(D_flight) − what was seen)
    Σ_d = J cov(e) Jᵀ + white noise of the flight

r', g' are the flight's own power-on and drift; the walk w goes on from the campaign's end until the flight.
The XX in them, so the second moment of the very curves that the simulator draws goes through it. Prior
knowledge of the curve is not used. Channels count as independent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.campaign.design import design
from planner.campaign.model import Campaign, ChannelCampaign, Known, campaign
from planner.campaign.noise import budget_of, columns_of_errors
from planner.campaign.power_ons import of_design
from planner.campaign.prior import walk_mode
from planner.nouns.array import Array
from planner.nouns.plan import Plan
from planner.nouns.sensor import ErrorName
from planner.nouns.trajectory import Trajectory
from planner.plan.flight_response import FlightResponse, flight_response
from planner.protocols import SENSORS, Sensor
from planner.simulate.campaign import prepared
from planner.simulate.temperature_curves import CurveFamily, second_moment
from planner.solvers.gaussian_length import percentile
from planner.spec.budget import STORAGE_DAYS, ErrorBudget
from planner.spec.model import PercentileRule, Requirement, Spec
from planner.temperature_table import REACH_K, hats

CURVES = 600  # drawn of every family: a second moment is then known to 4 %, of a part of the whole
DRAWS = 20_000  # of flights, for a requirement at any moment: a 95 % quantile is then known to 0.7 %
Families = Mapping[tuple[Sensor, str], CurveFamily]


@dataclass(frozen=True)
class Predicted:
    """One requirement as the campaign model has it: rms of |d| and, for a percentile, its quantile; SI."""

    requirement: int
    rms: float
    quantile: float | None


def with_flown(plan: Plan, spec: Spec, flight: Trajectory | None) -> Plan:
    """The plan with what will be flown beside every requirement of probability, on the spec's own flight.

    Nothing is predicted for published coefficients, and where the attitude at the start is known to some
    accuracy only.
    """
    if flight is None or spec.initial_alignment is not None or not plan.steps:
        return plan
    made = campaign(spec, of_design(design(plan.steps, spec)))
    errors = [ErrorName.of(sensor, effect) for sensor in SENSORS for effect in getattr(spec.unit, sensor)]
    response = flight_response(flight, errors, spec.requirement)
    found = predicted(spec, made, response, prepared(spec).families, spec.plan.seed)
    figures = {p.requirement: p.rms if p.quantile is None else p.quantile for p in found or ()}
    return replace(
        plan,
        requirements=tuple(
            r if r.rule == "worst_case" else replace(r, flown=figures.get(i))
            for i, r in enumerate(plan.requirements)
        ),
    )


def predicted(
    spec: Spec, made: Campaign, response: FlightResponse, families: Families, seed: int = 0
) -> tuple[Predicted, ...] | None:
    """Every requirement on the spec's flight; None where a coefficient that flies is not observable."""
    S = rests(spec, made, response, families, np.random.default_rng(seed))
    if S is None:
        return None
    return tuple(_requirement(i, wanted, spec, response, S) for i, wanted in enumerate(spec.requirement))


def rests(
    spec: Spec, made: Campaign, response: FlightResponse, families: Families, rng: np.random.Generator
) -> Array | None:
    """(F·K, F·K) covariance of every term's rest at every moment, term by term; None if one is not told."""
    F, K = len(response.flying), len(response.moments)
    S = np.zeros((F, K, F, K))
    degc = np.concatenate([_temperatures(made.runs.conditions.temperature_degc), response.temperature_degc])
    moments = {name: second_moment(one, degc, CURVES, rng) for name, one in families.items()}
    for (sensor, channel), c in made.channels.items():
        mine = [i for i, f in enumerate(response.flying) if (f.error.sensor, f.channel) == (sensor, channel)]
        block = _Channel(spec, c, c.known(), response, mine, moments).covariance()
        if block is None:
            return None
        S[np.ix_(mine, range(K), mine, range(K))] = block.reshape(len(mine), K, len(mine), K)
    return S.reshape(F * K, F * K)


@dataclass(frozen=True)
class _Channel:
    """One channel in flight. mine: which of the flying terms are its."""

    spec: Spec
    campaign: ChannelCampaign
    known: Known
    response: FlightResponse
    mine: Sequence[int]
    curves: Mapping[tuple[Sensor, str], Array]

    def covariance(self) -> Array | None:
        """(f·K, f·K) of the rests of this channel's terms."""
        H = self._read()
        if np.any(H[:, self.known.undetermined]):
            return None
        p = self.campaign.model.linear
        C = self.known.whole
        walks = self._walks()
        cross = H @ C[:p, p:] @ walks.T
        total = H @ C[:p, :p] @ H.T + (walks * self.campaign.prior.sigma**2) @ walks.T + cross + cross.T
        total += self._own()
        for D, moment in self._curves(H):
            total += D @ moment @ D.T
        return np.asarray(total)

    def _rows(self, place: int) -> slice:
        K = len(self.response.moments)
        return slice(place * K, (place + 1) * K)

    def _read(self) -> Array:
        """(f·K, p) what the flight takes from the coefficients: constants, or tables at its temperature."""
        columns = self.known.columns
        H = np.zeros((len(self.mine) * len(self.response.moments), len(columns)))
        t = self.response.temperature_degc
        for place, i in enumerate(self.mine):
            f = self.response.flying[i]
            own = [k for k, c in enumerate(columns) if (c.effect, c.term) == (f.error.effect, f.term)]
            if not own:
                continue
            nodes = np.array([columns[k].node_degc for k in own])
            weights = np.ones((len(t), 1)) if np.isnan(nodes).any() else hats(t, nodes, REACH_K)
            H[self._rows(place), own] = weights
        return H

    def _walks(self) -> Array:
        """(f·K, q) what the shared unknowns of the campaign still do at its end: the walks' modes."""
        unknowns = self.campaign.prior.unknowns
        found = np.zeros((len(self.mine) * len(self.response.moments), len(unknowns)))
        for place, i in enumerate(self.mine):
            f = self.response.flying[i]
            for k, u in enumerate(unknowns):
                if u.error == f.error and u.term == f.term:
                    found[self._rows(place), k] = walk_mode(u.mode, np.array(1.0))
        return found

    def _own(self) -> Array:
        """What the flight draws anew: power-on, drift, and the walk from the campaign's end."""
        t, at = self.response.temperature_degc, self.response.moments
        apart = np.abs(at[:, None] - at[None, :])
        found = np.zeros((len(self.mine) * len(at),) * 2)
        for place, i in enumerate(self.mine):
            budget = budget_of(self.spec.unit, self.response.flying[i].error)
            if budget is None:
                continue
            s = budget.run_to_run_sigma(t)
            length = budget.temperature_correlation
            kept = 1.0 if length is None else np.exp(-0.5 * ((t[:, None] - t[None, :]) / length) ** 2)
            drift = budget.in_run_sigma**2 * np.exp(-apart / budget.in_run_time)
            rows = self._rows(place)
            found[rows, rows] = np.outer(s, s) * kept + drift + self._stored(i, budget)
        return found

    def _stored(self, i: int, budget: ErrorBudget) -> float:
        """Variance of the walk that no mode of the campaign carries, up to the flight."""
        f = self.response.flying[i]
        day = self.campaign.model.conditions.day
        span = float(day.max(initial=0.0))
        modes = [u.mode for u in self.campaign.prior.unknowns if (u.error, u.term) == (f.error, f.term)]
        carried = float(sum(walk_mode(k, np.array(1.0)) ** 2 for k in modes))
        days = span * (1.0 - carried) + self.spec.flown_after_days
        return budget.storage_sigma**2 * days / STORAGE_DAYS

    # ------------------------------------------------------------ curves

    def _curves(self, H: Array) -> list[tuple[Array, Array]]:
        """(D, second moment) of every error's curve: what it is in flight less what the tables say of it."""
        c = self.campaign
        seen = _temperatures(c.runs.conditions.temperature_degc)
        here = (np.round(c.runs.conditions.temperature_degc, 3)[:, None] == seen[None, :]).astype(float)
        p = c.model.linear
        gain = self.known.whole[:p] @ c.white.T
        columns = columns_of_errors(c.model, c.parts)
        found = []
        for place, i in enumerate(self.mine):
            f = self.response.flying[i]
            z, moment = columns.get((f.error, f.term)), self.curves.get(f.error.parts)
            if z is None or moment is None:
                continue
            D = np.zeros((len(H), len(moment)))
            D[:, : len(seen)] = -H @ (gain @ c.whiten(z[:, None] * here))
            rows = self._rows(place)
            D[rows, len(seen) :] += np.eye(len(self.response.moments))
            found.append((D, moment))
        return found


def _temperatures(degc: Array) -> Array:
    """The temperatures of records, to a millikelvin."""
    return np.unique(np.round(degc, 3))


# ---------------------------------------------------------------- requirements


def _requirement(
    index: int, wanted: Requirement, spec: Spec, response: FlightResponse, S: Array
) -> Predicted:
    components, instants = response.of(wanted)
    J = response.errors[instants][:, components].reshape(len(instants), -1, S.shape[0])
    covariance = np.einsum("mkp,pq,mlq->mkl", J, S, J) + _white(spec, response, components, instants)
    p = wanted.rule.percentile if isinstance(wanted.rule, PercentileRule) else None
    rms = float(np.sqrt(max(np.trace(one) for one in covariance)))
    if p is None:
        return Predicted(index, rms, None)
    if len(instants) == 1:
        return Predicted(index, rms, float(percentile(covariance, p)[0]))
    return Predicted(index, rms, _any(J, S, p))


def _white(spec: Spec, response: FlightResponse, components: slice, instants: list[int]) -> Array:
    """(m, k, k) by the sensors' white noise."""
    W = response.white[instants][:, components]
    density = np.array([spec.unit.white("gyro"), spec.unit.white("accelerometer")])
    return np.asarray(np.einsum("mksb,mlsb,s->mkl", W, W, density**2))


def _any(J: Array, S: Array, p: float) -> float:
    """The quantile of the largest length over the instants, by draws; white noise is small and left out."""
    value, vector = np.linalg.eigh(S)
    root = vector * np.sqrt(np.maximum(value, 0.0))
    draws = np.random.default_rng(0).normal(size=(S.shape[0], DRAWS))
    longest = np.zeros(DRAWS)
    for at in J:
        longest = np.maximum(longest, np.linalg.norm(at @ root @ draws, axis=0))
    return float(np.quantile(longest, p))
