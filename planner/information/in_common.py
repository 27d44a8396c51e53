"""What channels that are solved one by one share: references that err, coefficients that all have."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.information.told import Alike, Told, shared_places, through_shared
from planner.nouns.array import Array


@dataclass
class Common:
    """What channels have in common through references that err: every channel is solved for itself.

    And through coefficients s that all three have: cov(θ̂_a, θ̂_b) = C_as C_ss⁻¹ C_sb. Of the references,
    with D = ∂θ̂/∂r of one channel, the covariance of two is D_a s² D_bᵀ, and of a channel with the reference
    itself −D s²: so sums over the channels, squared, less their own squares.
    """

    campaigns: int
    sums: dict[str, Array] = field(default_factory=dict)
    own: list[tuple[NDArray[np.intp], Array]] = field(default_factory=list)
    joined: Array | None = None

    def add(self, group: Alike, found: Told, R: Array) -> None:
        """A group of channels on some of the campaigns; R: of `reads`."""
        if common := shared_places(group, found.places):
            between = through_shared(found, R, common)
            if self.joined is None:
                self.joined = np.zeros((self.campaigns, *between.shape[1:]))
            self.joined[found.which] += between
        if not any(any(c.references) for c in group.channels):
            return
        D = (R @ found.beside[:, :, None]) / group.first.sigma
        for c, channel in zip(group.channels, D, strict=True):
            for j, name in enumerate(c.references):
                if name:
                    z = channel[..., j]
                    if name not in self.sums:
                        self.sums[name] = np.zeros((self.campaigns, *z.shape[1:]))
                    self.sums[name][found.which] += z
                    self.own.append((found.which, z))

    def between(self) -> Array:
        """(B, 1, S, ρ, ρ), to be added to every family."""
        joined = np.zeros((self.campaigns, 1, 1, 1)) if self.joined is None else self.joined
        if not self.sums:
            return np.asarray(joined[:, None])
        total = np.sum([_square(z) for z in self.sums.values()], axis=0)
        for which, z in self.own:
            total[which] -= _square(z)
        return np.asarray((total + joined)[:, None])


def _square(z: Array) -> Array:
    return np.asarray(z[..., :, None] * z[..., None, :])
