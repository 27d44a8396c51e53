"""A centrifuge whose arm bends and is longer than its drawing: both are the bench's, and both are named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.hypotheses.found import Found
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.search.sensor import begin
from planner.nouns.dwell_table import DwellTable
from planner.units import STANDARD_GRAVITY_MPS2 as G
from tests.diagnose.worlds import DECLARED
from tests.specs import shipped

ARM_M, LOADS = 1.5, (5.0, 10.0, 20.0, 30.0, 40.0, 50.0)
BENDS = np.radians(0.1) / 50.0  # rad/g, K 2.2.6
SPEC = shipped("small_uav").spec


def campaign(seed: int, longer: float, bends: float = BENDS) -> DwellTable:
    """Six power-ons of faces, 24 of a face outwards at six loads; white noise of 0.03 mg."""
    rng = np.random.default_rng(seed)
    rows: list[tuple[int, str, np.ndarray, np.ndarray, np.ndarray, float]] = []
    for face in np.tile(np.vstack([np.eye(3), -np.eye(3)]), (6, 1)):
        rows.append((len(rows) // 6, "rate_table", face, face, 0.0 * face, 0.0))
    for turn in range(24):
        out = np.eye(3)[turn % 3] * (-1.0) ** (turn // 6)
        up = np.eye(3)[(turn + 1 + turn // 3 % 2) % 3]
        for g in LOADS:
            straight = up - (1.0 + longer) * g * out
            bent = straight + np.cross(bends * np.cross(up, -(1.0 + longer) * g * out), straight)
            rows.append((6 + turn, "centrifuge", up - g * out, bent, np.sqrt(g * G / ARM_M) * up, g))
    run, bench, stated, felt, rate, load = (np.array(x) for x in zip(*rows, strict=True))
    n = len(run)
    first = np.unique(run, return_index=True)[1][run]
    read = felt * [1.002, 0.997, 1.001] + [0.004, -0.003, 0.002] + 3e-5 * rng.normal(size=(n, 3))
    return DwellTable(
        unit=np.full(n, "u1"),
        run=run,
        day=np.zeros(n),
        time_on=60.0 * (1.0 + np.arange(n) - first),
        duration=np.full(n, 30.0),
        temperature_degc=np.full(n, 20.0),
        temperature_rate=np.zeros(n),
        ref_rate=rate,
        ref_acc=stated * G,
        gyro=None,
        acc=(read + 2e-6 * load[:, None] * rng.normal(size=(n, 3))) * G,
        bench=bench,
    )


@pytest.mark.parametrize("seed", [2])
@pytest.mark.further("seed", [1])
def test_an_arm_that_bends_and_is_longer_is_told_as_both(seed: int) -> None:
    found = diagnose(campaign(seed, 3e-3), SPEC)
    assert {e.effect for e in found.effects} == {"arm_bending", "arm_length"}
    assert not found.unknown
    (length,) = (e for e in found.effects if e.effect == "arm_length")
    assert length.terms[0].low <= 3e-3 <= length.terms[0].high


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2])
def test_an_arm_that_only_bends_is_not_longer(seed: int) -> None:
    found = diagnose(campaign(seed, 0.0), SPEC)
    assert {e.effect for e in found.effects} == {"arm_bending"}


def _may_be_longer(table: DwellTable) -> bool:
    """Whether the accelerometers agree on a longer arm, where nothing else is believed."""
    pool = begin(prepared(table), "accelerometer", DECLARED).pool
    arm = next(i for i, b in enumerate(pool.blocks) if b.name == "arm_length")
    assert score(pool, [arm]).delta > 20.0**2
    return Found(pool, [], []).may_be(arm)


@pytest.mark.parametrize("seed", [2, 3])
@pytest.mark.further("seed", [1, 4, 5])
def test_an_arm_is_as_much_longer_for_every_accelerometer(seed: int) -> None:
    """One that reads its own loads alone too long has none: the steps of its readings were one."""
    table = campaign(seed, 0.0, bends=0.0)
    assert table.acc is not None
    assert table.ref_acc is not None
    own = table.ref_acc[:, 1]
    off = 3e-4 * np.where(np.abs(own) > 2.0 * G, own, 0.0)
    assert not _may_be_longer(replace(table, acc=table.acc + off[:, None] * np.eye(3)[1]))
    assert _may_be_longer(campaign(seed, 1e-4, bends=0.0))
