"""A bias of a fifth of a g is no label, whatever another label would take of it; a label beside it is one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.not_as_said import screened
from planner.nouns.dwell_table import DwellTable
from planner.units import STANDARD_GRAVITY_MPS2
from tests.diagnose.hall import anywhere, read


def _biased(seed: int) -> DwellTable:
    """A cheap unit in any attitude: 0.24 g of bias, of other channels with every seed."""
    table = read(anywhere(seed), seed)
    assert table.acc is not None
    bias = np.random.default_rng(seed).permutation([0.19, 0.03, -0.15])
    return replace(table, acc=table.acc + STANDARD_GRAVITY_MPS2 * bias, gyro=None)


@pytest.mark.parametrize("seed", [731, 732])
@pytest.mark.further("seed", range(733, 739))
def test_a_bias_is_no_label(seed: int) -> None:
    """22 good rows of 672 were left out, and the unit was said to have stood turned over."""
    said = screened(_biased(seed))
    assert not said.suspects
    assert said.kept.all()


@pytest.mark.parametrize("seed", [731, 732])
@pytest.mark.further("seed", range(733, 739))
def test_a_label_beside_a_bias_is_told(seed: int) -> None:
    table = _biased(seed)
    assert table.ref_acc is not None
    over = np.diag([-1.0, -1.0, 1.0])
    tells = np.linalg.norm(table.ref_acc @ over.T - table.ref_acc, axis=1) > 0.9 * STANDARD_GRAVITY_MPS2
    wrong = (table.run == np.unique(table.run)[3]) & tells
    label = np.where(wrong[:, None], table.ref_acc @ over.T, table.ref_acc)
    said = screened(replace(table, ref_acc=label))
    assert [s.hypothesis for s in said.suspects] == ["wrong_label"]
    assert not said.kept[wrong].any()
