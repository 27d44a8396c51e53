"""0 repeats: the test is not used, whoever asks."""

from __future__ import annotations

import pytest

from planner.plan.by_hand import hand_made_visits
from planner.spec.unused_tests import unused_tests
from tests.spec.example import changed, faults, loaded

FIXED = "fixed: {gyro_drift: {temperatures: 15, repeats: 15}}"


def fixed(words: str) -> str:
    """The example with another hand-made choice."""
    return changed((FIXED, f"fixed: {words}"))


@pytest.mark.parametrize(
    "words",
    [
        "{gyro_drift: {repeats: 0}}",
        "{gyro_drift: {temperatures: 0}}",
        "{gyro_drift: {temperatures: 0, repeats: 0}}",
        "{gyro_drift: {temperatures: 3, repeats: 0}}",
        "{gyro_drift: {temperatures: 3, repeats: [0, 0, 0]}}",
        "{gyro_drift: {repeats: [0]}}",
    ],
)
def test_a_test_of_no_repeats_is_as_one_that_the_spec_does_not_have(words: str) -> None:
    spec = loaded(fixed(words)).spec
    assert "gyro_drift" not in spec.tests
    assert unused_tests(spec) == ("gyro_drift",)


def test_a_test_says_it_itself() -> None:
    text = changed((FIXED, "order: free"), ("gyro_drift: {bench", "gyro_drift: {repeats: 0, bench"))
    assert unused_tests(loaded(text).spec) == ("gyro_drift",)


def test_temperatures_of_no_repeats_are_not_visited() -> None:
    by_number = loaded(fixed("{gyro_drift: {temperatures: 3, repeats: [2, 0, 4]}}")).spec
    by_list = loaded(
        fixed("{gyro_drift: {temperatures: [60 degC, 0 degC, -60 degC], repeats: [4, 0, 2]}}")
    ).spec
    for spec in (by_number, by_list):
        (visit,) = hand_made_visits(spec)
        assert (visit.temperatures_degc, visit.repeats) == ((-60.0, 60.0), (2, 4))


def test_choices_of_a_test_that_is_not_used_are_none() -> None:
    text = changed(
        (FIXED, "fixed: {gyro_drift: {repeats: 0}}"),
        ("motions: 1, record: 300 s,", "motions: 1, record: [60 s, 300 s],"),
    )
    assert not [name for name in loaded(text).spec.tests if name.startswith("gyro_drift")]


@pytest.mark.parametrize(
    ("words", "path", "said"),
    [
        ("{gyro_drift: {temperatures: 0, repeats: 2}}", "plan.fixed.gyro_drift", "0 temperatures and some"),
        ("{gyro_drift: {temperatures: 3, repeats: [0, 2]}}", "plan.fixed.gyro_drift.repeats", "2 repeats"),
        ("{gyro_drift: {repeats: [0, 2]}}", "plan.fixed.gyro_drift.repeats", "need 'temperatures'"),
        ("{gyro_drift: {repeats: -1}}", "plan.fixed.gyro_drift.repeats", "not be less than 0"),
        ("{gyro_dritf: {repeats: 0}}", "plan.fixed.gyro_dritf", "did you mean 'gyro_drift'"),
    ],
)
def test_what_contradicts_itself_is_refused(words: str, path: str, said: str) -> None:
    (fault,) = faults(fixed(words))
    assert fault.path == path
    assert said in fault.message


def test_no_test_at_all_is_refused() -> None:
    names = loaded(changed()).spec.tests
    (fault,) = faults(fixed("{" + ", ".join(f"{name}: {{repeats: 0}}" for name in names) + "}"))
    assert (fault.code, fault.path) == ("P518", "plan.fixed")


def test_an_error_that_only_such_a_test_calibrates_is_named() -> None:
    spec = loaded(fixed("{rates: {repeats: 0}}"))
    assert any(
        w.path == "unit.gyro.scale_factor" and "no test calibrates it (0 repeats of rates)" in w.message
        for w in spec.warnings
    )
