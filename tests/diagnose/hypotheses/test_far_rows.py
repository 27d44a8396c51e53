"""Rows that are far by what the spec itself draws anew at every power-on are no accidents."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from planner.diagnose.hypotheses.channels import channel
from planner.diagnose.hypotheses.far_rows import far_rows, scale_scatter
from planner.nouns.conditions import Conditions
from planner.spec.model import Unit
from planner.spec.sensor_alone import sensor_spec_from_bytes
from planner.units import STANDARD_GRAVITY_MPS2 as G

MG = 1e-3 * G
STRUCK = 198
FACES = [1.0, -1.0, 0.0, 0.0, 0.0, 0.0]


LOADS = [s * load for load in (10.0, 20.0, 30.0, 50.0) for s in (1.0, -1.0)] + [0.0] * 4


def unit(run_to_run: str) -> Unit:
    scale = {"systematic": "0.5 %", "run_to_run": run_to_run}
    spec = {"planner": 1, "name": "one", "unit": {"accelerometer": {"scale_factor": scale}}}
    text = yaml.safe_dump(spec | {"effects": ["bias", "scale_factor"]})
    return sensor_spec_from_bytes(text.encode(), Path("one.yaml")).spec.unit


def left_out(seed: int, spike: float, run_to_run: str | None) -> list[int]:
    """30 power-ons of faces, two on a centrifuge; the second's +50 g is struck."""
    rng = np.random.default_rng(seed)
    loads = np.array(FACES * 30 + LOADS + LOADS)
    n = len(loads)
    force = np.zeros((n, 3))
    force[:, 0] = loads * G
    starts = np.append(np.arange(0, 181, 6), 192)
    run = np.repeat(np.arange(32), np.diff(np.append(starts, n)))
    y = force[:, 0] * (1.0 + 1e-7 * rng.normal(size=32)[run]) + 0.05 * MG * rng.normal(size=n)
    y[STRUCK] += spike
    zero = np.zeros(n)
    conditions = Conditions(0.0 * force, force, zero + 20.0, zero, zero + 60.0, zero)
    c = channel("accelerometer", 0, conditions, y, ("bias", "scale_factor"))
    scatter = scale_scatter(None if run_to_run is None else unit(run_to_run), c)
    cells = np.unique(loads, return_inverse=True)[1]
    far = far_rows(c, np.empty((n, 0)), starts, zero + 60.0, cells, scatter)
    return np.flatnonzero(far.rows).tolist()


@pytest.mark.parametrize("seed", range(3))
def test_what_the_spec_draws_anew_is_no_spike(seed: int) -> None:
    """20 mg at 50 g: a spike beside .003 % of scale factor (1.5 mg), not beside .03 %; 200 mg always."""
    assert left_out(seed, 20.0 * MG, None) == [STRUCK]
    assert left_out(seed, 20.0 * MG, "0.003 %") == [STRUCK]
    assert left_out(seed, 20.0 * MG, "0.03 %") == []
    assert left_out(seed, 200.0 * MG, "0.03 %") == [STRUCK]
