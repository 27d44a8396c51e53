"""What a sensor is exposed to: the one question put to every effect."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import wraps
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.physics.swinging_force import swing
from planner.units import STANDARD_GRAVITY_MPS2

T = TypeVar("T")
POSSIBLE_DEGC = (-120.0, 150.0)  # a temperature sensor that reads anything else is dead


@dataclass(frozen=True)
class Conditions:
    """What a sensor is exposed to, at n instants or in n records: the one question put to every effect.

    rate: (n, 3) true inertial angular rate in body axes, rad/s
    specific_force: (n, 3) true specific force in body axes, m/s^2
    temperature_degc: (n,); temperature_rate: (n,) K/s
    time_on: (n,) seconds since power-on; day: (n,) days since the calibration
    """

    rate: Array
    specific_force: Array
    temperature_degc: Array
    temperature_rate: Array
    time_on: Array
    day: Array

    @property
    def means(self) -> Conditions:
        """Those of records without what gravity does in them."""
        return Conditions(**{f.name: getattr(self, f.name) for f in fields(Conditions)})

    def at(self, rows: NDArray[np.int64] | NDArray[np.bool_] | slice) -> Conditions:
        """Some of the rows, in their order."""
        return type(self)(*(getattr(self, f.name)[rows] for f in fields(self)))


@dataclass(frozen=True)
class Swinging(Conditions):
    """Records in some of which gravity goes round the unit.

    swing: (n, K, 3) m/s^2, the specific force less its mean, at K instants spread evenly through each record
    """

    swing: Array

    def at_instants(self, rows: NDArray[np.int64]) -> Conditions:
        """The conditions at every instant of some records, one behind the other: (k K,)."""
        k = self.swing.shape[1]
        at = {f.name: np.repeat(getattr(self, f.name)[rows], k, axis=0) for f in fields(Conditions)}
        at["specific_force"] = at["specific_force"] + self.swing[rows].reshape(-1, 3)
        return Conditions(**at)


def in_records(means: Conditions, duration: Array) -> Conditions:
    """The mean conditions of records, with what gravity does in those that turn about a level axis.

    duration: (n,) s
    """
    found = swing(means.rate, means.specific_force, duration, STANDARD_GRAVITY_MPS2)
    return means if found is None else Swinging(**vars(means), swing=found)


def joined(parts: Sequence[Conditions]) -> Conditions:
    """Conditions one behind the other; those that do not swing stand still."""
    means = {f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Conditions)}
    instants = max((p.swing.shape[1] for p in parts if isinstance(p, Swinging)), default=0)
    if not instants:
        return Conditions(**means)
    swings = [p.swing if isinstance(p, Swinging) else np.zeros((len(p.day), instants, 3)) for p in parts]
    return Swinging(**means, swing=np.concatenate(swings))


def over_records(question: Callable[[Conditions], Array], conditions: Conditions) -> Array:
    """(n, …) what a question has for answer of each row, as a mean over its record.

    mean of h(f̄ + swing), which is h(f̄) of what is linear in f alone
    """
    found = question(conditions)
    if not isinstance(conditions, Swinging):
        return found
    rows = np.flatnonzero(np.any(conditions.swing, axis=(1, 2)))
    each = question(conditions.at_instants(rows))
    averaged = found.copy()
    averaged[rows] = each.reshape(len(rows), conditions.swing.shape[1], *found.shape[1:]).mean(axis=1)
    return averaged


def asked_once(question: Callable[[Conditions], T]) -> Callable[[Conditions], T]:
    """A question whose answer stays with the conditions: hypotheses ask for the same directions 300 times.

    Arrays of an answer are read only.
    """

    @wraps(question)
    def answered(conditions: Conditions) -> T:
        known: dict[str, Any] = conditions.__dict__.setdefault("_answers", {})
        if question.__qualname__ not in known:
            found = question(conditions)
            parts: tuple[Any, ...] = found if isinstance(found, tuple) else (found,)
            for part in parts:
                part.flags.writeable = False
            known[question.__qualname__] = found
        answer: T = known[question.__qualname__]
        return answer

    return answered
