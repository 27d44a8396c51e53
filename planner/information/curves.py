"""Second moments of every family of temperature curves that the promise must hold for."""

from __future__ import annotations

import numpy as np

from planner.information.promise import Moments
from planner.nouns.array import Array
from planner.simulate.campaign import prepared
from planner.simulate.temperature_curves import second_moment
from planner.spec.model import Spec

CURVES = 4000  # drawn of every family: a second moment is then known to 1.6 % in sigma, a part of the whole


def moments_of(spec: Spec, degc: Array) -> dict[str, Moments]:
    """family -> (sensor, effect) -> (N, N) second moment at temperatures (N,), SI²."""
    from planner.simulate.campaign import families_of

    return {
        name: {
            error: second_moment(family, degc, CURVES, np.random.default_rng(spec.plan.seed))
            for error, family in prepared(spec, name).families.items()
        }
        for name in families_of(spec)
    }
