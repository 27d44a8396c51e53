"""Ramps of a hundred records on which the bias wanders: intervals of what is told along them hold."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from planner.calibrate.dwells_to_fit import fit_sensor
from planner.calibrate.fit_to_calibration import coefficients_of
from planner.campaign.estimate import Estimate
from planner.dwells.table_rows import by_run
from planner.spec.load import spec_from_bytes
from planner.spec.model import Spec
from tests.diagnose.hall import Hall, Noise, hidden, read, short_ramps, wander
from tests.diagnose.worlds import DECLARED, SPEC

WANDERS_G = 3e-4
DRIFT_G_H = 2e-3
ACC = Noise(5e-5, 6e-4)
BIAS = b"bias: {systematic: 20 mg, run_to_run: 0.8 mg}"
WANDERS = b"bias: {systematic: 20 mg, run_to_run: 0.8 mg, in_run: {value: 0.3 mg, correlation_time: 600 s}}"


def _long(seed: int) -> Hall:
    """Six ramps of a hall, each gone through eight and a half times, 70 s a record: 102 records."""
    hall = short_ramps(seed, 6)
    ramps = np.isin(hall.run, np.unique(hall.run)[-6:])
    rows = np.flatnonzero(ramps).reshape(6, 12)
    more = np.concatenate([np.append(r, np.tile(r[::-1], 8)[:90]) for r in rows])
    which = np.concatenate([np.flatnonzero(~ramps), more])
    fields = {name: getattr(hall, name)[which] for name in Hall.__dataclass_fields__}
    t = fields["time_on"].copy()
    for run in np.unique(fields["run"]):
        mine = np.flatnonzero(fields["run"] == run)
        t[mine] = t[mine[0]] + 70.0 * np.arange(len(mine))
    return replace(hall, **{**fields, "time_on": t, "ramp": np.zeros(len(t))})


def _spec() -> Spec:
    return spec_from_bytes(SPEC.replace(BIAS, WANDERS), Path("bench.yaml")).spec


def _fitted(seed: int) -> Estimate:
    hall = _long(seed)
    shape = WANDERS_G * wander(hall, seed, 600.0) + DRIFT_G_H * hall.time_on / 3600.0
    table = by_run(hidden(read(hall, seed, acc=ACC), "acc", seed % 3, shape))[0]
    effects = (*DECLARED, "drift")
    (fit,) = fit_sensor(table, "accelerometer", _spec(), effects=effects, channels=[seed % 3])
    return fit


def test_a_drift_beside_a_bias_that_wanders_has_its_interval() -> None:
    """Records that wander together counted as that many: none of ten intervals held it, 4.6 sigma rms."""
    off = []
    for seed in range(10):
        fit = _fitted(seed)
        (drift,) = (c for c in coefficients_of(fit, _spec()) if c.error == "accelerometer.drift")
        off.append((drift.value - 9.80665 * DRIFT_G_H / 3600.0) / drift.standard_error)
        assert any(c.kind == "in_run" for c in fit.noise.components)
    assert np.sum(np.abs(off) > 2.0) <= 2  # by chance three of ten in 1 %
    assert np.sqrt(np.mean(np.square(off))) < 1.6  # of ten, by chance in 0.6 %
