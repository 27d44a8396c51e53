"""What a history leaves of a channel, as a few equally likely states, and where they go from there.

    m(T + h) = level + x(T + h)·β + w(h),    (level, β) ~ N(mean, covariance),    w a random walk, var q h

x are the columns of what goes on steadily: ageing, linear in time, and the season.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array

YEAR_DAYS = 365.25
PER_DAYS = 60.0  # storage of a spec is of two months
COLUMNS = 3  # slope, sine and cosine of the year


def columns_at(day: Array) -> Array:
    """(..., n) days -> (..., n, 3): ageing per two months, sine and cosine of the year."""
    angle = 2 * np.pi * day / YEAR_DAYS
    return np.stack([day / PER_DAYS, np.sin(angle), np.cos(angle)], axis=-1)


@dataclass(frozen=True)
class States:
    """S states of a channel on day `last`, SI. level: (S,); beta: (S, p); covariance: (S, 1+p, 1+p) of both

    walk: (S,) variance a day; noise: (S,) variance of a measurement
    """

    last: float
    level: Array
    beta: Array
    covariance: Array
    walk: Array
    noise: Array

    def or_else(self, other: States) -> States:
        """Either of two: one half of the states of each."""
        half = len(self.level) // 2

        def mixed(name: str) -> Array:
            return np.concatenate([getattr(self, name)[:half], getattr(other, name)[half:]])

        return States(self.last, *map(mixed, ("level", "beta", "covariance", "walk", "noise")))

    def moved(self, ahead: Array) -> Array:
        """(h, 1+p) what level and β add to the value after so many days."""
        x = columns_at(self.last + ahead) - columns_at(np.array([self.last]))
        return np.concatenate([np.ones((len(ahead), 1)), x], axis=1)

    def moments(self, ahead: Array) -> tuple[Array, Array]:
        """(S, h) mean and variance of the value."""
        x = self.moved(ahead)
        mean = np.column_stack([self.level, self.beta]) @ x.T
        own = np.einsum("hp,spq,hq->sh", x, self.covariance, x)
        return mean, own + self.walk[:, None] * ahead

    def paths(self, ahead: Array, rng: np.random.Generator, count: int) -> Array:
        """(count, h) futures; path k is of state k mod S: channels of a kind share what is unknown."""
        which = np.arange(count) % len(self.level)
        root = _root(self.covariance)[which]
        start = np.column_stack([self.level, self.beta])[which]
        start = start + np.einsum("kpq,kq->kp", root, rng.standard_normal(start.shape))
        apart = np.diff(ahead, prepend=0.0)
        steps = np.sqrt(self.walk[which, None] * apart) * rng.standard_normal((count, len(ahead)))
        return np.asarray(start @ self.moved(ahead).T + np.cumsum(steps, axis=1))


def _root(covariance: Array) -> Array:
    """Square roots (S, p, p) of covariances that may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :])
