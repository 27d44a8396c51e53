"""What records offer an error along an axis, in words, and what they would need."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import ErrorName
from planner.protocols import Condition
from planner.units import STANDARD_GRAVITY_MPS2

AXES = "xyz"
AT_REST_DPS = 0.1  # above any part of the Earth's rate
NO_LOAD_G = 0.02
MINUTE_S = 60.0
SHOWN = 4  # levels named in a message


def excitation(
    error: ErrorName, channel: int, term: str, seen: Conditions, mixed_with: Sequence[str] = ()
) -> tuple[str, str]:
    """(what the records offer, what to do) for one term of an error; mixed_with: errors it is taken for.

    e.g. `about x the unit turns at 100 deg/s only`, `give them motions at several speeds`
    """
    axis = AXES.index(term[-1]) if term[-1] in AXES else channel
    offers, missing = [], []
    ends = (getattr(catalog.effects()[ErrorName(e).effect], "end", {}) for e in (error, *mixed_with))
    up_to = next((f" up to {end[error.sensor]}" for end in ends if end), "")
    if _feels(error, "rate", seen):
        offers.append(_turns(AXES[axis], seen.rate[:, axis]))
        missing.append(f"turns about {AXES[axis]} at several speeds{up_to}")
    if _feels(error, "specific_force", seen):
        offers.append(_loads(AXES[axis], seen.specific_force[:, axis]))
        missing.append(f"several attitudes or loads along {AXES[axis]}{up_to}")
    if offers:
        return ", and ".join(offers), f"give them {' and '.join(missing)}, by more motions or a list of them"
    effect = catalog.effects()[error.effect]
    asked = [*([effect.variable] if effect.variable else []), *sorted(effect.needs)]
    words = next((SURROUNDINGS[one] for one in asked if one in SURROUNDINGS), None)
    if words is not None:
        return words(seen)
    return (
        f"all records of {AXES[axis]} are alike to it",
        "give them more different motions, or a list of them",
    )


def _warmth(seen: Conditions) -> tuple[str, str]:
    levels = np.unique(np.round(seen.temperature_degc))
    return f"they are made at {_listed(levels, 'degC')}", "make the test at other temperatures too"


def _ramps(seen: Conditions) -> tuple[str, str]:
    levels = np.unique(np.round(seen.temperature_rate * MINUTE_S, 1)) + 0.0
    return (
        f"the temperature moves by {_listed(levels, 'K/min')}",
        "record while it rises and while it falls (temperature: {ramp: 2 K/min})",
    )


def _since_power_on(seen: Conditions) -> tuple[str, str]:
    levels = np.unique(np.round(seen.time_on))
    return (
        f"they are made {_listed(levels, 's')} after power-on",
        "record sooner after power-on (a shorter power_on) and longer (more records in one power-on)",
    )


def _days(seen: Conditions) -> tuple[str, str]:
    return (
        f"they are made on day {_listed(np.unique(np.round(seen.day)), '')}",
        "make them on several days",
    )


SURROUNDINGS: Mapping[Condition, Callable[[Conditions], tuple[str, str]]] = {
    "temperature_degc": _warmth,
    "temperature_rate": _ramps,
    "time_on": _since_power_on,
    "day": _days,
}
"""What records offer an effect that no motion drives, and what they would need, condition by condition."""


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
        return f"{shown[0]} … {shown[-1]} {unit}".strip()
    return " ".join([", ".join(shown), *([unit] if unit else []), "only"])
