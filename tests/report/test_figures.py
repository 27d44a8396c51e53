"""What the figures and tables are drawn from: regions, shares of time, budgets, numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.nouns.sensitivities import Constraint
from planner.nouns.step import Step
from planner.report import time_spent
from planner.report.blocks import align_points
from planner.report.charts import theme
from planner.report.charts.gantt import column_shares, temperature_track
from planner.report.contributions import PARTS, contributions
from planner.report.numbers import digits, names_are, quantity, runs
from planner.report.region_of_two import PREFERRED, allowed_region, axes_of_region, four_quadrants
from planner.report.subjects import plan_tables as tables
from planner.solvers.linear_combination import combined
from tests.report import sample

# ---------------------------------------------------------------- region


def rest_of(plan: object, constraint: Constraint) -> float:
    """What the other errors use of a worst-case constraint, counted here by hand."""
    allowed = {a.error: a.allowed for a in sample.plan().allowances}
    vectors = constraint.vectors
    return sum(
        float(np.linalg.norm(vectors[e], axis=1).sum()) * allowed[e] for e in allowed if e not in PREFERRED
    )


def test_worst_case_region_is_a_rhombus_with_the_right_corners() -> None:
    plan, constraints = sample.plan(), sample.constraints()
    region = allowed_region(plan, constraints, PREFERRED)
    assert region is not None
    room = 30.0 - rest_of(plan, constraints[0])
    corners = [room / float(np.linalg.norm(constraints[0].vectors[e], axis=1).sum()) for e in PREFERRED]
    # sums of a dozen doubles
    np.testing.assert_allclose(region.boundary[0], (corners[0], 0.0), rtol=1e-12)
    np.testing.assert_allclose(region.boundary[-1], (0.0, corners[1]), rtol=1e-12)
    line = region.boundary[:, 0] / corners[0] + region.boundary[:, 1] / corners[1]
    np.testing.assert_allclose(line, 1.0, rtol=1e-12)


def test_rss_region_is_an_ellipse() -> None:
    region = allowed_region(sample.plan("rss"), sample.constraints("rss"), PREFERRED)
    assert region is not None
    (a, _), (_, b) = region.boundary[0], region.boundary[-1]
    np.testing.assert_allclose((region.boundary / (a, b)) ** 2 @ [1, 1], 1.0, rtol=1e-9)  # 40 halvings: 1e-12


@pytest.mark.parametrize("rule", ["worst_case", "rss", "percentile"])
def test_on_the_boundary_the_requirement_is_used_up(rule: str) -> None:
    plan, constraints = sample.plan(rule), sample.constraints(rule)
    region = allowed_region(plan, constraints, PREFERRED)
    assert region is not None
    errors = [a.error for a in plan.allowances]
    for point in region.boundary[::10]:
        sizes = np.array([a.allowed for a in plan.allowances])
        sizes[[errors.index(e) for e in PREFERRED]] = point
        assert float(combined(constraints[0], errors, sizes)) == pytest.approx(30.0, rel=1e-8)


def test_a_second_requirement_only_cuts_the_region() -> None:
    plan = sample.plan()
    one = sample.constraints()[0]
    steep = Constraint(
        1, "velocity", "m/s", "worst_case", 1.0, 60.0, {"gyro.bias": np.array([[2500.0, 0.0]])}
    )
    whole, cut = (allowed_region(plan, constraints, PREFERRED) for constraints in ((one,), (one, steep)))
    assert whole is not None
    assert cut is not None
    assert cut.boundary[0, 0] == pytest.approx(1.0 / 2500.0, rel=1e-12)
    assert cut.boundary[-1, 1] == pytest.approx(whole.boundary[-1, 1], rel=1e-12)
    assert set(cut.requirement) == {0, 1}


def test_no_region_when_the_others_use_up_the_limit() -> None:
    assert allowed_region(sample.plan(), sample.constraints(limit=4.0), PREFERRED) is None


def test_the_biases_give_way_to_what_the_requirement_feels() -> None:
    vectors = {e: v for e, v in sample.vectors().items() if "scale_factor" in e}
    felt = (Constraint(0, "position", "m", "worst_case", 30.0, 60.0, vectors),)
    assert axes_of_region(sample.plan(), felt) == ("accelerometer.scale_factor", "gyro.scale_factor")
    assert axes_of_region(sample.plan(), ()) is None


def test_four_quadrants_close_and_mirror() -> None:
    outline = four_quadrants(np.array([[2.0, 0.0], [1.0, 1.0], [0.0, 3.0]]))
    assert {tuple(p) for p in outline} == {
        (2, 0),
        (1, 1),
        (0, 3),
        (-1, 1),
        (-2, 0),
        (-1, -1),
        (0, -3),
        (1, -1),
    }
    np.testing.assert_array_equal(outline[0], outline[-1])


# ---------------------------------------------------------------- time

lengths = st.lists(
    st.tuples(
        st.sampled_from(["ramp", "soak", "record", "pause"]),
        st.floats(0.0, 5e3),
        st.sampled_from([None, "static", "rates"]),
        st.sampled_from([None, -60.0, 20.0]),
    ),
    min_size=1,
    max_size=40,
)


def timeline(rows: list[tuple[str, float, str | None, float | None]]) -> tuple[tuple[Step, ...], float]:
    now, steps = 0.0, []
    for action, length, test, degc in rows:
        steps.append(Step(str(len(steps)), "table", action, now, now + length, test, degc))
        now += length
    return tuple(steps), now


@settings(deadline=None, max_examples=60)
@given(lengths, st.floats(0.0, 1e4))
def test_every_split_of_the_hours_sums_to_the_whole(
    rows: list[tuple[str, float, str | None, float | None]], idle: float
) -> None:
    steps, end = timeline(rows)
    for split in (time_spent.by_action, time_spent.by_test, time_spent.by_temperature, time_spent.by_bench):
        found = split(steps, end + idle)
        # what is below 1e-6 of the whole is not listed: rounding of sums, not waiting
        assert math.fsum(s.seconds for s in found) == pytest.approx(end + idle, rel=2e-6, abs=1e-5)
        assert sum(s.count for s in found) == len(steps)


@settings(deadline=None, max_examples=60)
@given(lengths)
def test_columns_of_the_chart_hold_all_of_the_time(
    rows: list[tuple[str, float, str | None, float | None]],
) -> None:
    steps, end = timeline(rows)
    edges = np.linspace(0.0, max(end, 1.0), 38)
    actions = sorted({time_spent.action_of(step) for step in steps})
    shares = column_shares(steps, edges, actions, time_spent.action_of)
    spent = {s.name: s.seconds for s in time_spent.by_action(steps, end)}
    for action, row in zip(actions, shares, strict=True):
        # the sum of 37 columns against the sum of the steps
        assert row.sum() * (edges[1] - edges[0]) == pytest.approx(spent[action], rel=1e-9, abs=1e-6)
    assert shares.sum(axis=0).max() <= 1.0 + 1e-9


def test_chart_of_one_long_step_is_full_where_it_lasts() -> None:
    steps = (Step("a", "t", "soak", 0.0, 50.0), Step("b", "t", "record", 50.0, 100.0))
    shares = column_shares(steps, np.linspace(0, 100, 5), ["soak", "record"], lambda step: step.action)
    np.testing.assert_allclose(shares, [[1, 1, 0, 0], [0, 0, 1, 1]], atol=1e-12)


def test_temperature_is_straight_on_ramps_and_level_elsewhere() -> None:
    steps = (
        Step("a", "t", "install", 0.0, 10.0, temperature_degc=20.0),
        Step("b", "t", "ramp", 10.0, 30.0, temperature_degc=60.0),
        Step("c", "t", "soak", 30.0, 40.0, temperature_degc=60.0),
        Step("d", "t", "record", 40.0, 45.0, temperature_degc=60.0),
        Step("e", "t", "ramp", 50.0, 60.0, temperature_degc=0.0),
    )
    track = temperature_track(steps)
    at = np.interp([5, 20, 42, 48, 55, 60], track[:, 0], track[:, 1])
    np.testing.assert_allclose(at, [20, 40, 60, 60, 30, 0])
    assert len(track) == 5


# ---------------------------------------------------------------- budget and tables


@pytest.mark.parametrize("rule", ["worst_case", "rss"])
def test_parts_sum_to_the_error_and_errors_to_the_requirement(rule: str) -> None:
    plan = sample.plan(rule)
    found = contributions(plan, 0, sample.constraints(rule))
    for contribution in found:
        assert math.fsum(contribution.parts) == pytest.approx(contribution.share, rel=1e-12)
    assert math.fsum(c.share for c in found) == pytest.approx(1.0, rel=1e-12)
    assert [c.share for c in found] == sorted((c.share for c in found), reverse=True)


def test_budget_table_names_every_part_and_error() -> None:
    plan = sample.plan()
    (table,) = tables.budget_tables(plan, [contributions(plan, 0, sample.constraints())])
    assert len(table.columns) == 3 + len(PARTS) + 2
    gyro = next(row for row in table.rows if row[0] == "gyro.\u200bbias")
    # 300 m per deg/s on each of three axes whose directions have lengths 0.998, 1.000, 1.001
    assert gyro[1:8] == ("deg/s", "0.0087", "0.002", "0.001", "0.001", "0.0035", "0.0012")
    assert gyro[8] == "899.8"


def test_why_this_number_shows_formula_and_groups_temperatures() -> None:
    table = tables.reasons_table(sample.plan())
    assert table is not None
    first = [str(cell).replace("\u202f", " ") for cell in table.rows[0]]
    assert first[4] == "(2.57 · 0.002 / 0.0012)² = 18.35"
    assert "student quantile t at 95\u202f% confidence" in table.caption
    same = [r for r in sample.plan().reasons if r.error == "gyro.scale_factor"]
    assert len(same) == 3


def test_tests_table_counts_records() -> None:
    rows = {row[0]: row for row in tables.tests_table(sample.plan()).rows}
    assert rows["static"][6] == str(7 * 8)
    assert rows["rates"][6] == str(3 * 10 * 12)


# ---------------------------------------------------------------- numbers


@settings(deadline=None, max_examples=200)
@given(st.floats(-1e15, 1e15, allow_nan=False).filter(lambda x: abs(x) > 1e-290))
def test_digits_keep_four_significant_figures(value: float) -> None:
    text = digits(value).replace("\u202f", "").replace("−", "-")
    mantissa, _, power = text.partition("·10")
    exponent = int(power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))) if power else 0
    assert float(f"{mantissa}e{exponent}") == pytest.approx(
        value, rel=5.001e-4
    )  # half of the fourth figure of 1.000
    assert len(mantissa.replace("-", "").replace(".", "").strip("0")) <= 4


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0035, "0.0035"),
        (643200.0, "643\u202f200"),
        (9999.6, "10\u202f000"),
        (1234.5, "1234"),
        (-3.0, "−3"),
        (0.0, "0"),
        (1e-7, "1·10⁻⁷"),
        (math.nan, "–"),
        (math.inf, "∞"),
    ],
)
def test_digits_of_known_values(value: float, text: str) -> None:
    assert digits(value) == text


def test_ratios_are_shown_in_per_cent() -> None:
    assert quantity(2e-5, "1") == "0.002\u202f%"
    assert quantity(math.radians(0.03), "deg/s") == "0.03\u202fdeg/s"


def test_decimal_points_align() -> None:
    cells = align_points(["1.25", "30", "0.5", "deg"])
    assert cells == ["1.25", "30\u2008\u2007\u2007", "0.5\u2007", "deg"]


def test_runs_of_repeats() -> None:
    assert runs(["8", "8", "8"]) == "8"
    assert runs(["8", "5", "5", "6"]) == "8, 5\u202f×2, 6"


def test_a_few_names_are_said_and_many_are_counted() -> None:
    names = [f"u{i}" for i in range(1, 11)]
    assert [names_are(names[:n]) for n in (1, 2, 4)] == ["u1 is", "u1 and u2 are", "u1, u2, u3 and u4 are"]
    assert names_are(names) == "u1, u2, u3 and 7 more are"


@pytest.mark.parametrize(
    ("low", "high", "shown"),
    [
        (1.2, 60.0, {"2", "5", "10", "20", "50"}),
        (0.004, 30.0, {"0.01", "0.1", "1", "10"}),
        (2e-5, 3e-4, None),
    ],
)
def test_the_numbers_of_a_logarithmic_axis_can_be_read(
    low: float, high: float, shown: set[str] | None
) -> None:
    axes = theme.fixed_panels([1.5])[1][0][0]
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    theme.readable_log(axes.xaxis)
    axes.figure.canvas.draw()
    labels = {t.get_text() for t in axes.get_xticklabels() if low <= t.get_position()[0] <= high}
    assert labels - {""} == shown if shown else len(labels) >= 2
    assert not any("times" in label or "×" in label for label in labels)
