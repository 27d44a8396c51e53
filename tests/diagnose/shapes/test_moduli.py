"""Shapes of one or three columns without a name: a modulus is no square, and what turns alone have no step.

On these seeds a square of the own force, of another rate, or a step of the bias had the name, the variable
among its rivals.
"""

from __future__ import annotations

import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from tests.diagnose.labs.shapes import Hidden
from tests.diagnose.labs.unit import campaign
from tests.diagnose.worlds import DECLARED


def claims(name: str, axis: str, seed: int, t: float, centrifuge: bool) -> list[tuple[str, tuple[int, ...]]]:
    """What is believed of the gyros: names, variables, channels."""
    table, _ = campaign(seed, Hidden(name, f"gyro_{axis}", t), centrifuge=centrifuge)
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, 1).found
    return [found.pool.blocks[b].key for b in found.all]


@pytest.mark.parametrize(("axis", "seed"), [("x", 92001), ("z", 92003)])
def test_the_modulus_of_a_force_is_no_square_of_it(axis: str, seed: int) -> None:
    assert claims("modulus of a force", axis, seed, 15.0, True) == [("specific_force", ("xyz".index(axis),))]


@pytest.mark.parametrize(("axis", "seed"), [("z", 92010), ("x", 92011)])
def test_the_modulus_of_another_rate_is_no_square_of_it(axis: str, seed: int) -> None:
    assert claims("modulus of another rate", axis, seed, 16.0, False) == [("rate", ("xyz".index(axis),))]


@pytest.mark.parametrize(("axis", "seed"), [("x", 92005), ("y", 92006)])
def test_what_turns_alone_have_is_no_step_on_the_day_on_which_they_begin(axis: str, seed: int) -> None:
    assert claims("turning or not", axis, seed, 15.0, False) == [("rate", ("xyz".index(axis),))]


@pytest.mark.parametrize("seed", [92020])
@pytest.mark.further("seed", [92021])
def test_a_step_on_another_day_keeps_its_name(seed: int) -> None:
    assert claims("bias_step", "y", seed, 15.0, False) == [("bias_step", (1,))]
