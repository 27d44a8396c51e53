"""The noise of three channels of one sensor: what one knows from a few runs only all of them tell.

Variances that one channel knows from a few runs only (the share of the input, the scale factor's run-to-run)
are taken as those of the triad, unless the likelihood ratio of its channels says that they differ: a
centrifuge with six runs a channel could otherwise hardly find anything. What moves within power-ons stays a
channel's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.noise.channel_noise import (
    SETTLED,
    ChannelNoise,
    Judged,
    Readings,
    inverse_of,
    noise_of,
    without_zeros,
)
from planner.diagnose.noise.components import IN_RUN, IN_RUN_SCALE
from planner.nouns.array import Array
from planner.solvers.distributions import chi_square_tail
from planner.solvers.random_effects import RandomEffects
from planner.solvers.reml import Variances, reml_and_each
from planner.solvers.restricted_likelihood import reml_information

WELL_KNOWN = 40.0  # degrees of freedom, from which a channel's own variance is as good as the triad's
UNLIKE = 0.05  # p of the likelihood ratio, below which the channels of a triad are judged each for itself


def triad_noise(triad: Sequence[Readings]) -> list[ChannelNoise]:
    """The noise of every channel of a sensor."""
    judged = [r.judged for r in triad]
    own = [j.own for j in judged]
    return [noise_of(j, v) for j, v in zip(judged, without_zeros(_shared(judged, own) or own), strict=True)]


def noise_in_common(triad: Sequence[Readings]) -> list[ChannelNoise] | None:
    """The noise of every channel, what few runs tell taken as the triad's; None where the channels differ."""
    judged = [r.judged for r in triad]
    found = _shared(judged, [j.own for j in judged])
    if found is None:
        return None
    return [noise_of(j, v) for j, v in zip(judged, without_zeros(found), strict=True)]


def _shared(judged: Sequence[Judged], own: Sequence[Variances]) -> list[Variances] | None:
    """Variances that are badly known channel by channel taken from all of them; None where they differ.

    What a channel knows well stays its own: its component is scaled by its own estimate. The rest is one
    restricted likelihood of all channels, and 2 (Σ log L_own − log L_shared) is to be no rarer than UNLIKE.
    """
    if len(judged) < 2 or len({j.components for j in judged}) > 1:
        return None
    poor = np.any([_freedom(v) < WELL_KNOWN for v in own], axis=0)
    poor &= [
        name not in (IN_RUN, IN_RUN_SCALE) for name in judged[0].components
    ]  # each has its own correlation time
    own = without_zeros(own, ~poor)
    sizes = [np.where(poor, 1.0, np.maximum(v.theta, j.least)) for j, v in zip(judged, own, strict=True)]
    if not poor.any() or any((size <= 0).any() for size in sizes):
        return None
    scaled = [
        replace(j.sample, effects=_times(j.sample.effects, size))
        for j, size in zip(judged, sizes, strict=True)
    ]
    try:
        middle = np.mean([v.theta / size for v, size in zip(own, sizes, strict=True)], axis=0)
        together, information = reml_and_each(scaled, middle, SETTLED)
    except ValueError:
        return None
    ratio = 2.0 * (sum(v.loglik for v in own) - together.loglik)
    if chi_square_tail(ratio, (len(judged) - 1) * int(poor.sum())) < UNLIKE:
        return None
    return _of_the_triad(judged, sizes, together.theta, information, poor)


def _freedom(v: Variances) -> Array:
    """(K,) Satterthwaite's degrees of freedom of each variance; none where it is zero."""
    return np.asarray(2.0 * v.theta**2 / np.maximum(np.diag(v.error), 1e-300))


def _times(effects: RandomEffects, factor: Array) -> RandomEffects:
    """Every V_k times factor_k (K,); what moves within power-ons is then known."""
    moving = range(effects.count - len(effects.drifts), effects.count)
    return replace(effects.scaled(factor), known=tuple(moving))


def _of_the_triad(
    judged: Sequence[Judged],
    sizes: Sequence[Array],
    theta: Array,
    told: Array,
    poor: NDArray[np.bool_],
) -> list[Variances]:
    """Each channel's share of a common estimate, known as well as all channels tell it where it was poor.

    told: (channels, K, K) information at θ in units of the sizes
    """
    thetas = [np.maximum(theta * s, j.least) for j, s in zip(judged, sizes, strict=True)]
    own = [
        i / np.outer(s, s) if np.array_equal(t, theta * s) else reml_information(j.sample, t)
        for j, t, s, i in zip(judged, thetas, sizes, told, strict=True)
    ]
    common = inverse_of(np.sum([i * np.outer(s, s) for i, s in zip(own, sizes, strict=True)], axis=0))
    out = []
    for t, s, information in zip(thetas, sizes, own, strict=True):
        error = common * np.outer(s, s)
        alone = np.sqrt(
            np.maximum(np.diag(inverse_of(information)), 0.0) / np.maximum(np.diag(error), 1e-300)
        )
        wider = np.where(poor, 1.0, alone)
        out.append(Variances(t, error * np.outer(wider, wider), t > 0, 0.0, True))
    return out
