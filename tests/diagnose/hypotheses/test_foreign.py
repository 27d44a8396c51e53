"""Effects of an installed package are found when they hide, whatever number and sign of parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner import catalog
from planner.diagnose.channels.parameters import MOST, Range, grid, ranges
from planner.diagnose.diagnosis_to_residual import residual_changes, unit_fits
from planner.diagnose.diagnosis_to_spec import updated_spec
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.export.diagnosis_json import diagnosis_text, read_diagnosis
from planner.nouns.diagnosis import Diagnosis
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Parameter
from planner.spec.load import spec_from_bytes
from planner.spec.model import Spec
from tests.diagnose.findings.test_same_as_calibrate import assert_same, calibrated
from tests.diagnose.foreign import DECLARED, plain_unit
from tests.diagnose.worlds import SPEC, spec
from tests.plugins.installing import Installed

HIDDEN: Mapping[str, tuple[float, Mapping[str, float]]] = {
    "cold": (3e-4, {"knee_degc": -30.0}),
    "wide": (6e-3, {"period": 90.0, "phase": 12.0}),
    "narrow": (6e-3, {"period": 50.0, "phase": -20.0}),
}
NAMES = {"cold": "cold_knee", "wide": "ripple", "narrow": "ripple"}


def plain() -> Spec:
    return spec().model_copy(update={"effects": list(DECLARED)})


@pytest.mark.parametrize("case", ["cold", "narrow"])
def test_one_that_hides_is_named_with_all_its_parameters(case: str, installed_example: Installed) -> None:
    size, parameters = HIDDEN[case]
    table = plain_unit(1, NAMES[case], size, parameters)
    found = diagnose(table, plain())
    (effect,) = found.effects
    assert (effect.effect, effect.channels) == (NAMES[case], ("gyro_y",))
    told = {t.name: t for t in effect.terms if t.parameter}
    assert set(told) == set(parameters) == set(effect.nonlinear)
    for name, value in parameters.items():
        sigma = (told[name].high - told[name].low) / 4.0
        assert abs(told[name].value - value) < 4.0 * sigma
        assert sigma < 0.2 * max(abs(value), 30.0)
    assert_same(effect, calibrated(table, plain(), found))


def test_one_that_another_mirrors_is_named_or_its_rival(installed_example: Installed) -> None:
    """Beside a free bias 1 − exp(−t/τ) and exp(−t/τ) are one effect of either sign."""
    found = diagnose(plain_unit(1, "self_heating", 0.01, {"time_constant": 500.0}), plain())
    (effect,) = found.effects
    assert "self_heating" in {effect.effect, *(r.effect for r in effect.rivals)}
    (tau,) = [t for t in effect.terms if t.parameter]
    assert tau.low < 500.0 < tau.high


def test_where_none_hides_none_is_named(installed_example: Installed) -> None:
    found = diagnose(plain_unit(3), plain())
    assert found.verdict == "clean"
    assert {"cold_knee", "ripple", "self_heating"} <= {n.effect for n in found.not_found}


def test_what_an_effect_needs_says_why_it_cannot_be_tested(installed_example: Installed) -> None:
    table = plain_unit(3)
    missing = diagnose(replace(table, absent=("temp_degc",)), plain())
    why = {u.effect: u.why for u in missing.untestable if u.sensor == "gyro"}
    assert "temp_degc" in why["cold_knee"]
    assert "temp_degc" in why["ripple"]
    flat = replace(table, temperature_degc=np.full(len(table), 20.0))
    why = {u.effect: u.why for u in diagnose(flat, plain()).untestable if u.sensor == "gyro"}
    assert why["cold_knee"] == "all records are at one temperature"


def test_the_residual_the_file_and_the_update_carry_every_parameter(
    installed_example: Installed, tmp_path: Path
) -> None:
    size, parameters = HIDDEN["wide"]
    table = plain_unit(1, "ripple", size, parameters)
    text = SPEC.replace(b"bias_temperature, scale_factor, scale_factor_temperature", b"scale_factor")
    loaded = spec_from_bytes(text, tmp_path / "spec.yaml")
    found = diagnose(table, loaded.spec)
    made = document_of(table, loaded.spec, found, loaded.sha256)
    (tmp_path / "diagnosis.json").write_text(diagnosis_text(made))
    (effect,) = json.loads(diagnosis_text(made))["effects"]
    assert {t["name"]: t["unit"] for t in effect["terms"] if t["nonlinear"]} == {
        "period": "K",
        "phase": "degC",
    }
    (again,) = read_diagnosis(tmp_path / "diagnosis.json").found.effects
    assert again.nonlinear == pytest.approx(found.effects[0].nonlinear)
    change = next(c for c in made.residual if c.channel == "gyro_y")
    assert change.after < change.before
    notes = " ".join(updated_spec(text.decode(), loaded, made).notes)
    assert "period" in notes
    assert "phase" in notes


def document_of(table: DwellTable, declared: Spec, found, sha256: str) -> Diagnosis:
    residual = residual_changes(unit_fits(table, declared, found))
    return Diagnosis(found, residual, (), (), "0", declared.name, sha256, "", "", 1)


# ---------------------------------------------------------------- candidate values


@given(st.lists(st.tuples(st.floats(0.5, 50.0), st.booleans()), min_size=1, max_size=9))
def test_a_grid_is_bounded_and_within_its_ranges(several: list[tuple[float, bool]]) -> None:
    found = [
        Range(p, *p.bounds, np.empty(0))
        for i, (low, linear) in enumerate(several)
        for p in [Parameter(f"p{i}", "1", 2.0 * low, low, 9.0 * low, "linear" if linear else "logarithmic")]
    ]
    points = grid(found)
    assert 2 <= len(points) <= MOST
    assert len({tuple(point.values()) for point in points}) == len(points)
    for point in points:
        for r in found:
            p = r.parameter
            assert p.low * (1 - 1e-9) <= point[p.name] <= p.high * (1 + 1e-9)


def test_ranges_are_narrowed_to_what_the_records_show(installed_example: Installed) -> None:
    table = plain_unit(1)
    known = catalog.effects()
    (knee,) = ranges(known["cold_knee"], table)
    assert (knee.low, knee.high) == (max(-60.0, table.temperature_degc.min()), 40.0)
    (tau,) = ranges(known["self_heating"], table)
    assert np.exp(tau.high) <= 3.0 * table.time_on.max() * (1 + 1e-9)
    assert np.exp(tau.low) >= 60.0 * (1 - 1e-9)
    period, _ = ranges(known["ripple"], table)
    assert (np.exp(period.low), np.exp(period.high)) == pytest.approx((20.0, 200.0))
