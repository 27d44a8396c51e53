"""Names that go with the temperature, of records at one chamber point, where that hardly moves.

A unit that warms itself by half a kelvin in the room has a coefficient per kelvin as well told as any other,
and T − 20 °C at 25 °C is a constant but for a tenth: a g-sensitivity over temperature fits where a plain one
is there, a thermal lag where the unit warms up. Which of the two it is the records say by a sigma or two. But
coefficients per kelvin are of a size that shows over the temperatures of a calibration; to be seen as well
within Δ of them one would have to be S/Δ times as large. Its odds beforehand are as much smaller,

    2 log(Δ / S),   S = 60 K,

of the criterion: who is seen beyond that keeps the name.
"""

from __future__ import annotations

import numpy as np

from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.references.references import hypothesis
from planner.effects._history import GRAIN_K
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, asked_once
from planner.temperature_table import temperature_nodes

SPAN_K = 60.0  # from the room to either end of a chamber's range
OVER_TEMPERATURE = {"temperature_degc", "temperature_rate"}


def odds_at_one_temperature(pool: Pool, block: int) -> float:
    """What the criterion of a block owes to how little the temperature moves: 0 of all but such effects."""
    b = pool.blocks[block]
    if b.generic or b.reference or OVER_TEMPERATURE.isdisjoint(hypothesis(b.name).needs):
        return 0.0
    return min(float(_odds(pool.state[axis].channel.model.conditions)) for axis in b.columns)


@asked_once
def _odds(conditions: Conditions) -> Array:
    """2 log(Δ / S), Δ no less than a thermometer reads; 0 where there are several nodes of a table."""
    t = conditions.temperature_degc
    several = len(temperature_nodes(t)) > 1
    return np.asarray(0.0 if several else 2.0 * np.log(min(max(float(np.ptp(t)), GRAIN_K) / SPAN_K, 1.0)))
