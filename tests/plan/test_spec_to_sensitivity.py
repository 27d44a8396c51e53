"""The stage from flight and errors to constraints: order, components, instants, units, refusals, laws."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.catalog import effects
from planner.errors import InputError
from planner.nouns.sensitivities import Constraint, Sensitivities, SensitivityColumn
from planner.plan.spec_to_sensitivity import conditions_of, constraints, sensitivities, sensitivity_rows
from planner.spec.model import Spec
from tests.physics.flights import AT_REST, MANOEUVRES, Curve, fly

FLIGHT = fly(MANOEUVRES, 30.0, temperature=Curve(20.0, 0.5))
BASIC = ("accelerometer.bias", "gyro.bias")


def spec(*requirements: dict[str, Any], given: dict[str, str] | None = None) -> Spec:
    return Spec.model_validate(
        {
            "planner": 1,
            "name": "test",
            "requirement": list(requirements),
            "trajectory": "static",
            "sensitivities": {"given": given} if given else "simulated",
            "unit": {"gyro": {"bias": {"run_to_run": "0.002 deg/s"}}},
            "effects": ["bias"],
            "benches": {"rate_table": {"axes": 2}},
            "tests": {"drift": {"bench": "rate_table", "calibrates": ["gyro.bias"], "record": "300 s"}},
        }
    )


def found_in(
    position: np.ndarray, columns: tuple[str, ...] = ("gyro.bias", "gyro.scale_factor")
) -> Sensitivities:
    """A made-up history (m, 3, p) with the columns dealt out to the errors in turn."""
    owners = tuple(
        SensitivityColumn(columns[i % len(columns)], str(i), "1") for i in range(position.shape[2])
    )
    return Sensitivities(np.arange(float(len(position))), owners, position, 2.0 * position, 3.0 * position)


# ---------------------------------------------------------------- columns


def test_columns_keep_the_order_asked_for_and_belong_to_their_error() -> None:
    mixed = sensitivities(FLIGHT, ("accelerometer.scale_factor", "gyro.misalignment", "accelerometer.bias"))
    assert [(c.error, c.axis) for c in mixed.columns][:4] == [
        ("accelerometer.scale_factor", "x"),
        ("accelerometer.scale_factor", "y"),
        ("accelerometer.scale_factor", "z"),
        ("gyro.misalignment", "xy"),
    ]
    for error in dict.fromkeys(c.error for c in mixed.columns):
        alone = sensitivities(FLIGHT, (error,))
        mine = [i for i, c in enumerate(mixed.columns) if c.error == error]
        scale = np.abs(alone.position).max()
        np.testing.assert_allclose(mixed.position[:, :, mine], alone.position, rtol=1e-9, atol=1e-12 * scale)
        assert [mixed.columns[i] for i in mine] == list(alone.columns)


def test_every_effect_of_the_catalogue_gives_finite_columns() -> None:
    errors = [f"{sensor}.{name}" for name, effect in effects().items() for sensor in effect.sensors]
    found = sensitivities(FLIGHT, errors)
    assert found.position.shape == (len(found.time_s), 3, len(found.columns))
    assert {c.error for c in found.columns} == set(errors)
    for history in (found.position, found.velocity, found.attitude):
        assert np.isfinite(history).all()


def test_misalignment_is_scale_factor_seen_across() -> None:
    # a term xy with the drive of y on channel x: bias of channel x times the constant rate of y
    still = fly(AT_REST, 20.0)
    found = sensitivities(still, ("accelerometer.bias", "accelerometer.misalignment"))
    axes = [c.axis for c in found.columns]
    down = still.velocity_increment[:, 2].mean() / 0.01
    np.testing.assert_allclose(
        found.position[-1, :, axes.index("xz")], down * found.position[-1, :, 0], rtol=1e-9, atol=1e-6
    )


@pytest.mark.parametrize(
    "error", ["gyro.biass", "bias", "magnetometer.bias", "accelerometer.g_sensitivity", ""]
)
def test_unknown_errors_are_refused_with_what_exists(error: str) -> None:
    with pytest.raises(InputError, match=r"expected gyro\.<effect> or accelerometer\.<effect>.*bias"):
        sensitivities(FLIGHT, (error,))


def test_conditions_are_means_over_the_sampling_intervals() -> None:
    conditions = conditions_of(FLIGHT)
    np.testing.assert_allclose(conditions.rate * 0.01, FLIGHT.angle_increment, rtol=1e-12)
    np.testing.assert_allclose(
        conditions.temperature_degc, 20.0 + 0.5 * (FLIGHT.time_s[:-1] + 0.005), rtol=1e-9
    )
    np.testing.assert_allclose(conditions.temperature_rate, 0.5, rtol=1e-6)
    np.testing.assert_allclose(conditions.time_on, 5.005 + FLIGHT.time_s[:-1])
    part = conditions_of(FLIGHT, 100, 130)
    np.testing.assert_array_equal(part.specific_force, conditions.specific_force[100:130])
    assert part.day.shape == part.time_on.shape == (30,)


# ---------------------------------------------------------------- constraints


@pytest.mark.parametrize(
    ("error", "limit", "field", "rows"),
    [
        ("position", "10 m", "position", [0, 1, 2]),
        ("horizontal", "10 m", "position", [0, 1]),
        ("north", "10 m", "position", [0]),
        ("east", "10 m", "position", [1]),
        ("up", "10 m", "position", [2]),
        ("velocity", "1 m/s", "velocity", [0, 1, 2]),
        ("attitude", "1 deg", "attitude", [0, 1, 2]),
        ("roll_pitch", "1 deg", "attitude", [0, 1]),
        ("heading", "1 deg", "attitude", [2]),
    ],
)
def test_each_requirement_takes_its_components(error: str, limit: str, field: str, rows: list[int]) -> None:
    found = found_in(np.random.default_rng(1).normal(size=(4, 3, 5)))
    (only,) = constraints(spec({"error": error, "limit": limit}), found)
    end = getattr(found, field)[-1][rows]
    np.testing.assert_array_equal(only.vectors["gyro.bias"], end[:, [0, 2, 4]].T)
    np.testing.assert_array_equal(only.vectors["gyro.scale_factor"], end[:, [1, 3]].T)
    assert (only.time_s, only.rule, only.percentile, only.requirement) == (3.0, "worst_case", None, 0)
    assert only.limit == pytest.approx(np.deg2rad(1.0) if field == "attitude" else float(limit.split()[0]))
    assert only.unit == limit.split()[1]


def test_rules_and_several_requirements() -> None:
    wanted = spec(
        {"error": "up", "limit": "5 m", "rule": "rss"},
        {"error": "north", "limit": "3 m", "rule": {"percentile": "99 %"}},
    )
    first, second = constraints(wanted, found_in(np.ones((2, 3, 2))))
    assert (first.rule, first.requirement, first.percentile) == ("rss", 0, None)
    assert (second.rule, second.requirement, second.percentile) == ("percentile", 1, pytest.approx(0.99))


def test_a_time_between_instants_is_interpolated_and_one_outside_refused() -> None:
    found = found_in(np.arange(4.0)[:, None, None] ** 2 * np.ones((4, 3, 2)))
    (between,) = constraints(spec({"error": "north", "limit": "1 m", "at": "2.5 s"}), found)
    np.testing.assert_allclose(between.vectors["gyro.bias"], [[0.5 * (4.0 + 9.0)]])
    with pytest.raises(InputError, match=r"at 4 s, but the flight ends at 3 s.*choose"):
        constraints(spec({"error": "north", "limit": "1 m", "at": "4 s"}), found)


def test_an_instant_asked_for_is_exact() -> None:
    (exact,) = constraints(
        spec({"error": "position", "limit": "1 m", "at": "7.77 s"}),
        sensitivities(FLIGHT, BASIC, instants=[7.77]),
    )
    end = sensitivities(fly(MANOEUVRES, 7.77), BASIC).position[-1]
    np.testing.assert_allclose(
        exact.vectors["gyro.bias"], end[:, 3:].T, rtol=1e-4, atol=1e-4 * np.abs(end).max()
    )


def length(constraint: Constraint, sizes: dict[str, float]) -> float:
    """The requirement's left side by its own rule; a percentile by the largest variance in any direction."""
    vectors = [sizes[name] * v for name, v in constraint.vectors.items()]
    if constraint.rule == "worst_case":
        return float(sum(np.linalg.norm(v, axis=1).sum() for v in vectors))
    if constraint.rule == "rss":
        return float(sum((v**2).sum() for v in vectors))
    return float(np.linalg.eigvalsh(sum(v.T @ v for v in vectors))[-1])


@settings(deadline=None, max_examples=60)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(["worst_case", "rss", {"percentile": "95 %"}]),
    st.sampled_from(["position", "horizontal", "up"]),
)
def test_any_keeps_an_instant_for_every_worst_moment(seed: int, rule: object, error: str) -> None:
    rng = np.random.default_rng(seed)
    found = found_in(rng.normal(size=(25, 3, 4)) * rng.uniform(0.1, 3.0, size=(25, 1, 1)))
    kept = constraints(spec({"error": error, "limit": "1 m", "rule": rule, "at": "any"}), found)
    each = [
        constraints(spec({"error": error, "limit": "1 m", "rule": rule, "at": f"{t} s"}), found)[0]
        for t in found.time_s[1:]
    ]
    for sizes in rng.exponential(size=(20, 2)):
        by_name = dict(zip(("gyro.bias", "gyro.scale_factor"), sizes, strict=True))
        worst = max(length(c, by_name) for c in each)
        assert max(length(c, by_name) for c in kept) >= worst * (1.0 - 1e-6)
    assert list(kept) == sorted(kept, key=lambda c: c.time_s)


def test_any_drops_what_the_end_implies() -> None:
    growing = found_in(np.arange(1.0, 9.0)[:, None, None] * np.ones((8, 3, 2)))
    for rule in ("worst_case", "rss", {"percentile": "95 %"}):
        (only,) = constraints(spec({"error": "position", "limit": "1 m", "rule": rule, "at": "any"}), growing)
        assert only.time_s == 7.0


def test_given_coefficients_stand_for_all_axes_together() -> None:
    published = {"gyro.bias": "578.5 m/(deg/s)", "accelerometer.scale_factor": "10015 m"}
    (only,) = constraints(spec({"error": "position", "limit": "10 m"}, given=published), None)
    assert set(only.vectors) == set(published)
    np.testing.assert_allclose(only.vectors["gyro.bias"], [[578.5 * 180.0 / np.pi]])
    np.testing.assert_allclose(only.vectors["accelerometer.scale_factor"], [[10015.0]])


# ---------------------------------------------------------------- rows


def test_rows_are_per_display_unit_and_in_degrees() -> None:
    found = sensitivities(FLIGHT, ("gyro.bias", "accelerometer.bias", "accelerometer.scale_factor"))
    rows = sensitivity_rows(found)
    assert [row.per for row in rows] == ["deg/s"] * 3 + ["g"] * 3 + ["1"] * 3
    factors = [np.pi / 180.0, 9.80665, 1.0]
    for i, row in enumerate(rows):
        factor = factors[i // 3]
        expected = [
            *found.position[-1, :, i],
            *found.velocity[-1, :, i],
            *np.rad2deg(found.attitude[-1, :, i]),
        ]
        values = [row.north_m, row.east_m, row.up_m, row.north_mps, row.east_mps, row.up_mps]
        np.testing.assert_allclose(
            [*values, row.roll_deg, row.pitch_deg, row.heading_deg], np.multiply(expected, factor)
        )


def test_rows_of_a_unit_at_rest_are_the_textbook_figures() -> None:
    # g t²/2 of 1 g for a minute: 17.65 km; 1 deg/s for a minute: 60 deg of roll
    still = fly(AT_REST, 60.0)
    rows = {(r.error, r.axis): r for r in sensitivity_rows(sensitivities(still, BASIC))}
    assert rows["accelerometer.bias", "z"].up_m == pytest.approx(-17652.0, rel=2e-3)
    assert rows["gyro.bias", "x"].roll_deg == pytest.approx(60.0, rel=1e-3)
