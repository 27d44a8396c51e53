"""Whether a unit's curves over temperature can be of the families that leave the spec's table of residuals.

Two things are asked of the nodes of every error, all channels together, V = M + C:

    size     Q = Σ_channels zᵀ (LᵀVL)⁻¹ z,   z = Lᵀv     the nodes' spread, of which constants are free
    shape    D = max |v_k − v̂_k| / σ_k                   every node from the others (leave one out)

D's residuals are those of P = V⁻¹ − V⁻¹11ᵀV⁻¹/1ᵀV⁻¹1: (Pv)_k / √P_kk. Curves are not Gaussian, and nobody
knows their family, so both are judged by curves drawn from each family, with the noise of the estimates: the
rank among n draws is exact under that family (Barnard, JRSS B 25 (1963) 294), the largest p-value counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.calibrate.curve_nodes import CurveNodes, Size, contrasts, curve_nodes, size_of
from planner.campaign.estimate import Estimate
from planner.information.curves import Curves
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.solvers.kriging import NUGGET
from planner.spec.curve_names import families_of
from planner.spec.own_units import own_unit
from planner.units import displayed

DRAWS = 10_000
LEVEL = 0.01  # family-wise over the errors of a sensor and both questions
SEED = 1
MANY = 1e4  # degrees of freedom, from which on noise is normal


@dataclass(frozen=True)
class Nodes:
    """One error's channels with M at their nodes: whitened contrasts, and P's rows scaled to unit variance.

    places: (K,) of each channel among the points
    """

    channels: Sequence[CurveNodes]
    places: Sequence[NDArray[np.intp]]
    moments: Sequence[Array]

    def asked(self, values: Sequence[Array]) -> tuple[Array, Array]:
        """(n,) Q and (n,) D of values (n, K) of every channel."""
        Q, D = 0.0, []
        for v, (white, left) in zip(values, self._forms(), strict=True):
            Q = Q + np.sum((v @ white.T) ** 2, axis=1)
            D.append(np.abs(v @ left.T).max(axis=1))
        return np.asarray(Q), np.max(D, axis=0)

    def farthest(self) -> tuple[CurveNodes, int, float, float]:
        """The node that the others miss by most: its channel, which it is, by how many sigma, and by what.

        One sigma is 1/√P_kk, SI.
        """
        forms = [left for _, left in self._forms()]
        each = [np.abs(left @ c.values) for c, left in zip(self.channels, forms, strict=True)]
        one = int(np.argmax([x.max() for x in each]))
        node = int(each[one].argmax())
        sigmas = float(each[one][node])
        return self.channels[one], node, sigmas, sigmas / float(forms[one][node, node])

    def without_the_farthest(self) -> Nodes:
        """All but that node; a channel that then has one node says nothing of its curve."""
        c, k, _, _ = self.farthest()
        left = []
        for one, own, M in zip(self.channels, self.places, self.moments, strict=True):
            keep = np.arange(len(own)) != k if one is c else np.ones(len(own), dtype=bool)
            both = np.ix_(keep, keep)
            fewer = replace(
                one,
                degc=one.degc[keep],
                values=one.values[keep],
                noise=one.noise[both],
                freedom=one.freedom[keep],
            )
            left.append((fewer, own[keep], M[both]))
        left = [x for x in left if len(x[1]) > 1] or left
        return Nodes(*zip(*left, strict=True))

    def drawn(self, pool: Array, rng: np.random.Generator) -> list[Array]:
        """(DRAWS, K) of every channel: curves (n, N) taken from a pool, and the noise of its estimates.

        The noise by Student's t, for its size was found in the data too.
        """
        found = []
        for c, own in zip(self.channels, self.places, strict=True):
            freedom = max(float(np.min(c.freedom)), 1.0)
            wide = np.sqrt(freedom / rng.chisquare(freedom, size=(DRAWS, 1))) if freedom < MANY else 1.0
            value, vector = np.linalg.eigh(c.noise)
            root = vector * np.sqrt(np.maximum(value, 0.0))
            noise = rng.normal(size=(DRAWS, len(own))) @ root.T
            found.append(pool[rng.integers(len(pool), size=DRAWS)][:, own] + wide * noise)
        return found

    def _forms(self) -> Iterator[tuple[Array, Array]]:
        for c, M in zip(self.channels, self.moments, strict=True):
            V = M + c.noise
            V = V + NUGGET * np.diag(np.diag(V))
            L = contrasts(len(V))
            root = np.linalg.cholesky(L.T @ V @ L)
            white = np.linalg.solve(root, L.T)
            P = white.T @ white
            yield white, P / np.sqrt(np.diag(P))[:, None]


def contradictions(fits: Sequence[Estimate], curves: Curves) -> list[str]:
    """A sentence for every error of one sensor whose nodes no family of the spec explains."""
    every, found = [c for c in curve_nodes(fits) if len(c.degc) > 1], list[str]()
    errors = list(dict.fromkeys(c.error for c in every))
    for error in errors:
        mine = [c for c in every if c.error == error]
        points = np.unique(np.concatenate([c.degc for c in mine]))
        prior = curves.prior(error, points)
        if prior is not None and np.any(prior):
            names = families_of(curves.spec)
            pools: dict[str, Array] = {n: curves.pool(n, error, points).T.astype(np.float64) for n in names}
            unit = own_unit(curves.spec, *error)
            found += _said(nodes_at(mine, points, prior), pools, LEVEL / (2 * len(errors)), unit)
    return found


def nodes_at(channels: Sequence[CurveNodes], points: Array, prior: Array) -> Nodes:
    """Channels whose nodes are among the points (N,), where curves have the second moment prior (N, N)."""
    places = [np.searchsorted(points, c.degc) for c in channels]
    return Nodes(channels, places, [prior[np.ix_(own, own)] for own in places])


def p_values(nodes: Nodes, pools: Mapping[str, Array]) -> tuple[float, float]:
    """Of Q, both tails, and of D, the upper one: the largest over the families' curves (n, N)."""
    (Q,), (D,) = nodes.asked([c.values[None] for c in nodes.channels])
    sizes, shapes = [], []
    for pool in pools.values():
        q, d = nodes.asked(nodes.drawn(pool, np.random.default_rng(SEED)))
        above, below, far = ((1.0 + np.sum(x)) / (DRAWS + 1.0) for x in (q >= Q, q <= Q, d >= D))
        sizes.append(min(1.0, 2.0 * float(min(above, below))))
        shapes.append(float(far))
    return max(sizes), max(shapes)


def _said(nodes: Nodes, pools: Mapping[str, Array], level: float, unit: str) -> Iterator[str]:
    """What is too large or too small, unless it is so for one node's sake alone."""
    size, shape = p_values(nodes, pools)
    families = f"the famil{'ies' if len(pools) > 1 else 'y'} {', '.join(pools)}"
    one_node = shape < level and (size >= level or p_values(nodes.without_the_farthest(), pools)[0] >= level)
    if one_node:
        c, k, sigmas, missed = nodes.farthest()
        name = ".".join(c.error)
        yield (
            f"the curve of {name} {AXES[c.channel]} over temperature contradicts {families}: its node at "
            f"{c.degc[k]:.0f} degC lies {displayed(missed, unit):.2g} {unit} from what the others say, "
            f"{sigmas:.1f} sigma (p {shape:.1g}). Measure there and beside it again; if it stays, give the "
            "measured curve as temperature_residual, or look for what else changes there (planner diagnose)"
        )
    elif size < level:
        found = size_of(nodes.channels, nodes.moments)
        times, low, high = (f"{x**0.5:.2g}" for x in (found.most, found.low, found.high))
        yield (
            f"the curves of {'.'.join(nodes.channels[0].error)} over temperature contradict {families} that "
            f"the spec's table of residuals leaves: they are {times} times as large ({low} to {high}, "
            f"p {size:.1g}). {_remedy(found, times)}"
        )


def _remedy(size: Size, times: str) -> str:
    if size.most > 1.0:
        return (
            f"The plan's promise and the intervals between nodes do not hold for this unit: multiply "
            f"temperature_residual by {times}, or give the measured curve, and plan again"
        )
    return f"Fewer temperatures would do: multiply temperature_residual by {times} and plan again"
