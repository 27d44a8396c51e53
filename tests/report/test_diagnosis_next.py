"""The first screen of a diagnosis: sizes with intervals, and what to do next."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.nouns.diagnosed_spreads import BudgetExceeded
from planner.nouns.diagnosis import Diagnosis, ReferenceSuspect, Unknown
from planner.report.subjects.diagnosis_next import next_sentence, sizes_sentence
from tests.diagnose.found import found_effect
from tests.diagnose.update.test_update_spec import diagnosis
from tests.specs import SHIPPED

UAV = SHIPPED / "small_uav.yaml"
BENCH = ReferenceSuspect("base_tilt", 0.1, 0.0, 0.2, "deg", (), 1e-6, 9.0, "level the base", 8.0)
SPREAD = BudgetExceeded("gyro.bias", "run_to_run", 2.0, 1.5, 2.5, 1.0, "deg/s", "gyro_x")


def of(*effects: object, **found: object) -> Diagnosis:
    one = diagnosis(UAV, *effects)
    return replace(one, next_measurement=(), found=replace(one.found, **found))


def test_sizes_stand_with_their_intervals_the_strongest_first() -> None:
    weak = replace(found_effect("ageing", "gyro_y", 1e-9, 1e-10), strength=7.0)
    said = sizes_sentence([weak, found_effect("warm_up", "gyro_x", 1e-4, 1e-5)])
    assert said.index("gyro_x 0.00573") < said.index("gyro_y")
    assert "(0.00516 … 0.0063)" in said
    assert sizes_sentence([]) == ""


def test_of_several_coefficients_the_one_that_is_told_is_said() -> None:
    """A g-sensitivity over a force that hardly acts was the largest, and its interval the widest."""
    one = found_effect("g_sensitivity", "gyro_x", 1e-6, 1e-7)
    wide = replace(one.terms[0], name="xy", value=1e-4, low=1e-5, high=1.9e-4)
    assert "(" + sizes_sentence([one]).partition("(")[2] in sizes_sentence(
        [replace(one, terms=(wide, *one.terms))]
    )


@pytest.mark.parametrize(
    ("one", "said"),
    [
        (of(reference_suspects=(BENCH,), budget_exceeded=(SPREAD,)), "level the base"),
        (of(found_effect("warm_up", "gyro_x", 1e-4, 1e-5)), "declares what was found"),
        (of(unknown=(Unknown(("gyro_x",), "day", 1e-6, 9.0),)), "widens the budget"),
        (of(budget_exceeded=(SPREAD,)), "spreads as measured"),
    ],
)
def test_the_bench_comes_before_the_sensor_and_the_sensor_before_its_spreads(
    one: Diagnosis, said: str
) -> None:
    assert said in next_sentence(one)


def test_nothing_to_do_is_nothing_said() -> None:
    assert next_sentence(of()) == ""
