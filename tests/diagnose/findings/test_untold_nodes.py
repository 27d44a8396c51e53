"""A node of a table over the rate of temperature that the declared curve over temperature takes up whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.candidates import effect_blocks
from planner.diagnose.search.sensor import begin
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import FACES, Hall, Log, read
from tests.diagnose.worlds import DECLARED

SOAKS = (-40.0, -18.0, -3.5, 24.0, 42.0, 60.0)
SLOW, QUICK = (6.0, -0.8), (8.2, -1.1)  # degC, beyond all soaks near it, and K/min: one ramp each
BOTH_WAYS = [(T, way) for T in (-40.0, -18.0, 60.0) for way in (2.0, -2.0, 1.0, -1.0)]


def _ramps(seed: int) -> Hall:
    """Three power-ons at each soak, ramps both ways through three of them, and two downwards elsewhere."""
    rng, log = np.random.default_rng([seed, 51]), Log()
    for degc in np.repeat(SOAKS, 3):
        log.on(rng.uniform(8.0, 50.0))
        log.on_the_table(rng, degc + 0.3 * rng.normal())
        log.day += 0.3
    for degc, way in [*BOTH_WAYS, SLOW, QUICK]:
        log.on(rng.uniform(8.0, 50.0))
        begins = log.t
        for i in rng.permutation(6):
            log.record(*FACES[i], degc + way * ((log.t + 30.0 - begins) / 60.0 - 2.5), way)
        log.day += 0.2
    return log.hall()


def _read(seed: int) -> DwellTable:
    """The rates of temperature scatter by 0.005 K/min, as a thermometer's slope does."""
    hall = _ramps(seed)
    scatter = 0.005 * np.random.default_rng([seed, 52]).normal(size=len(hall.run))
    return read(replace(hall, ramp=hall.ramp + scatter), seed)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4])
def test_what_two_ramps_alone_come_near_is_no_node(seed: int) -> None:
    channels = begin(prepared(_read(seed)), "gyro", DECLARED).channels
    (block,) = [b for b in effect_blocks(channels, "temperature_rate_table", {}) if 2 in b.columns]
    assert "z 20 degC -2 K/min" not in block.terms
    assert {"z -20 degC -2 K/min", "z -20 degC +2 K/min", "z 60 degC -2 K/min"} < set(block.terms)
