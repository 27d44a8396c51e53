"""What the page and the terminal say of a diagnosis: no digit too few or too many, nothing claimed twice."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.export.diagnosis_json import diagnosis_document, diagnosis_text, read_diagnosis
from planner.nouns.diagnosis import (
    Diagnosis,
    Evidence,
    FoundEffect,
    FoundTerm,
    NavigationCost,
    NotFound,
    ResidualChange,
    Split,
    UnitDiagnosis,
    Unknown,
    Untestable,
)
from planner.report.charts import residuals
from planner.report.subjects import diagnosis_words as words
from planner.report.subjects.diagnosis import verdict
from tests.calibrate.world import Layout, campaign

NOTHING = UnitDiagnosis("u1", "clean", (), (), (), (), (), ())


def found(value: float, half: float, p: float = 1e-40, unit: str = "deg/s/K") -> FoundEffect:
    term = FoundTerm("x", "gyro_x", value, value - half, value + half, 60.0, unit)
    return FoundEffect("bias_temperature", "gyro", ("gyro_x",), (term,), p, 20.0)


def diagnosis(unit: UnitDiagnosis = NOTHING, residual: tuple[ResidualChange, ...] = ()) -> Diagnosis:
    return Diagnosis(unit, residual, (), (), "1", "spec", "0" * 64, "1" * 64, "data.csv", 1)


def change(channel: str, split: Split) -> ResidualChange:
    return ResidualChange(
        channel,
        "deg/s",
        *(2e-5, 1e-5, 3e-5) * 2,
        1e-5,
        1e-5,
        1e-5,
        20,
        4,
        split != "none",
        "how",
        split=split,
    )


def plain(text: str) -> str:
    return text.replace("\u202f", " ")


def test_both_ends_of_a_narrow_interval_differ_from_the_value() -> None:
    """0.0574 … 0.0574 would hide that the coefficient is known to 3e-5 of itself."""
    table = words.found_table([found(math.radians(0.05738), math.radians(2e-6))])
    assert table is not None
    value, interval = table.rows[0][3:5]
    assert (value, interval) == ("0.05738", "0.057378 … 0.057382")


def test_a_chance_below_what_the_flips_can_tell_is_not_a_number() -> None:
    assert plain(words.chance(1e-120)) == "< 0.001"
    assert words.chance(0.004) == "0.004"
    assert plain(words.compared(0.004)) == "= 0.004"


def test_a_part_without_a_name_on_several_channels_is_told_once() -> None:
    unknown = tuple(Unknown((f"gyro_{a}",), "time_on", 0.001, 9.0) for a in "xyz")
    text = words.sentence(replace(NOTHING, verdict="unexplained", unknown=unknown))
    assert text.count("time since power-on") == 1
    assert "(gyro_x, gyro_y, gyro_z)" in text


@pytest.mark.parametrize(("seen", "unseen", "modest"), [(2, 5, True), (5, 2, False)])
def test_nothing_is_missing_only_as_far_as_it_was_looked_for(seen: int, unseen: int, modest: bool) -> None:
    unit = replace(
        NOTHING,
        not_found=tuple(NotFound(f"effect_{i}", "gyro", 1.0, "deg/s") for i in range(seen)),
        untestable=tuple(Untestable(f"other_{i}", "gyro", "why") for i in range(unseen)),
    )
    assert words.headline(unit).startswith("Nothing is missing")
    assert ("as far as these data can tell" in words.headline(unit)) == modest
    assert f"{seen} undeclared effects" in words.sentence(unit)
    assert "only the gyros could be judged" in words.sentence(unit)
    assert f"{unseen} effects cannot be seen" in words.sentence(unit)


def test_all_channels_of_a_sensor_are_told_by_its_name() -> None:
    terms = (FoundTerm("face", "all", 1e-6, 0.0, 2e-6, 60.0, "deg/g"),)
    effects = [
        FoundEffect("arm_bending", s, (f"{s}_x",), terms, 0.001, 9.0) for s in ("gyro", "accelerometer")
    ]
    table = words.found_table(effects)
    assert table is not None
    assert [row[1] for row in table.rows] == ["all gyros", "all accelerometers"]


@pytest.mark.parametrize(
    ("split", "said"),
    [
        ("runs", "on power-ons that the fit has not seen"),
        ("branches", "on branches of the temperature"),
        ("blocks", "on blocks of time left out of the fit, which flatters"),
        ("none", "on the rows that were fitted"),
    ],
)
def test_it_says_plainly_what_was_held_out(split: Split, said: str) -> None:
    table = words.residual_table(diagnosis(residual=(change("gyro_x", split), change("gyro_y", split))))
    assert table is not None
    assert said in table.caption
    assert (
        diagnosis_document(diagnosis(residual=(change("gyro_x", split),)))["residual"]["gyro_x"][
            "held_out_by"
        ]
        == split
    )


def test_the_headline_counts_what_the_declared_calibration_has_taken_up_wrongly() -> None:
    """A flight at 20 °C excites no effect of temperature; what others have taken up of it does fly."""
    flown = NavigationCost("position", "m", 1e-13, 0.0, 0.95, "how", as_calibrated=16.7, limit=1000.0)
    assert plain(verdict(flown).text) == (
        "position: 16.7 m as the declared calibration leaves it, 0 m once it is compensated"
    )
    flown = replace(flown, before=20.0, after=1.0)
    assert "20 m if nobody compensates it" in plain(verdict(flown).text)


def test_the_day_of_a_step_is_in_days_wherever_it_stands(tmp_path) -> None:
    day = FoundTerm("day", "gyro_x", 9.05, 5.0, 30.0, math.inf, "d", True)
    size = FoundTerm("x", "gyro_x", 1e-4, 0.5e-4, 1.5e-4, 60.0, "deg/s")
    effect = FoundEffect("bias_step", "gyro", ("gyro_x",), (size, day), 0.001, 20.0, nonlinear={"day": 9.05})
    whole = diagnosis(replace(NOTHING, verdict="explained", effects=(effect,)))
    (written,) = [t for t in diagnosis_document(whole)["effects"][0]["terms"] if t["nonlinear"]]
    assert (written["value"], written["ci95"], written["unit"]) == (9.05, [5.0, 30.0], "d")
    (tmp_path / "diagnosis.json").write_text(diagnosis_text(whole), encoding="utf-8")
    (read,) = [t for t in read_diagnosis(tmp_path).found.effects[0].terms if t.parameter]
    assert (read.value, read.low, read.high) == (9.05, 5.0, 30.0)
    table = words.found_table([effect])
    assert table is not None
    assert table.rows[1][3:6] == ("9.05", "5 … 30", "d")


@pytest.mark.parametrize(
    "variable", ["temperature", "temperature_rate", "time_on", "day", "rate", "specific_force"]
)
def test_what_has_no_name_is_drawn_against_its_variable(variable: str) -> None:
    table = campaign(1, layout=Layout(temperatures=(20.0, 60.0), static_repeats=1, rate_temperatures=(20.0,)))
    rest = np.random.default_rng(1).normal(size=len(table))
    evidence = Evidence("gyro_y", rest, rest, np.ones(len(table)), {}, np.empty((0, len(table))))
    picture = residuals.unnamed_picture(variable, ["gyro_y"], [evidence], table)
    assert picture is not None
    assert "gyro_y" in picture.svg
    assert residuals.unnamed_picture(variable, ["gyro_x"], [evidence], table) is None


def test_rates_that_are_set_are_told_apart_and_swept_times_are_pooled() -> None:
    """Ten rates from 10 to 500 deg/s keep a mean each: pooled by number, rests would swallow them."""
    rate = np.repeat([-500.0, -300.0, -100.0, -50.0, -10.0, 0.0, 10.0, 50.0, 100.0, 300.0, 500.0], 5)
    x, mean = residuals.binned(rate + 0.002 * np.arange(len(rate)), np.arange(len(rate), dtype=float))
    assert len(x) == len(mean) == 11
    swept = np.linspace(0.0, 1000.0, 500)
    assert len(residuals.binned(swept, swept)[0]) == residuals.BINS


def test_one_picture_draws_what_each_channel_follows_most_and_the_table_holds_every_variable() -> None:
    """A residual that goes with the day: the day is drawn first, its mean is far off before, not after."""
    layout = Layout(
        temperatures=(20.0, 60.0), static_repeats=2, rate_temperatures=(20.0,), later=(30.0, 60.0)
    )
    table = campaign(1, layout=layout)
    rest = np.random.default_rng(2).normal(size=len(table))
    ages = 3.0 * (table.day > 20.0) + rest
    sigma = np.ones(len(table))
    alone = np.empty((0, len(table)))
    evidence = [
        Evidence("gyro_x", ages, rest, sigma, {}, alone),
        Evidence("acc_z", rest, rest, sigma, {}, alone),
    ]
    assert residuals.most_telling(evidence[0], table)[0].name == "day"
    picture = residuals.residual_picture(evidence, table, ["gyro_x"])
    assert picture is not None
    assert picture.alt.startswith("Residual of gyro_x against day")
    assert picture.svg.count("<svg") == 1
    told = residuals.residual_table(evidence, table, ["gyro_x"])
    assert told is not None
    rows = {row[0]: row for row in told.rows}
    assert {v.name for v in residuals.variables_of("gyro_x", table)} <= set(rows)
    before, after = (float(x) for x in str(rows["day"][1]).split(" → "))
    assert before > 10.0
    assert after < 4.0
    assert "→" not in str(rows["day"][2])  # nothing was found on acc_z: one figure


def test_means_stray_by_no_more_than_power_ons_that_have_levels_of_their_own() -> None:
    """Levels of 20 sigma of a row, over days and temperatures: of rows by themselves they would be 50."""
    table = campaign(1, layout=Layout(temperatures=(20.0, 60.0), static_repeats=3, rate_temperatures=(20.0,)))
    rng, (runs, run) = np.random.default_rng(4), np.unique(table.run, return_inverse=True)
    rest = rng.normal(size=len(table)) + 20.0 * rng.normal(size=len(runs))[run]
    shared, sigma = np.full((1, len(table)), 20.0), np.full(len(table), np.sqrt(401.0))
    known = Evidence("acc_x", rest, rest, sigma, {}, shared)
    told = residuals.residual_table([known], table, [])
    alone = residuals.residual_table(
        [replace(known, expected=np.ones(len(table)), shared=0.0 * shared)], table, []
    )
    assert told is not None
    assert alone is not None
    furthest, by_rows = ({row[0]: float(row[1]) for row in t.rows} for t in (told, alone))
    assert max(furthest.values()) < 4.0
    assert min(furthest["day"], furthest["temperature"]) > 0.1
    assert by_rows["day"] > 20.0
