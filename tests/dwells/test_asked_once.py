"""Questions whose answers stay with the conditions that they are asked of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.conditions import Conditions, asked_once
from planner.nouns.dwell_table import DwellTable


@asked_once
def is_warm(conditions: Conditions) -> np.ndarray:
    return conditions.temperature_degc > 0.0


def rows(degc: list[float]) -> Conditions:
    t, zero = np.array(degc), np.zeros(len(degc))
    return Conditions(np.zeros((len(t), 3)), np.zeros((len(t), 3)), t, zero, zero, zero)


def test_the_answer_stays_and_is_read_only() -> None:
    here = rows([1.0, -1.0])
    first = is_warm(here)
    assert is_warm(here) is first
    with pytest.raises(ValueError, match="read-only"):
        first[0] = False


def test_other_rows_and_other_temperatures_are_asked_anew() -> None:
    here = rows([1.0, -1.0, 2.0])
    assert is_warm(here).tolist() == [True, False, True]
    assert is_warm(here.at(np.array([1, 2]))).tolist() == [False, True]
    assert is_warm(replace(here, temperature_degc=-here.temperature_degc)).tolist() == [False, True, False]


def test_a_table_has_the_same_conditions_every_time_and_another_one_its_own() -> None:
    zero = np.zeros(2)
    name = np.array(["u", "u"])
    table = DwellTable(name, np.array([1, 1]), zero, zero, zero, zero, zero, None, None, None, None)
    assert table.conditions() is table.conditions()
    assert replace(table, temperature_degc=zero + 1.0).conditions().temperature_degc.tolist() == [1.0, 1.0]
