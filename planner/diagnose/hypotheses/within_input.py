"""The most that a coefficient can be: where an effect acts, it adds no more than the input itself.

    |c_k| max |G_k| ≤ u,   G_k the column of term k where the unit is driven on all axes by u

u is a gravity, or a turn of 100 deg/s, which the least of gyros measures, or what the records drive the
sensor with if that is more. Records in which f_x f_y is a rounding "limit" a g-product to 6e5 deg/s/g²: that
is no limit, and what fits such a coefficient is not the effect. The model equations of IEEE Std 1293 and 952
are an input with its errors, of which each is less than it; a scale factor's no more than a share of it. A
reference of gravity that changed between days is a reading that does not follow its input: a cubic of −0.5.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

from planner.diagnose.channels.channel import LARGEST
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.references.references import Reference, hypothesis
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Effect, Sensor
from planner.units import STANDARD_GRAVITY_MPS2

LEAST_INPUT: Mapping[Sensor, float] = {
    "gyro": float(np.radians(100.0)), "accelerometer": STANDARD_GRAVITY_MPS2,
}  # fmt: skip
DEGC, TIMES_ON_S = (-60.0, -20.0, 20.0, 50.0, 80.0), (3600.0, 600.0, 60.0)
RAMP = 1.0 / 60.0  # K/s, as a chamber of the kind that K 2.6 has
DAY = 1.0


def most_of_terms(block: Block, driven: Conditions) -> Mapping[str, float]:
    """Term -> the most that its coefficient can be, SI, by nature or by the input; infinite without either.

    driven: the records, whose largest input counts. What is of the bench is no error of an input.
    """
    known = hypothesis(block.name)
    by_nature = (known.largest or {}).get(block.sensor, np.inf)
    if isinstance(known, Reference) or known.bench_only:
        return dict.fromkeys(block.terms, by_nature)
    by_input = _by_input(known, block, driven)
    return {term: min(by_nature, most) for term, most in by_input.items()}


def _by_input(effect: Effect, block: Block, driven: Conditions) -> dict[str, float]:
    sensor = block.sensor
    largest = {
        "gyro": float(np.abs(driven.rate).max(initial=LEAST_INPUT["gyro"])),
        "accelerometer": float(np.abs(driven.specific_force).max(initial=LEAST_INPUT["accelerometer"])),
    }
    everywhere = _everywhere(largest["gyro"], largest["accelerometer"])
    columns = effect.regressors(sensor, everywhere, block.nonlinear)
    reach = np.abs(columns).max(axis=(0, 1))
    most = np.divide(largest[sensor], reach, out=np.full(len(reach), np.inf), where=reach > 0.0)
    most *= LARGEST if effect.group == "scale_factor" else 1.0
    return dict(zip((t.name for t in effect.terms(sensor)), most.tolist(), strict=True))


@cache
def _everywhere(rate: float, force: float) -> Conditions:
    """Every sign of the input on three axes, cold to hot, each a power-on of its own, on a ramp."""
    signs = np.array(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0])).reshape(3, -1).T
    t, T, sign = (x.ravel() for x in np.meshgrid(TIMES_ON_S, DEGC, np.arange(len(signs)), indexing="ij"))
    along: Array = signs[sign.astype(int)]
    n = len(t)
    return Conditions(rate * along, force * along, T, np.full(n, RAMP), t, np.full(n, DAY))
