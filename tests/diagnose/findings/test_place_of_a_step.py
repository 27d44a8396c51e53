"""The day on which a bias stepped: its interval holds it, wherever power-ons in between cannot tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import catalog
from planner.diagnose.channels.orthogonal import clear
from planner.diagnose.channels.parameters import ranges
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.candidates import effect_blocks
from planner.diagnose.hypotheses.nonlinear import as_likely_steps
from planner.diagnose.hypotheses.pool import Pool, pool_of
from planner.diagnose.search.sensor import begin
from planner.dwells.table_rows import rows_of
from tests.calibrate.world import Layout, campaign
from tests.diagnose.worlds import DECLARED

CAMPAIGNS = 120


@pytest.mark.parametrize("strength", [4.0])
@pytest.mark.further("strength", [6.0, 10.0])
def test_the_day_of_a_step_lies_within_its_interval(strength: float) -> None:
    """The two power-ons between which it explains most held the truth in 68 of 120 campaigns."""
    layout = Layout(temperatures=(-40.0, 20.0, 60.0), static_repeats=18, later=(9.0, 20.0), ramps=False)
    table = campaign(3, (), layout)
    table = rows_of(replace(table, acc=None), np.linalg.norm(table.ref_rate, axis=1) < 0.01)
    b = begin(prepared(table), "gyro", DECLARED)
    (r,) = ranges(catalog.effects()["bias_step"], table)
    blocks = {
        day: effect_blocks(b.channels[:1], "bias_step", {"day": float(day)})[0] for day in r.steps[2:-2]
    }
    w, rng, inside = b.pool.state[0], np.random.default_rng(1), 0

    def pool(day: float, z: np.ndarray) -> Pool:
        return pool_of({0: replace(w, z=z)}, [blocks[day]], b.cuts)

    for _ in range(CAMPAIGNS):
        truth = rng.choice([*blocks])
        z = clear(w.Q, rng.normal(size=len(w.z))) + strength * pool(truth, w.z).parts[0][:, 0]
        best = max((pool(day, z) for day in blocks), key=lambda p: p.h[0] ** 2)
        low, high = as_likely_steps(best, (), 0, b.channels, b.cuts, r)
        inside += low < truth < high
    assert inside >= 0.9 * CAMPAIGNS  # fewer than 108 of 120 would be 1 chance in 100 at 95 %
