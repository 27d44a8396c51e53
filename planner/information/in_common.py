"""What channels that are solved one by one share: references, coefficients that all have, means of curves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from planner.information.told import Alike, Told, shared_places
from planner.nouns.array import Array

MEANS = "means of the curves"
THERMOMETER = "thermometer"


@dataclass
class Common:
    """What channels have in common through references that err: every channel is solved for itself.

    And through coefficients s that all three have: cov(θ̂_a, θ̂_b) = C_as C_ss⁻¹ C_sb, of one group of
    channels or of two (along: sensor -> Σ_a R C_as of each group that was added). Of the references,
    with D = ∂θ̂/∂r of one channel, the covariance of two is D_a s² D_bᵀ, and of a channel with the reference
    itself −D s²: so sums over the channels, squared, less their own squares. So, too, the means of curves
    that were measured on several units, and what a thermometer that errs makes of them: every error and
    channel of a unit has its own at once.
    """

    sums: dict[str, Array] = field(default_factory=dict)
    own: list[Array] = field(default_factory=list)
    joined: Array = field(default_factory=lambda: np.zeros((1, 1, 1, 1)))
    along: dict[str, list[Array]] = field(default_factory=dict)

    def add(self, group: Alike, found: Told, R: Array) -> None:
        """A group of channels; R: of `reads`."""
        if common := shared_places(group, found.places):
            self.joined = self.joined + through_shared(found, R, common)
            if group.beside:
                self._across(group.first.sensor, *along_shared(found, R, common))
        if not any(any(c.references) for c in group.channels):
            return
        D = (R @ found.beside[:, :, None]) / group.first.sigma
        for c, channel in zip(group.channels, D, strict=True):
            for j, name in enumerate(c.references):
                if name:
                    self._one(name, channel[..., j])

    def add_means(self, of_terms: Iterable[Array]) -> None:
        """What the mean of the curve of every term makes of d, (B or 1, S, ρ)."""
        for z in of_terms:
            self._one(MEANS, z)

    def add_misread(self, of_terms: Iterable[Array]) -> None:
        """What one sigma of each thermometer makes of d by the mean of every term's curve, (b, B, S, ρ)."""
        for each in of_terms:
            for b, z in enumerate(each):
                self._one(f"{THERMOMETER} {b}", z)

    def _across(self, sensor: str, across: Array, weights: Array) -> None:
        total = across.sum(axis=0)
        for other in self.along.setdefault(sensor, []):
            both = total @ weights @ np.swapaxes(other, -1, -2)
            self.joined = self.joined + both + np.swapaxes(both, -1, -2)
        self.along[sensor].append(total)

    def _one(self, name: str, z: Array) -> None:
        self.sums[name] = self.sums.get(name, 0.0) + z
        self.own.append(z)

    def between(self) -> Array:
        """(B, 1, S, ρ, ρ), to be added to every family."""
        total = self.joined + sum(_square(z) for z in self.sums.values()) - sum(map(_square, self.own))
        return np.asarray(total[:, None])


def through_shared(found: Told, R: Array, common: Sequence[int]) -> Array:
    """(B, S, ρ, ρ) of any two channels, by coefficients that all have; what is undetermined is left out."""
    across, weights = along_shared(found, R, common)
    total = across.sum(axis=0)
    own = (across @ weights @ np.swapaxes(across, -1, -2)).sum(axis=0)
    return np.asarray(total @ weights @ np.swapaxes(total, -1, -2) - own)


def along_shared(found: Told, R: Array, common: Sequence[int]) -> tuple[Array, Array]:
    """R C_as (a, B, S, ρ, s) of each channel, and C_ss⁻¹ (B, 1, s, s), which is the same of all."""
    seen = ~found.undetermined[0][:, common]  # (B, s)
    both = seen[:, :, None] & seen[:, None, :]
    shared = np.where(both, found.covariance[0][:, common][:, :, common], 0.0)
    across = (R @ found.covariance[:, :, None][..., common]) * seen[:, None, None]
    return across, np.linalg.pinv(shared, hermitian=True)[:, None]


def _square(z: Array) -> Array:
    return np.asarray(z[..., :, None] * z[..., None, :])
