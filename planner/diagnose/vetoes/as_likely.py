"""Whether a claim is as likely a process that the spec budgets for every channel of a sensor.

    z = C γ + K x + e,   x ~ N(0, f² I),   0 ≤ f ≤ 1

in whitened rows clear of all else that is believed: K (n, k) modes of the process, one sigma of the budget
each, γ the coefficients of what is believed, C its columns. f is one for the sensor's channels, which are of
one kind: as large as the rows of all three say, never more than the budget. Both stand against each other,
each as likely as it can be,

    Λ = max_f,γ 2 log L(f, γ) − max_f 2 log L(f, 0)

and what is believed must be beyond chance by Λ (F of its columns and the freedom of its noise), once for each
value of a parameter that it had to choose, and once for each name that the search had to choose from: of what
wanders it takes the likest, a drift in a hundred of them at 3.6 sigma. Or the process takes hardly any of it
(Lindley, Smith, J. R. Stat. Soc. B 34, 1972, 1).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.hypotheses.found import ALPHA, SINGLE, Found
from planner.diagnose.hypotheses.pool import inverse
from planner.diagnose.noise.whitened import Cleared, Whitened, log_p
from planner.diagnose.vetoes.in_stretches import Stretched
from planner.diagnose.vetoes.own_noise import KEPT
from planner.nouns.array import Array

TOLD = 1e-10  # of the largest square of a mode: one with less is nothing beside the noise of rows
Rows = Whitened | Cleared | Stretched  # a channel's, white
Given = tuple[Array, Rows]  # and the modes (n, k) of a process there
SHARES = np.append(0.0, np.geomspace(1e-3, 1.0, 61))  # f: of 300 modes one is known to a twentieth


def as_likely(found: Found, b: int, budgeted: Mapping[int, Given]) -> bool:
    """Whether a believed block is as likely a process that the spec budgets for every channel.

    budgeted: axis -> (n, k) columns of the process, one sigma of the budget each, and the channel, white
        beside it
    """
    block, s = found.pool.blocks[b], found.share(b)
    gain = likelier([_beside(found, b, a, *given) for a, given in budgeted.items()])
    if s.m == 0 or gain >= KEPT * s.delta:
        return False
    own = sum(x.key == block.key for x in found.pool.blocks)
    every = len({x.key for x in found.pool.blocks})
    return bool(log_p(gain, s.m, s.freedom, s.s2) > np.log(min(SINGLE / own, ALPHA / every)))


def explained_in(found: Found, b: int, channels: Mapping[int, Rows]) -> float:
    """Δ of a believed block in the rows of some channels, beside all else that is believed."""
    none = {axis: np.empty((found.pool.blocks[b].columns[axis].shape[0], 0)) for axis in found.axes(b)}
    return likelier([_beside(found, b, axis, none[axis], channels[axis]) for axis in none])


def likelier(channels: Sequence[tuple[Budgeted, Array]]) -> float:
    """Λ of some channels, each with the process and columns C (n, m) of what is believed beside it."""
    unlikely = np.sum([w.unlikely for w, _ in channels], axis=0)
    G, h = (np.sum(x, axis=0) for x in zip(*(w.seen(C) for w, C in channels if C.shape[1]), strict=True))
    explained = np.array([hf @ inverse(Gf) @ hf for Gf, hf in zip(G, h, strict=True)])
    return float(unlikely.min() - np.min(unlikely - explained))


def _beside(found: Found, b: int, axis: int, modes: Array, w: Rows) -> tuple[Budgeted, Array]:
    """A channel and the columns (n, m) of a block there, clear of all else that is believed."""
    pool = found.pool
    others = [pool.blocks[o].columns[axis] for o in found.others(b) if axis in found.axes(o)]
    nothing = np.empty((len(modes), 0))
    known = orthonormal(np.column_stack([w.Q, w.noise.whiten(np.column_stack([nothing, *others]))]))
    C, K = (clear(known, w.noise.whiten(x)) for x in (pool.blocks[b].columns.get(axis, nothing), modes))
    return Budgeted.of(K, clear(known, w.z)), C


@dataclass(frozen=True)
class Budgeted:
    """White rows with a process of each share of the budget. U: (n, k) orthonormal, K = U s Vᵀ its modes

    taken: (f, k) 1 − 1 / (1 + f² s²), of the square along U; unlikely: (f,) −2 log L without anything else
    """

    z: Array
    U: Array
    taken: Array
    unlikely: Array

    @classmethod
    def of(cls, K: Array, z: Array) -> Budgeted:
        """K: (n, k) modes times the budget's sigma; z: (n,)."""
        squares, V = np.linalg.eigh(K.T @ K)  # a fifth of the time of K's own decomposition
        told = squares > TOLD * squares.max(initial=0.0)
        s = np.sqrt(squares[told])
        U = (K @ V[:, told]) / s
        grown = (SHARES[:, None] * s) ** 2
        taken = grown / (1.0 + grown)
        return cls(z, U, taken, np.log1p(grown).sum(axis=1) - taken @ (U.T @ z) ** 2)

    def seen(self, C: Array) -> tuple[Array, Array]:
        """(f, m, m) CᵀC and (f, m) Cᵀz of columns C (n, m), in white of rows and process together."""
        B, along = self.U.T @ C, self.U.T @ self.z
        weighed = self.taken[:, :, None] * B
        return C.T @ C - np.swapaxes(weighed, 1, 2) @ B, C.T @ self.z - np.swapaxes(weighed, 1, 2) @ along
