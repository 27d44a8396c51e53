"""One channel of one power-on in another unit of measurement."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.not_as_said import screened
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable

EARTH = np.radians(15.041067 / 3600.0)
G = 9.80665


def rests(seed: int, power_ons: int = 6) -> DwellTable:
    """Attitudes at random, none of them twice; gyros of 0.2 deg/s, accelerometers of 30 mg. SI."""
    rng = np.random.default_rng([seed, 47])
    n = 20
    run = np.repeat(np.arange(power_ons) + 1, n)
    up = rng.normal(size=(len(run), 3))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    T = np.repeat(rng.permutation(np.linspace(-30.0, 60.0, power_ons)), n)
    bias = np.radians(rng.uniform(0.1, 0.2, 3) * rng.choice([-1.0, 1.0], 3) + 1e-3 * (T[:, None] - 20.0))
    spread = np.radians(5e-3) * rng.normal(size=(power_ons + 1, 3))[run]
    return DwellTable(
        unit=np.full(len(run), "U"), run=run, day=run.astype(float),
        time_on=np.tile(60.0 * np.arange(n), power_ons), duration=np.full(len(run), 30.0),
        temperature_degc=T, temperature_rate=np.zeros(len(run)),
        ref_rate=EARTH * up, ref_acc=G * up, gyro=EARTH * up + bias + spread,
        acc=G * (up + rng.uniform(0.02, 0.03, 3) + 1e-3 * rng.normal(size=(power_ons + 1, 3))[run]),
    )  # fmt: skip


def in_other_units(table: DwellTable, sensor: str, run: int, factor: float) -> DwellTable:
    """Channel y of one power-on."""
    y: Array = getattr(table, sensor).copy()
    y[table.run == run, 1] *= factor
    return replace(table, **{sensor: y})


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("sensor", "factor"), [("gyro", 3600.0), ("acc", G)])
def test_the_whole_power_on_is_left_out(seed: int, sensor: str, factor: float) -> None:
    """A bias of 720 deg/s was a spread from power-on to power-on, and "nothing is missing"."""
    table = in_other_units(rests(seed), sensor, 4, factor)
    seen = screened(table)
    assert np.array_equal(~seen.kept, table.run == 4)
    assert [(s.hypothesis, len(s.channels)) for s in seen.suspects] == [("wrong_record", 1)]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_power_ons_that_differ_by_their_spread_stay(seed: int) -> None:
    seen = screened(rests(seed))
    assert seen.kept.all()
    assert not seen.suspects
