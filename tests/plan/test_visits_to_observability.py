"""Errors that the tests calibrate and their records cannot tell are refused, with what is missing."""

from __future__ import annotations

from typing import Any

import pytest

from planner.errors import InputError
from planner.pipelines.planning import exact_plan
from planner.plan.allowance_to_repeats import error_menus
from planner.plan.errors_to_points import point_menus
from planner.plan.records_to_observability import mixed_up_in_calibration, refuse_the_undetermined
from planner.plan.spec_to_errors import error_models
from planner.spec.load import load_spec
from tests.outcome import Run
from tests.specs import SHIPPED, loaded, small
from tests.verify.plans import flown

CUBIC = {"systematic": "0.1 %", "run_to_run": "0.002 %"}
TURNS = ["gyro.scale_factor", "gyro.scale_factor_nonlinearity"]


def edited(**parts: Any) -> dict[str, Any]:
    """`flown` under Student's quantile; `test.key` with a double underscore: static__motions=1."""
    spec = flown()
    spec["plan"] = spec["plan"] | {"quantile": "student"}
    for name, value in parts.items():
        test, _, key = name.partition("__")
        spec["tests"][test] = spec["tests"][test] | {key: value}
    return spec


def cubic(**parts: Any) -> dict[str, Any]:
    """With a cubic error of the gyros that `rates` calibrates."""
    spec = edited(rates__calibrates=TURNS, **parts)
    spec["unit"]["gyro"]["scale_factor_nonlinearity"] = CUBIC
    return spec | {"effects": [*spec["effects"], "scale_factor_nonlinearity"]}


def loads(axes: int) -> dict[str, Any]:
    """With a cubic error of the accelerometers that a centrifuge calibrates."""
    spec = edited(static__calibrates=["gyro.bias", "accelerometer.bias", "accelerometer.scale_factor"])
    spec["unit"]["accelerometer"] |= {"scale_factor": CUBIC, "scale_factor_nonlinearity": CUBIC}
    spec["benches"]["centrifuge"] = {"arm": "1.5 m", "axes": axes, "install": "30 min"}
    spec["tests"]["loads"] = {
        "bench": "centrifuge",
        "calibrates": ["accelerometer.scale_factor_nonlinearity"],
        "motions": 24,
        "record": "20 s",
        "temperatures": "room",
    }
    return spec | {"effects": [*spec["effects"], "scale_factor_nonlinearity"]}


def refusal(spec: dict[str, Any]) -> str:
    found = loaded(spec).spec
    with pytest.raises(InputError) as error:
        error_menus(found, error_models(found), point_menus(found))
    return str(error.value)


def passes(spec: dict[str, Any]) -> bool:
    found = loaded(spec).spec
    refuse_the_undetermined(found, error_models(found))
    return True


def test_a_cubic_error_needs_several_speeds() -> None:
    message = refusal(cubic(rates__motions=6))
    assert message.startswith("tests.rates: the records cannot tell gyro.scale_factor_nonlinearity (x, y, z)")
    assert "from gyro.scale_factor: about x the unit turns at 200 deg/s only" in message
    assert "turns about x at several speeds" in message
    assert len(message.splitlines()) == 1  # the scale factor itself is not named once more
    assert passes(cubic(rates__motions=12))


def test_every_axis_must_be_turned() -> None:
    spins = [
        {"position_2": "0 deg", "rate_1": "100 deg/s"},
        {"position_2": "0 deg", "rate_1": "-100 deg/s"},
    ]
    message = refusal(edited(rates__motions=spins))
    assert "tests.rates: the records cannot tell gyro.scale_factor (x, y) at all" in message
    assert "the unit never turns about x" in message


def test_a_scale_factor_needs_two_attitudes() -> None:
    spec = edited(static__calibrates=["gyro.bias", "accelerometer.scale_factor"], static__motions=1)
    spec["unit"]["accelerometer"]["scale_factor"] = CUBIC
    message = refusal(spec)
    assert "accelerometer.scale_factor (x, y) at all: there is never any specific force along x" in message


def test_what_only_all_tests_together_tell_wants_one_test_that_does() -> None:
    """One rest shows the sum of bias and scale factor on z; the rests of the turns would tell them apart."""
    both = ["gyro.bias", "accelerometer.bias", "accelerometer.scale_factor"]
    rests = [
        {"position_2": "0 deg"},
        {"position_2": "90 deg"},
        {"position_1": "90 deg", "position_2": "90 deg"},
    ]
    spec = edited(static__calibrates=both, static__motions=[rests[0], rests[0]])
    spec["unit"]["accelerometer"]["scale_factor"] = CUBIC
    spec["tests"]["tilts"] = spec["tests"]["static"] | {"calibrates": ["gyro.bias"], "motions": rests}
    assert "no test alone tells accelerometer.bias" in refusal(spec)
    spec["tests"]["tilts"]["calibrates"] = both
    assert passes(spec)


def test_a_test_that_cannot_tell_an_error_is_no_choice_for_it() -> None:
    both = ["accelerometer.bias", "accelerometer.scale_factor"]
    spec = edited(static__calibrates=["gyro.bias", *both])
    spec["unit"]["accelerometer"]["scale_factor"] = CUBIC
    spec["tests"]["upright"] = spec["tests"]["static"] | {"calibrates": both, "motions": 1}
    found = loaded(spec).spec
    menus = error_menus(found, error_models(found), point_menus(found))
    assert {m.test for m in menus if m.error == "accelerometer.scale_factor"} == {"static"}


def test_an_axis_that_is_never_loaded_is_named() -> None:
    assert "(z)" in refusal(loads(axes=2))  # axis 2 brings x and y outwards, never z
    assert passes(loads(axes=1))  # an arm of one axis: remounted, so that every axis lies along it


def test_a_declared_effect_that_nobody_calibrates_is_remarked_upon() -> None:
    spec = edited(rates__motions=6)
    spec["effects"] = [*spec["effects"], "scale_factor_nonlinearity"]
    found = loaded(spec).spec
    remarks = mixed_up_in_calibration(found, error_models(found))
    assert any(
        "gyro.scale_factor_nonlinearity is declared, but no test calibrates it" in r
        and "gyro.scale_factor" in r
        for r in remarks
    )


def test_published_coefficients_ask_for_no_axis() -> None:
    spec = small()
    spec["plan"] = spec["plan"] | {"quantile": "student"}
    assert passes(spec)


@pytest.mark.parametrize("name", sorted(path.stem for path in SHIPPED.glob("*.yaml")))
def test_the_shipped_specs_can_be_calibrated(name: str) -> None:
    spec = load_spec(SHIPPED / f"{name}.yaml").spec
    models = error_models(spec)
    refuse_the_undetermined(spec, models)
    assert mixed_up_in_calibration(spec, models) == []


def test_plan_and_check_say_so_with_exit_code_2(run: Run, tmp_path: Any) -> None:
    text = (SHIPPED / "small_uav.yaml").read_text(encoding="utf-8")
    short = text.replace("motions: 6\n    power_on: 30 s\n    record: 20 s", "motions: 2\n    record: 20 s")
    assert short != text
    (tmp_path / "short.yaml").write_text(short, encoding="utf-8")
    found = run("plan", "short.yaml")
    assert found.code == 2
    assert "tests.rates: the records cannot tell gyro.misalignment" in found.err
    assert "the unit never turns about" in found.err
    checked = run("check", "short.yaml")
    assert (checked.code, checked.out) == (2, "")
    assert _error(checked.err) == _error(found.err)


def _error(err: str) -> str:
    """What stands on stderr, without the warnings and the progress before it."""
    return err[err.index("error:") :]


def test_a_weak_determination_is_remarked_upon_in_the_plan() -> None:
    """At 1 deg/s a drift of 0.001 deg/s between two turns looks like 0.1 % of scale factor."""
    slow = [
        {"position_1": "90 deg", "rate_2": "1 deg/s"},
        {"position_1": "90 deg", "rate_2": "-1 deg/s"},
        {"position_1": "0 deg", "rate_2": "1 deg/s"},
        {"position_1": "0 deg", "rate_2": "-1 deg/s"},
        {"position_2": "0 deg", "rate_1": "1 deg/s"},
        {"position_2": "0 deg", "rate_1": "-1 deg/s"},
    ]
    notes = exact_plan(loaded(edited(rates__motions=slow))).notes
    assert any("tests.rates: its motions determine gyro.scale_factor weakly" in note for note in notes)
    quick = exact_plan(loaded(edited(rates__motions=6))).notes
    assert not any("weakly" in note for note in quick)
