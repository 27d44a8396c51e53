"""What no campaign of the tests tells is refused, with the remedy; plans are mended where they may be."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import stdtrit

from planner.campaign.model import Campaign
from planner.errors import InputError
from planner.measurement import Column
from planner.nouns.array import Array
from planner.nouns.choices import TestVisits
from planner.nouns.plan import Plan
from planner.pipelines.planning import exact_plan
from planner.plan.allowance_to_repeats import error_menus
from planner.plan.errors_to_points import point_menus
from planner.plan.observable_campaign import observable, refuse_what_no_campaign_observes
from planner.plan.spec_to_errors import error_models
from planner.plan.visits_to_observability import campaign_of, unobservable_in
from planner.spec.load import spec_from_bytes
from tests.outcome import Run
from tests.specs import SHIPPED, loaded, shipped, small
from tests.verify.plans import flown

CUBIC = {"systematic": "0.1 %", "run_to_run": "0.002 %"}
G = 9.80665
TURNS = ["gyro.scale_factor", "gyro.scale_factor_nonlinearity"]
REST = {"bench": "rate_table", "record": "60 s", "power_on": "30 s", "cool_down": "5 min"}


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
    """With a cubic error of the accelerometers that a centrifuge calibrates, and one of the gyros."""
    spec = cubic(static__calibrates=["gyro.bias", "accelerometer.bias", "accelerometer.scale_factor"])
    spec["tests"]["rates"]["motions"] = 12
    spec["unit"]["accelerometer"] |= {"scale_factor": CUBIC, "scale_factor_nonlinearity": CUBIC}
    spec["benches"]["centrifuge"] = {"arm": "1.5 m", "axes": axes, "install": "30 min"}
    spec["tests"]["loads"] = {
        "bench": "centrifuge",
        "calibrates": ["accelerometer.scale_factor_nonlinearity"],
        "motions": 24,
        "record": "20 s",
        "temperatures": "room",
    }
    return spec


def one_face(**plan: Any) -> dict[str, Any]:
    """`static` stands on one face, `faces` on six: what the starter once was."""
    spec = edited(static__motions=1)
    spec["unit"]["accelerometer"]["scale_factor"] = CUBIC
    spec["tests"]["faces"] = REST | {"calibrates": ["accelerometer.scale_factor"], "motions": 6}
    spec["effects"] = [*spec["effects"], "scale_factor_temperature"]
    return spec | {"plan": spec["plan"] | plan}


def tilts() -> dict[str, Any]:
    """`static` stands upright only and calibrates all; three rests of another test would tell it apart."""
    rests = [
        {"position_2": "0 deg"},
        {"position_2": "90 deg"},
        {"position_1": "90 deg", "position_2": "90 deg"},
    ]
    both = ["gyro.bias", "accelerometer.bias", "accelerometer.scale_factor"]
    spec = edited(static__calibrates=both, static__motions=[rests[0], rests[0]])
    spec["unit"]["accelerometer"]["scale_factor"] = CUBIC
    spec["tests"]["tilts"] = spec["tests"]["static"] | {"calibrates": ["gyro.bias"], "motions": rests}
    return spec


def by_hand(repeats: int = 3, **degc: list[int]) -> dict[str, Any]:
    """`plan.fixed`: test -> temperatures."""
    return {
        name: {"temperatures": [f"{t} degC" for t in at], "repeats": repeats} for name, at in degc.items()
    }


def refusal(spec: dict[str, Any]) -> str:
    """What `check` says; `plan` says the same."""
    with pytest.raises(InputError) as error:
        refuse_what_no_campaign_observes(loaded(spec).spec)
    with pytest.raises(InputError) as planned:
        exact_plan(loaded(spec))
    assert str(planned.value) == str(error.value)
    return str(error.value)


WANTED = {
    "temperature_rate": ("0.01 deg/s/(K/min)", "moves by 0 K/min only", "while it rises and while it falls"),
    "ageing": ("0.0001 deg/s/day", "on day 0 only", "make them on several days"),
    "drift_curve": ("0.02 deg/s", "s after power-on", "record sooner after power-on"),
}


@pytest.mark.parametrize("effect", [*WANTED])
def test_a_refusal_names_the_records_that_an_effect_of_time_or_temperature_lacks(effect: str) -> None:
    systematic, seen, advice = WANTED[effect]
    spec = edited()
    spec["unit"]["gyro"][effect] = {"systematic": systematic, "run_to_run": f"0 {systematic.split()[1]}"}
    spec["effects"] = [*spec["effects"], effect]
    spec["tests"]["static"]["calibrates"] = ["gyro.bias", f"gyro.{effect}", "accelerometer.bias"]
    said = refusal(spec)
    assert f"gyro.{effect}" in said
    assert seen in said
    assert advice in said
    assert "motions" not in said


def passes(spec: dict[str, Any]) -> bool:
    refuse_what_no_campaign_observes(loaded(spec).spec)
    return True


def visits(plan: Plan) -> tuple[TestVisits, ...]:
    return tuple(TestVisits(t.test, t.temperatures_degc, t.repeats) for t in plan.tests)


# ---------------------------------------------------------------- what no motions of the tests tell


def test_a_cubic_error_needs_several_speeds() -> None:
    message = refusal(cubic(rates__motions=6))
    assert message.startswith("tests.rates: the records cannot tell gyro.scale_factor_nonlinearity (x, y, z)")
    assert "from gyro.scale_factor: about x the unit turns at 200 deg/s only" in message
    assert "turns about x at several speeds" in message
    assert len(message.splitlines()) == 1  # the scale factor itself is not named once more
    assert passes(cubic(rates__motions=12))


@pytest.mark.parametrize("rate", ["5 %", "20 ppm"])
def test_an_error_behind_what_the_table_may_be_off_by_asks_for_another_bench(rate: str) -> None:
    """It asked for turns at several speeds, of which there were two."""
    spec = edited()
    spec["benches"]["rate_table"]["accuracy"] = {"rate": rate, "level": "0.001 deg"}
    if rate == "20 ppm":
        assert passes(spec)
        return
    message = refusal(spec)
    assert "tests.rates: the records cannot tell gyro.scale_factor (x, y, z) better" in message
    assert "benches.rate_table.accuracy.rate is in the way" in message
    assert "level" not in message
    assert "speeds" not in message


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


def test_an_axis_that_is_never_loaded_is_named() -> None:
    assert "(z)" in refusal(loads(axes=2))  # axis 2 brings x and y outwards, never z
    assert passes(loads(axes=1))  # an arm of one axis: remounted, so that every axis lies along it


def test_a_curve_counted_from_the_end_of_its_range_asks_for_that_end() -> None:
    """K's table over the load ends at 100 g, where the scale factor stands: 50 g tell neither."""
    spec = loads(axes=1)
    for sensor, name in (
        ("gyro", "scale_factor_nonlinearity"),
        ("accelerometer", "scale_factor_nonlinearity"),
    ):
        spec["unit"][sensor].pop(name)
    spec["unit"]["accelerometer"]["scale_factor_curve"] = CUBIC
    spec["effects"] = [*spec["effects"][:-1], "scale_factor_curve"]
    spec["tests"]["rates"]["calibrates"] = ["gyro.scale_factor"]
    spec["tests"]["loads"]["calibrates"] = ["accelerometer.scale_factor_curve"]
    spec["benches"]["centrifuge"]["limits"] = {"acceleration": "50 g"}
    assert "several attitudes or loads along x up to 100 g" in refusal(spec)


def test_a_declared_effect_that_nobody_calibrates_is_refused_where_a_fit_mixes_it_up() -> None:
    spec = edited(rates__motions=6)
    spec["effects"] = [*spec["effects"], "scale_factor_nonlinearity"]
    message = refusal(spec)
    assert "cannot tell gyro.scale_factor (x, y, z) from gyro.scale_factor_nonlinearity" in message
    assert "is declared, but no test calibrates it: take it out of effects, or let a test" in message
    spec["tests"]["rates"]["motions"] = 12  # the same effect, told well enough
    assert passes(spec)


def test_published_coefficients_ask_for_no_axis() -> None:
    spec = small()
    spec["plan"] = spec["plan"] | {"quantile": "student"}
    assert passes(spec)


def test_a_test_that_cannot_tell_an_error_is_no_choice_for_it() -> None:
    both = ["accelerometer.bias", "accelerometer.scale_factor"]
    spec = edited(static__calibrates=["gyro.bias", *both])
    spec["unit"]["accelerometer"]["scale_factor"] = CUBIC
    spec["tests"]["upright"] = spec["tests"]["static"] | {"calibrates": both, "motions": 1}
    found = loaded(spec).spec
    menus = error_menus(found, error_models(found), point_menus(found))
    assert {m.test for m in menus if m.error == "accelerometer.scale_factor"} == {"static"}


# ---------------------------------------------------------------- what the campaign as a whole tells


def test_by_hand_one_face_at_most_temperatures_is_refused_with_the_remedy() -> None:
    message = refusal(one_face(fixed=by_hand(static=[-60, 0, 60], faces=[0], rates=[0])))
    assert message == (
        "tests.faces: the records cannot tell accelerometer.scale_factor (z) from accelerometer.bias at -60 "
        "and 60 degC: the specific force along z is 1 g only; make faces at -60 and 60 degC too, or give "
        "static its 6 motions and what it calibrates"
    )


def test_either_remedy_of_the_refusal_is_one() -> None:
    three, one = [-60, 0, 60], [0]
    assert passes(one_face(fixed=by_hand(static=three, faces=three, rates=one)))
    merged = one_face(fixed=by_hand(static=three, rates=one))
    faces = merged["tests"].pop("faces")
    static = merged["tests"]["static"]
    static |= {"motions": 6, "calibrates": [*static["calibrates"], *faces["calibrates"]]}
    assert passes(merged)


def test_where_the_planner_chooses_it_makes_the_test_at_the_other_temperatures_too() -> None:
    spec = one_face()
    plan = exact_plan(loaded(spec))
    made = {t.test: t.temperatures_degc for t in plan.tests}
    assert len(made["static"]) > len(made["faces"]) > 1  # at the one where the gyros turn that is enough
    assert set(made["static"]) == {*made["faces"], *made["rates"]}
    assert not plan.proved
    assert plan.complete  # nothing was cut short: there is nothing to wait for
    assert plan.gap > 0
    assert plan.objective_value == pytest.approx(plan.time_s)
    assert any(
        "added so that the campaign as a whole tells the errors apart: faces at" in n for n in plan.notes
    )
    assert unobservable_in(loaded(spec).spec, visits(plan)) == ()


def test_what_was_added_was_needed() -> None:
    found = loaded(one_face())
    spec, made = found.spec, visits(exact_plan(found))
    (faces,) = (v for v in made if v.test == "faces")
    for t in faces.temperatures_degc[:-1]:
        kept = tuple((x, n) for x, n in zip(faces.temperatures_degc, faces.repeats, strict=True) if x != t)
        less = TestVisits("faces", tuple(x for x, _ in kept), tuple(n for _, n in kept))
        bare = tuple(less if v.test == "faces" else v for v in made)
        hidden = unobservable_in(spec, bare)
        assert {(u.error.effect, u.term, u.nodes_degc) for u in hidden} == {
            ("bias", "z", (t,)),
            ("scale_factor", "z", (t,)),
        }
        assert unobservable_in(spec, observable(spec, bare).visits) == ()


def test_a_test_that_may_not_be_moved_is_not_moved() -> None:
    spec = one_face()
    spec["tests"]["faces"]["temperatures"] = ["0 degC"]
    spec["tests"]["rates"]["temperatures"] = ["0 degC"]
    spec["plan"]["temperatures"] = spec["plan"]["temperatures"] | {"candidates": [3, 5]}
    assert passes(spec)  # with static at 0 degC alone, which its residual table does not offer
    with pytest.raises(InputError, match="make faces at -60, -30, 30 and 60 degC too"):
        exact_plan(loaded(spec))


def test_what_only_all_tests_together_tell_is_planned_together() -> None:
    """One rest shows the sum of bias and scale factor on z; the rests of another test tell them apart."""
    found = loaded(tilts())
    (bias,) = (m for m in error_models(found.spec) if m.name == "accelerometer.bias")
    assert np.isfinite(min(bias.within.values()))  # no test alone: of the campaign
    plan = exact_plan(found)
    assert {"static", "tilts"} == {t.test for t in plan.tests} - {"rates"}
    assert unobservable_in(found.spec, visits(plan)) == ()
    widths = {r.error: r.half_width for r in plan.reasons}
    assert np.all(np.isfinite([*widths.values()]))
    assert widths["accelerometer.bias"] > 0


@pytest.mark.parametrize("repeats", [2, 5])
def test_by_hand_the_half_width_is_the_campaigns_where_no_test_has_one(repeats: int) -> None:
    """d = q(n) σ, σ of the worst axis at the worst temperature, never below the run-to-run of one test."""
    spec = tilts()
    spec["plan"]["fixed"] = by_hand(repeats, static=[-60, 0, 60], tilts=[-60, 0, 60], rates=[0])
    plan = exact_plan(loaded(spec))
    made = campaign_of(loaded(spec).spec, visits(plan))
    assert made is not None
    for error in ("bias", "scale_factor"):
        sigma = max(
            float(s)
            for axis in range(3)
            for c, s in zip(*_columns_and_sigmas(made, axis), strict=True)
            if c.effect == error
        )
        width = max(r.half_width for r in plan.reasons if r.error == f"accelerometer.{error}")
        alone = {"bias": 1e-3 * G, "scale_factor": 2e-5}[error] / np.sqrt(repeats)  # of one test's power-ons
        assert width == pytest.approx(stdtrit(repeats - 1, 0.975) * max(sigma, alone), rel=1e-6)
        assert error == "bias" or sigma > 2.0 * alone


def _columns_and_sigmas(made: Campaign, axis: int) -> tuple[tuple[Column, ...], Array]:
    channel = made.channels["accelerometer", axis]
    return channel.model.columns()[: channel.model.linear], channel.sigma()


# ---------------------------------------------------------------- the shipped ones, and the commands


@pytest.mark.parametrize("name", sorted(path.stem for path in SHIPPED.glob("*.yaml")))
def test_the_shipped_specs_can_be_calibrated(name: str) -> None:
    refuse_what_no_campaign_observes(shipped(name).spec)


@pytest.mark.parametrize("points", [((3, 2), (1, 2))])
@pytest.mark.further("points", [((5, 3), (1, 2)), ((5, 2), (1, 2))])
def test_hand_made_helicopters_that_fly_well_are_planned(points: tuple[tuple[int, int], ...]) -> None:
    """One repeat of `static` hardly knows g-sensitivity; the campaign does, even the shortest of these."""
    text = (SHIPPED / "helicopter.yaml").read_text(encoding="utf-8")
    tests = zip(("static", "rates"), points, strict=True)
    lines = [f"    {name}: {{temperatures: {t}, repeats: {n}}}" for name, (t, n) in tests]
    found = spec_from_bytes("\n".join([text.rstrip(), "  fixed:", *lines]).encode(), Path("spec.yaml"))
    refuse_what_no_campaign_observes(found.spec)
    assert [len(t.temperatures_degc) for t in exact_plan(found).tests] == [count for count, _ in points]


def test_plan_and_check_say_so_with_exit_code_2(run: Run, tmp_path: Any) -> None:
    text = (SHIPPED / "small_uav.yaml").read_text(encoding="utf-8")
    short = text.replace("motions: 6\n    power_on: 30 s\n    record: 20 s", "motions: 2\n    record: 20 s")
    assert short != text
    (tmp_path / "short.yaml").write_text(short, encoding="utf-8")
    found = run("plan", "short.yaml")
    assert found.code == 2
    assert "tests.rates: the records cannot tell gyro.scale_factor (y, z) at all" in found.err
    assert "the unit never turns about y" in found.err
    checked = run("check", "short.yaml")
    assert (checked.code, checked.out) == (2, "")
    assert _error(checked.err) == _error(found.err)
    assert run("allow", "short.yaml").code == 2


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
