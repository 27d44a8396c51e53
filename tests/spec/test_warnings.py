"""What a spec may say, oddly: warnings, and what its method does not read."""

from __future__ import annotations

import pytest

from tests.spec.example import changed, faults, loaded

CANDIDATES = "candidates: [1, 3, 5, 7, 10, 12, 15, 20]"
REQUIREMENT = "  - {error: position, limit: 10 m, rule: worst_case}"


@pytest.mark.parametrize(
    ("old", "new", "path", "words"),
    [
        ("bias_temperature, ", "", "unit.gyro.bias.temperature_residual", "bias_temperature"),
        (
            "scale_factor_temperature, ",
            "",
            "unit.gyro.scale_factor.temperature_residual",
            "scale_factor_temperature",
        ),
        (", misalignment]", ", warm_up]", "effects[4]", "warm_up"),
        (CANDIDATES, "candidates: [1, 2, 3]", "plan.temperatures.candidates", "2:"),
        ("  centrifuge: {", "  big_one: {", "benches.big_one", "no kind of bench"),
        ("worst_case}", "worst_case, temperature: worst}", "requirement[0].temperature", "says nothing"),
        (
            "worst_case}",
            "rss, temperature: {distribution: {0 degC: 1, 61 degC: 1}}}",
            "requirement[0].temperature.distribution",
            "61 degC: outside",
        ),
    ],
)
def test_what_is_odd_but_possible_is_a_warning(old: str, new: str, path: str, words: str) -> None:
    found = {fault.path: fault.message for fault in loaded(changed((old, new))).warnings}
    assert words in found[path]


INFORMATION = ("worst_case}", "rss}")


@pytest.mark.parametrize(
    ("changes", "idle"),
    [
        ([INFORMATION], {"plan.quantile", "plan.temperatures.candidates"}),
        ([("worst_case}", "{percentile: 95 %}}")], {"plan.quantile", "plan.temperatures.candidates"}),
        (
            [INFORMATION, ("  quantile: student\n", ""), (CANDIDATES, "interpolate: true")],
            {"plan.temperatures.interpolate"},
        ),
        ([INFORMATION, ("  quantile: student\n", ""), (f", {CANDIDATES}", "")], set()),
        ([], set()),  # worst_case
        ([INFORMATION, ("confidence: 95 %", "method: published")], set()),
        (
            [
                (REQUIREMENT, f"{REQUIREMENT}\n  - {{error: up, limit: 1 m, rule: rss}}"),
            ],
            set(),
        ),
        (
            [
                INFORMATION,
                (
                    "simulated",
                    "{given: {gyro.bias: 5 m/(deg/s), accelerometer.bias: 3 m/g, gyro.scale_factor: 3 m/%}}",
                ),
            ],
            set(),
        ),
    ],
)
def test_what_says_nothing_under_method_information_is_remarked_if_it_stands_there(
    changes: list[tuple[str, str]], idle: set[str]
) -> None:
    found = {w.path for w in loaded(changed(*changes)).warnings if "method information" in w.message}
    assert found == idle


def test_nothing_is_remarked_of_a_method_that_is_not_readable() -> None:
    found = faults(changed(INFORMATION, ("confidence: 95 %", "method: informaton")))
    assert [fault.path for fault in found] == ["plan.method"]


def test_one_repeat_and_any_residual_will_do_where_no_student_and_no_candidate_counts() -> None:
    once, other = ("least: 2,", "least: 1,"), (CANDIDATES, "candidates: [8]")
    assert {fault.path for fault in faults(changed(once, other))} == {
        "plan.repeats.least",
        "plan.temperatures.candidates",
    }
    assert loaded(changed(INFORMATION, once, other))


def test_a_temperature_with_a_rule_that_is_wrong_is_not_remarked() -> None:
    (fault,) = faults(changed(("worst_case}", "worst, temperature: range}")))
    assert fault.path == "requirement[0].rule"


def test_one_fault_in_a_requirement_is_one_fault() -> None:
    (fault,) = faults(changed(("rule: worst_case}", "rule: worst_case, rul: rss}")))
    assert fault.path == "requirement[0].rul"


def test_interpolation_uses_the_candidates_between() -> None:
    text = changed((CANDIDATES, "candidates: [2, 4], interpolate: true"))
    assert "plan.temperatures.candidates" not in {fault.path for fault in loaded(text).warnings}
    assert faults(text.replace("true", "false"))
