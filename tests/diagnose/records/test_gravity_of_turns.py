"""Gravity that the references on a centrifuge lack, or have upside down: one finding about the bench."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.records.gravity_of_turns import gravity_of_turns
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.references.test_arm import SPEC, campaign


def _gravity_of(table: DwellTable, share: float, runs: Array | None = None) -> DwellTable:
    """The table with `share` of its gravity in the references of the turns, of some runs or of all."""
    assert table.ref_acc is not None
    assert table.ref_rate is not None
    rate = table.ref_rate
    axis = rate / np.maximum(np.linalg.norm(rate, axis=1, keepdims=True), 1e-300)
    mine = np.ones(len(table), dtype=bool) if runs is None else np.isin(table.run, runs)
    lost = (1.0 - share) * mine * np.sum(table.ref_acc * axis, axis=1)
    return replace(table, ref_acc=table.ref_acc - lost[:, None] * axis)


@pytest.mark.parametrize(("share", "size"), [(0.0, 1.0), (-1.0, 2.0)])
@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_gravity_missing_on_the_arm_is_a_fault_of_the_reference(seed: int, share: float, size: float) -> None:
    """It was a step of the accelerometers' bias at 900 sigma, or power-ons beyond the budget."""
    found = diagnose(_gravity_of(campaign(seed, 0.0), share), SPEC)
    (suspect,) = found.reference_suspects
    assert (suspect.hypothesis, suspect.unit) == ("local_gravity", "1")
    assert suspect.low <= size <= suspect.high
    assert suspect.high - suspect.low < 0.05
    assert "run 6, 7, 8, 9, 10, …" in suspect.check
    assert {e.effect for e in found.effects} == {"arm_bending"}
    assert not found.budget_exceeded


def test_gravity_missing_in_some_power_ons_is_put_right_in_these() -> None:
    whole = campaign(4, 0.0)
    runs = np.array([8, 9, 20])
    found = gravity_of_turns(_gravity_of(whole, 0.0, runs))
    assert found is not None
    assert set(found.table.run[found.rows].tolist()) == set(runs.tolist())
    assert whole.ref_acc is not None
    assert found.table.ref_acc is not None
    assert np.abs(found.table.ref_acc - whole.ref_acc).max() < 1e-9 * np.abs(whole.ref_acc).max()


def test_a_centrifuge_whose_references_are_whole_is_not_asked_again() -> None:
    assert gravity_of_turns(campaign(5, 3e-3)) is None


def test_an_axis_that_lies_level_has_no_gravity_along_it() -> None:
    """The turn averages it out, and the accelerometers say so."""
    table = campaign(6, 0.0)
    assert table.acc is not None
    level = _gravity_of(table, 0.0)
    assert table.ref_acc is not None
    assert level.ref_acc is not None
    assert gravity_of_turns(replace(level, acc=table.acc + level.ref_acc - table.ref_acc)) is None
