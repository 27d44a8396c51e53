"""What has no name gets the curve that was measured: in the diagnosis, in its file, in the updated spec."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner import catalog
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.effects._measured_curve import curve_name, curve_of
from planner.export.diagnosis_json import diagnosis_text, read_diagnosis
from planner.nouns.diagnosis import Unknown
from tests.diagnose.found import found_effect
from tests.diagnose.labs.shapes import Hidden
from tests.diagnose.labs.unit import campaign
from tests.diagnose.test_verdicts import spec
from tests.diagnose.update.test_update_spec import diagnosis, updated
from tests.specs import SHIPPED

UAV = SHIPPED / "small_uav.yaml"
DPS = np.radians(1.0)


def unnamed(*nodes: float, over: str = "rate_modulus", size: float = 5e-3) -> Unknown:
    """Something on gyro y, with a curve over the rate whose every node is of one size."""
    curve = found_effect(curve_name("gyro", 1, over, nodes), "gyro_y", size * DPS, 0.1 * size * DPS)
    return Unknown(("gyro_y",), "rate", 1e-6, 20.0, curve)


def test_what_has_no_name_gets_a_curve_over_the_variable_that_it_follows() -> None:
    table, _ = campaign(4, Hidden("wave over time", "gyro_x", 25.0))
    (found,) = diagnose(replace(table, acc=None), spec()).unknown
    assert (found.varies_with, found.channels) == ("time_on", ("gyro_x",))
    assert found.curve is not None
    curve = curve_of(found.curve.effect)
    assert curve is not None
    assert (curve.over, curve.sensor, curve.axis) == ("time_on", "gyro", 0)
    sure = [np.sign(t.value) for t in found.curve.terms if t.low > 0.0 or t.high < 0.0]
    assert len(sure) >= 2


def test_the_curve_survives_the_file(tmp_path) -> None:
    one = diagnosis(UAV, unknown=(unnamed(0.0, 100.0, 400.0),))
    (tmp_path / "diagnosis.json").write_text(diagnosis_text(one), encoding="utf-8")
    (again,) = read_diagnosis(tmp_path / "diagnosis.json").found.unknown
    assert again.curve is not None
    assert again.curve.effect == "curve_gyro_y_over_rate_modulus_at_0_100_400"
    assert np.allclose([t.value for t in again.curve.terms], 5e-3 * DPS)


def test_update_declares_the_curve_with_a_budget_and_a_test_that_tells_it() -> None:
    _, loaded = updated(UAV, unknown=(unnamed(0.0, 50.0, 200.0, 500.0),))
    name = "curve_gyro_y_over_rate_modulus_at_0_50_200_500"
    assert name in loaded.spec.effects
    assert loaded.spec.unit.gyro[name].systematic.si >= 5e-3 * DPS
    assert any(f"gyro.{name}" in t.calibrates for t in loaded.spec.tests.values())
    assert catalog.effects()[name].units == {"gyro": "deg/s"}


def test_a_curve_that_no_test_can_tell_goes_into_the_budget_instead() -> None:
    """So small that sixty repeats do not show it."""
    effect = found_effect("scale_factor_asymmetry", "gyro_x", 1e-3, 1e-4)
    _, loaded = updated(UAV, effect, unknown=(unnamed(0.0, 50.0, 500.0, size=1e-6),))
    assert not any(name.startswith("curve_") for name in loaded.spec.effects)
