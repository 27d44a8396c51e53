"""What records offer an error along an axis, in words, and what they would need."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import ErrorName
from planner.units import STANDARD_GRAVITY_MPS2

AXES = "xyz"
AT_REST_DPS = 0.1  # above any part of the Earth's rate
NO_LOAD_G = 0.02
SHOWN = 4  # levels named in a message


def excitation(error: ErrorName, channel: int, term: str, seen: Conditions) -> tuple[str, str]:
    """(what the records offer, what to do) for one term of an error.

    e.g. `about x the unit turns at 100 deg/s only`, `give them motions at several speeds`
    """
    axis = AXES.index(term[-1]) if term[-1] in AXES else channel
    offers, missing = [], []
    if _feels(error, "rate", seen):
        offers.append(_turns(AXES[axis], seen.rate[:, axis]))
        missing.append(f"turns about {AXES[axis]} at several speeds")
    if _feels(error, "specific_force", seen):
        offers.append(_loads(AXES[axis], seen.specific_force[:, axis]))
        missing.append(f"several attitudes or loads along {AXES[axis]}")
    if not offers:
        offers.append(f"all records of {AXES[axis]} are alike to it")
        missing.append("more different motions")
    return ", and ".join(offers), f"give them {' and '.join(missing)}, by more motions or a list of them"


def _feels(error: ErrorName, what: Literal["rate", "specific_force"], seen: Conditions) -> bool:
    """Whether the effect's output on this sensor changes with the rate, or with the specific force."""
    effect, other = catalog.effects()[error.effect], replace(seen, **{what: 0.5 * getattr(seen, what) + 0.1})
    return what in effect.needs and not np.array_equal(
        effect.regressors(error.sensor, seen), effect.regressors(error.sensor, other)
    )


def _turns(axis: str, rate: Array) -> str:
    speeds: Array = np.unique(np.round(np.abs(np.degrees(rate)), 1))
    speeds = speeds[speeds > AT_REST_DPS]
    if not len(speeds):
        return f"the unit never turns about {axis}"
    return f"about {axis} the unit turns at {_listed(speeds, 'deg/s')}"


def _loads(axis: str, force: Array) -> str:
    loads = np.unique(np.round(force / STANDARD_GRAVITY_MPS2, 2)) + 0.0
    if np.all(np.abs(loads) < NO_LOAD_G):
        return f"there is never any specific force along {axis}"
    return f"the specific force along {axis} is {_listed(loads, 'g')}"


def _listed(levels: Array, unit: str) -> str:
    shown = [f"{level:g}" for level in levels]
    if len(shown) > SHOWN:
        return f"{shown[0]} … {shown[-1]} {unit}"
    return f"{', '.join(shown)} {unit} only"
