"""The freedom of every column at once is that of each asked by itself; of a pool with a block more too."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.freedoms import of_each_column, satterthwaite
from planner.diagnose.hypotheses.pool import Pool, extended, given, pool_of
from planner.diagnose.search.sensor import begin
from planner.protocols import Sensor
from tests.diagnose.labs.unit import campaign

DECLARED = ("bias", "scale_factor", "misalignment")


@pytest.fixture(scope="module", params=["gyro", "accelerometer"])
def pool(request: pytest.FixtureRequest) -> Pool:
    sensor: Sensor = request.param
    table, _ = campaign(1, fault="base_tilt")
    return begin(prepared(table), sensor, DECLARED).pool


def one_by_one(pool: Pool) -> dict[int, float]:
    """Column -> its freedom, of those of which something is left."""
    found = {}
    for block, place in zip(pool.blocks, pool.places, strict=True):
        for k in place[pool.squares[place] > 0.0]:
            own = pool.grams(np.array([k]))
            assert pool.squares[k] == pytest.approx(own[0, 0], rel=1e-9)
            found[int(k)] = satterthwaite(pool, sorted(block.columns), np.array([k]), 1.0 / np.sqrt(own))
    return found


@pytest.mark.parametrize("taken", [(), (0,), (3, 7, -1), "of several channels"])
def test_every_column_at_once(pool: Pool, taken: tuple[int, ...] | str) -> None:
    if isinstance(taken, str):
        several = [i for i, b in enumerate(pool.blocks) if len(b.columns) > 1]
        taken = (0, several[0], several[-1])
    here = given(pool, [i % len(pool.blocks) for i in taken])
    alone = one_by_one(here)
    assert len(alone) > 100
    assert len({round(f, 6) for f in alone.values()}) > 10
    assert of_each_column(here)[list(alone)] == pytest.approx(list(alone.values()), rel=1e-9)


def test_a_pool_with_a_block_more_is_the_pool_of_all(pool: Pool) -> None:
    *first, last = pool.blocks
    signs = np.random.default_rng(8).choice([-1.0, 1.0], size=(5, len(pool.cuts)))
    before = pool_of(pool.state, first, pool.cuts)
    assert before.flipped(signs)  # asked before: what was made of the others is handed on
    assert before.freedoms.all()
    after = extended(before, last, pool.cuts)
    assert np.concatenate(after.flipped(signs)) == pytest.approx(pool.segments.T @ signs.T, abs=1e-9)
    assert after.gram == pytest.approx(pool.gram, abs=1e-12)
    assert after.freedoms == pytest.approx(pool.freedoms, rel=1e-9)
