"""Curves that a name describes: they obey the laws of effects, and leave out what the constant takes up."""

from __future__ import annotations

import numpy as np
import pytest

from planner import catalog
from planner.effects._dependence import random_conditions
from planner.effects._measured_curve import VARIABLES, curve_name, curve_of
from planner.testing.effect_laws import check_effect

NODES = {
    "time_on": (30.0, 120.5, 400.0),
    "day": (0.0, 10.0, 30.0),
    "temperature_rate": (-2.0, 0.0, 2.0),
    "rate": (-400.0, -100.0, 0.0, 100.0, 400.0),
    "rate_modulus": (0.0, 100.0, 400.0),
    "cross_rate": (-400.0, 0.0, 400.0),
}


@pytest.mark.parametrize("over", VARIABLES)
def test_a_curve_is_an_effect_like_any_other(over: str) -> None:
    name = curve_name("gyro", 1, over, NODES.get(over, ()))
    effect = catalog.effects()[name]
    assert effect.name == name
    check_effect(effect)


def test_its_columns_are_hats_that_no_constant_and_no_scale_factor_can_be() -> None:
    conditions = random_conditions(np.random.default_rng(3), 500)
    effect = catalog.effects()[curve_name("gyro", 2, "rate", NODES["rate"])]
    own = effect.regressors("gyro", conditions)
    assert not own[:, :2].any()
    columns = np.column_stack([np.ones(500), np.clip(conditions.rate[:, 2], -6.98, 6.98), own[:, 2]])
    assert np.linalg.matrix_rank(columns) == columns.shape[1]


@pytest.mark.parametrize(
    "name",
    [
        "curve_acc_x_over_rate_at_0_10_20",
        "curve_gyro_x_over_time_on_at_30",
        "curve_gyro_x_over_time_on_at_60_30",
        "curve_gyro_x_over_time_on",
        "curve_gyro_w_over_time_on_at_30_60",
        "curve_gyro_x_over_orientation_at_0_1",
    ],
)
def test_a_name_that_describes_no_curve_is_no_effect(name: str) -> None:
    assert name not in catalog.effects()
    with pytest.raises(KeyError):
        catalog.effects()[name]


def test_curves_stand_in_no_list() -> None:
    assert not any(name.startswith("curve_") for name in catalog.effects())


def test_a_process_that_reads_names_without_end_does_not_grow() -> None:
    most = curve_of.cache_info().maxsize
    assert most is not None
    for k in range(most + 10):
        curve_of(f"no_curve_{k}")
    assert curve_of.cache_info().currsize <= most
