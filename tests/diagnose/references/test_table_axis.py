"""A unit off the axis of its table, beside an arm whose radius is surveyed: no cross-coupling."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.array import Array
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.units import STANDARD_GRAVITY_MPS2 as G
from tests.specs import shipped

ARM_M, LOADS, RATES = 2.0, (2.0, 10.0, 20.0, 40.0), np.radians([-400.0, -150.0, 150.0, 400.0])
LEVER_M = np.array([0.03, -0.02, 0.05])
TABLES = 8


def _campaign(seed: int, table: Array, arm: Array) -> UnitDiagnosis:
    """Power-ons of faces and turns, then of one face outwards each; levers (3,) of either place, m."""
    rng = np.random.default_rng(seed)
    rows: list[tuple[int, Array, Array, Array]] = []
    for run in range(TABLES):
        rows += [(run, s * up, np.zeros(3), np.zeros(3)) for up in np.eye(3) for s in (1.0, -1.0)]
        rows += [(run, up, w * up, table) for up in np.eye(3) for w in RATES]
    for turn in range(12):
        out = np.eye(3)[turn % 3] * (-1.0) ** (turn // 3)
        up = np.eye(3)[(turn + 1 + turn // 6) % 3]
        rows += [(TABLES + turn, up + g * out, np.sqrt(g * G / ARM_M) * up, arm) for g in LOADS]
    run, stated, w, lever = (np.array(x) for x in zip(*rows, strict=True))
    n, first = len(run), np.unique(run, return_index=True)[1][run]
    felt = stated + np.cross(w, np.cross(w, lever)) / G
    lean = np.eye(3) + np.radians(rng.uniform(-0.2, 0.2, (3, 3))) * (1.0 - np.eye(3))
    level = 2e-4 * rng.normal(size=(run.max() + 1, 3))[run]
    read = (felt @ lean.T) * [1.002, 0.997, 1.001] + [0.004, -0.003, 0.002] + level
    return diagnose(
        DwellTable(
            unit=np.full(n, "u1"), run=run, day=1.0 * run, time_on=60.0 * (1.0 + np.arange(n) - first),
            duration=np.full(n, 30.0), temperature_degc=np.full(n, 20.0), temperature_rate=np.zeros(n),
            ref_rate=w, ref_acc=stated * G, gyro=None, acc=(read + 5e-5 * rng.normal(size=(n, 3))) * G,
            bench=np.where(run < TABLES, "table", "arm"),
        ),
        shipped("small_uav").spec,
    )  # fmt: skip


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3])
def test_off_the_axis_of_the_table_alone(seed: int) -> None:
    found = _campaign(seed, LEVER_M, np.zeros(3))
    (suspect,) = (s for s in found.reference_suspects if not s.expected)
    assert suspect.hypothesis == "lever_arm"
    # misalignments of 0.2 deg are beside its columns
    assert suspect.value == pytest.approx(np.linalg.norm(LEVER_M), rel=3e-3)
    assert (found.effects, found.unknown) == ((), ())


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2])
def test_a_lever_of_all_that_turns_stays_an_effect(seed: int) -> None:
    found = _campaign(seed, LEVER_M, LEVER_M)
    assert [e.effect for e in found.effects] == ["lever_arm"]
    assert not found.reference_suspects


@pytest.mark.parametrize("seed", [1, 2])
def test_on_the_axis_it_is_none(seed: int) -> None:
    found = _campaign(seed, np.zeros(3), np.zeros(3))
    assert (found.effects, found.unknown, found.reference_suspects) == ((), (), ())
