"""An effect at the parameters of one unit: the plain effect there, told by its name."""

from __future__ import annotations

import numpy as np
import pytest

from planner.campaign.channel_model import channel_model
from planner.catalog import effects
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.diagnosis_to_spec import updated_spec
from planner.diagnose.search.sensor import begin
from planner.effects._shaped import plain_names, shaped_name
from planner.errors import InputError
from planner.export.effects import effect_document
from planner.nouns.diagnosis import Diagnosis, FoundEffect, FoundTerm, UnitDiagnosis
from planner.protocols import SENSORS
from planner.spec.load import load_spec, spec_from_bytes
from planner.spec.starter import starter_text
from planner.testing.effect_laws import check_effect
from tests.calibrate.world import Layout, campaign
from tests.diagnose.worlds import DECLARED
from tests.effects.conditions import random_conditions
from tests.specs import SHIPPED
from tests.verify.plans import planned_from
from tests.verify.test_recount_promise import by_hand, faults

SHAPED = "warm_up_of_gyro_with_time_constant_156"


def test_it_is_the_plain_effect_at_its_parameter_and_keeps_the_laws() -> None:
    plain, shaped = effects()["warm_up"], effects()[SHAPED]
    conditions = random_conditions(np.random.default_rng(3), 50)
    at = plain.regressors("gyro", conditions, {"time_constant": 156.0})
    assert np.array_equal(shaped.regressors("gyro", conditions), at)
    assert not np.array_equal(at, plain.regressors("gyro", conditions))
    other = plain.regressors("gyro", conditions, {"time_constant": 90.0})
    assert np.array_equal(shaped.regressors("gyro", conditions, {"time_constant": 90.0}), other)
    assert shaped.sensors == ("gyro",)
    assert "156 s" in shaped.title
    check_effect(shaped)


@pytest.mark.parametrize(
    "name",
    [
        "warm_up_of_gyro_with_time_constant_1",  # out of range
        "warm_up_of_gyro_with_depth_156",
        "bias_of_gyro_with_time_constant_156",
        "nothing_of_gyro",
        "g_sensitivity_of_acc",  # acts on gyros alone
        "bias_step_of_gyro_with_day_9",  # a step has no usual value
        "nothing_of_acc_with_time_constant_156",
        "g_sensitivity_of_acc_with_time_constant_156",
    ],
)
def test_a_name_that_describes_none_is_none(name: str) -> None:
    assert name not in effects()


def test_an_effect_on_one_sensor_is_the_plain_one_there_and_none_on_the_other() -> None:
    plain, one = effects()["scale_factor_nonlinearity"], effects()["scale_factor_nonlinearity_of_gyro"]
    conditions = random_conditions(np.random.default_rng(3), 50)
    assert np.array_equal(one.regressors("gyro", conditions), plain.regressors("gyro", conditions))
    assert one.sensors == ("gyro",)
    assert plain.sensors == ("gyro", "accelerometer")
    check_effect(effects()["drift_curve_of_acc"])


def test_a_plan_for_one_sensors_effect_is_counted_again_and_fits_it_on_that_sensor() -> None:
    spec = by_hand()
    name = "scale_factor_nonlinearity_of_gyro"
    gyro = spec["unit"]["gyro"] | {name: {"systematic": "1 %", "run_to_run": "0.02 %"}}
    made = by_hand(gyro=gyro) | {"effects": [*spec["effects"], name]}
    made["tests"] = made["tests"] | {"rates": made["tests"]["rates"] | {"motions": 30}}  # five rates
    one = planned_from(made)
    assert not faults(one)
    left = one.document["allowances"][f"gyro.{name}"]
    assert left["unit"] == "%"
    assert 0.0 < left["parts"]["estimate"] < 0.1  # fitted: a tenth of what the budget has
    conditions = random_conditions(np.random.default_rng(3), 50)
    fitted = [channel_model(s, 0, conditions, one.loaded.spec.effects).columns() for s in SENSORS]
    assert [name in {c.effect for c in columns} for columns in fitted] == [True, False]


def test_one_effect_under_two_names_on_one_sensor_is_refused() -> None:
    text = starter_text().replace("effects: [bias,", "effects: [bias_of_acc, bias,")
    with pytest.raises(InputError) as caught:
        spec_from_bytes(text.encode(), SHIPPED / "twice.yaml")
    assert [f.code for f in caught.value.faults] == ["P242"]


def test_names_come_back() -> None:
    for name, values in (("thermal_lag", {"time_constant": 109.71}), ("warm_up", {"time_constant": 1234.0})):
        written = shaped_name(name, "accelerometer", values)
        assert effects()[written].nonlinear["time_constant"] == pytest.approx(*values.values(), rel=5e-3)
        assert plain_names((written, "bias"), "accelerometer") == (name, "bias")
        assert plain_names((written, "bias"), "gyro") == ("bias",)


def test_update_declares_the_effect_at_what_was_found_and_a_diagnosis_does_not_ask_again() -> None:
    path = SHIPPED / "close_the_loop.yaml"
    terms = [
        FoundTerm("x", "gyro_x", 1e-4, 0.9e-4, 1.1e-4, 60.0, "deg/s"),
        FoundTerm("time_constant", "gyro_x", 156.2, 120.0, 200.0, 60.0, "s", True),
    ]
    tau = {"time_constant": 156.2}
    found = FoundEffect("warm_up", "gyro", ("gyro_x",), tuple(terms), 0.001, 20.0, nonlinear=tau)
    unit = UnitDiagnosis("u1", "explained", (found,), (), (), (), (), ())
    whole = Diagnosis(unit, (), (), (), "0", "x", load_spec(path).sha256, "a" * 64, "data.csv", 1)
    made = updated_spec(path.read_text(encoding="utf-8"), load_spec(path), whole)
    new = spec_from_bytes(made.text.encode(), path).spec
    assert SHAPED in new.effects
    assert SHAPED in new.unit.gyro
    assert not any("600 s" in note for note in made.notes)
    table = campaign(3, layout=Layout(static_repeats=1, rate_repeats=1))
    asked = {b.name for b in begin(prepared(table), "gyro", (*DECLARED, SHAPED)).pool.blocks}
    assert "warm_up" not in asked
    assert "warm_up" in {
        b.name for b in begin(prepared(table), "accelerometer", (*DECLARED, SHAPED)).pool.blocks
    }


def test_the_document_of_an_effect_says_whose_it_is() -> None:
    for name in ("drift_curve_of_gyro", SHAPED, "scatter_over_input_at_10_500_of_0_1"):
        document = effect_document(effects()[name])
        assert (document["name"], document["from"]["distribution"]) == (name, "planner")
    assert effect_document(effects()["drift_curve_of_gyro"])["sensors"] == ["gyro"]
