"""A name that explains what was found better stands for it, though alone it might not have been found."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.chance import Flips
from planner.diagnose.hypotheses.found import ALPHA, OF_FEW, Found
from planner.diagnose.hypotheses.scores import chance_of, nulls_of, score
from planner.diagnose.search import hidden_columns
from planner.diagnose.search.sensor import SensorFound, diagnose_sensor
from tests.diagnose.hall import Noise, hidden, read, short_ramps
from tests.diagnose.worlds import DECLARED

QUIET = Noise(2e-4, 6e-4)


def _ramps(seed: int, size: float) -> SensorFound:
    """size: deg/s per K/min, on one gyro."""
    hall = short_ramps(seed, 6)
    return diagnose_sensor(
        prepared(hidden(read(hall, seed, gyro=QUIET), "gyro", seed % 3, size * hall.ramp)),
        "gyro",
        DECLARED,
        1,
    )


def _alone(found: Found, name: str, axis: int) -> float:
    """The smallest family-wise p of an effect on a channel where nothing is believed."""
    signs = np.random.default_rng([1, 17]).choice([-1.0, 1.0], size=(999, len(found.pool.cuts)))
    blocks = range(len(found.pool.blocks))
    nulls = nulls_of(found.pool, blocks, Flips(signs, True))
    mine = [b for b in blocks if found.pool.blocks[b].key == (name, (axis,))]
    return min(chance_of(found.pool, b, score(found.pool, [b]), nulls) for b in mine)


def test_a_rate_of_temperature_stands_for_the_lag_that_was_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The lag was significant, the rate explains it better and is not by itself: nothing was said."""
    monkeypatch.setattr(hidden_columns, "_tell_it", lambda *_: True)  # ten power-ons are few to be that close
    s = _ramps(2, 1.4e-4)
    assert [s.found.pool.blocks[b].key for b in s.found.all] == [("temperature_rate", (2,))]
    assert _alone(s.found, "thermal_lag", 2) < OF_FEW * ALPHA < _alone(s.found, "temperature_rate", 2)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_nothing_stands_for_nothing(seed: int) -> None:
    assert _ramps(seed, 0.0).found.all == []
