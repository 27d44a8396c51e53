"""What a spread beyond its budget makes of a flight, by each rule, and how it is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from planner.diagnose.budget_to_navigation import in_flight, together
from planner.export.diagnosis_findings import findings_document, findings_from
from planner.nouns.array import Rule
from planner.nouns.diagnosed_spreads import BudgetExceeded, CampaignCost
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.sensitivities import Constraint
from planner.report.subjects.diagnosis_findings import exceeded_sentence

Z = float(norm.ppf(0.975))
V = np.array([[3.0, 4.0], [1.0, 0.0], [0.0, 2.0]])  # m per unit of each axis' error
SPREAD = BudgetExceeded("gyro.bias", "run_to_run", 2.0, 1.5, 2.5, 1.0, "rad/s", "gyro_x")


def constraint(rule: Rule, percentile: float | None = None) -> Constraint:
    return Constraint(0, "position", "m", rule, 100.0, 60.0, {"gyro.bias": V}, percentile)


@pytest.mark.parametrize(("rule", "percentile"), [("worst_case", None), ("rss", None), ("percentile", 0.95)])
def test_a_channel_s_spread_is_its_sensitivity_times_the_quantile(
    rule: Rule, percentile: float | None
) -> None:
    (one,) = in_flight([SPREAD], [constraint(rule, percentile)], 0.95, [40.0])
    assert one.flight is not None
    # one coefficient along (3, 4): a normal law on a line, whatever the rule
    assert one.flight.measured == pytest.approx(5.0 * 2.0 * Z, rel=1e-4)
    assert one.flight.budgeted == pytest.approx(5.0 * Z, rel=1e-4)
    if rule == "worst_case":
        assert one.flight.total == pytest.approx(40.0 + 5.0 * Z, rel=1e-4)
    else:
        assert one.flight.total == pytest.approx(np.sqrt(40.0**2 + 3.0 * (5.0 * Z) ** 2), rel=1e-4)


def test_a_spread_of_all_channels_takes_all_of_them_and_several_add_by_their_rule() -> None:
    whole = replace(SPREAD, channel="")
    (one,) = in_flight([whole], [constraint("rss")], 0.95)
    assert one.flight is not None
    assert one.flight.measured == pytest.approx(2.0 * Z * np.sqrt(25.0 + 1.0 + 4.0))
    assert np.isnan(one.flight.total)
    rules: tuple[tuple[Rule, float], ...] = (("rss", np.hypot(10.0, 2.0)), ("worst_case", 12.0))
    for rule, size in rules:
        both = in_flight([SPREAD, replace(SPREAD, channel="gyro_y")], [constraint(rule)], 0.95)
        added = together(both)
        assert added is not None
        assert added.measured == pytest.approx(size * Z)


def test_an_error_that_no_requirement_feels_has_no_metres() -> None:
    (one,) = in_flight([replace(SPREAD, error="gyro.ageing")], [constraint("rss")], 0.95)
    assert one.flight is None
    assert together([one]) is None


def test_metres_and_hours_are_said_and_survive_the_file() -> None:
    (one,) = in_flight([SPREAD], [constraint("rss")], 0.95, [90.0])
    said = exceeded_sentence([one], CampaignCost(3600.0, 7200.0))
    assert "19.6 m where the budget says 9.8 m: 90 m promised become 91.59 m of 100 m" in said.replace(
        "\u202f", " "
    ).replace("\u00a0", " ")
    assert said.endswith("the campaign takes 2.00 h instead of 1.00 h.")
    assert "no campaign keeps" in exceeded_sentence([one], CampaignCost(3600.0, float("nan"), "why"))
    bare = replace(UnitDiagnosis("u", "clean", (), (), (), (), (), ()), budget_exceeded=(one,))
    again = findings_from(findings_document(bare))["budget_exceeded"]
    assert again[0].flight.measured == pytest.approx(one.flight.measured)  # type: ignore[union-attr]  # it has one
