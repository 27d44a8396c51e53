"""What eight to thirty power-ons tell is held against their draws: which of the two is likelier."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.orthogonal import explained
from planner.diagnose.noise.whitened import SEEN
from planner.diagnose.vetoes.as_likely import Budgeted, likelier
from planner.nouns.array import Array

RUNS, ROWS = 12, 8
CHANCE = 10.83  # χ² of one degree at 1e-3


def _power_ons(size: float) -> tuple[Array, Array]:
    """(n, 1) a column that goes with the input in every power-on, and (n, runs) a draw of each, one sigma."""
    u = np.tile(np.linspace(-1.0, 1.0, ROWS), RUNS)
    run = np.repeat(np.arange(RUNS), ROWS)
    each = np.zeros((len(u), RUNS))
    each[np.arange(len(u)), run] = size * u
    return u[:, None], each


@pytest.mark.parametrize("seed", range(1, 6))
def test_what_every_power_on_has_alike_is_no_draw_of_each(seed: int) -> None:
    """However large the budget: twelve draws of one sign and size are a coincidence."""
    u, each = _power_ons(8.0)
    z = 1.5 * u[:, 0] + np.random.default_rng(seed).normal(size=len(u))
    delta, _ = explained(np.empty((len(u), 0)), u, z, SEEN)
    assert delta > 36.0
    assert likelier([(Budgeted.of(each, z), u)]) > CHANCE


@pytest.mark.parametrize("seed", range(1, 6))
def test_what_power_ons_draw_anew_is_no_effect_however_sure_it_looks(seed: int) -> None:
    """By noise without their spread it is eight sigma; beside draws within the budget it is chance."""
    u, each = _power_ons(3.0)
    rng = np.random.default_rng(seed)
    coefficients = 3.0 * np.abs(rng.normal(size=RUNS)) * rng.choice([-1.0, 1.0], RUNS)
    coefficients *= np.sign(coefficients.sum())
    z = np.repeat(coefficients, ROWS) * u[:, 0] + rng.normal(size=len(u))
    delta, _ = explained(np.empty((len(u), 0)), u, z, SEEN)
    gain = likelier([(Budgeted.of(each, z), u)])
    assert gain < CHANCE
    assert delta > 2.0 * gain
