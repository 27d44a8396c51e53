"""Histories as people keep them: what is wrong is said with its line, what is odd is said and survived."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from planner.errors import InputError
from planner.fleet.forecast.hierarchical import Hierarchical
from planner.fleet.history import Event, History, Series, ordered
from planner.fleet.history_files import read_history
from planner.fleet.history_sources import check_days, correction_of, gathered_history, horizon, source_files
from planner.fleet.shocks import past_of, without_shocks
from planner.fleet.suspects import without_suspects
from tests.fleet.fleets import DEG, G, small_basis

HEAD = "unit,date,error,term,value,uncertainty\n"


def written(tmp_path: Path, text: str, name: str = "history.csv") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def series(values, day=None, **kind) -> Series:
    values = np.asarray(values, dtype=float)
    day = 7.0 * np.arange(len(values)) if day is None else np.asarray(day, dtype=float)
    return Series("u1", "gyro.bias", "x", "deg/s", day, values, np.full(len(values), np.nan), **kind)


# ---------------------------------------------------------------- files


def test_long_and_wide_files_say_the_same(tmp_path):
    long = written(
        tmp_path,
        "# a comment\nunit,date,error,term,value,uncertainty\n"
        "u1,2026-03-02,gyro.bias,x,7.2 deg/h,1.8 deg/h\nu1,2026-03-09,gyro.bias,x,0.003 deg/s,\n"
        "u1,2026-03-02,accelerometer.bias,z,2 mg,\n",
    )
    wide = written(
        tmp_path,
        "unit,date,gyro.bias x [deg/s],gyro.bias x +- [deg/s],accelerometer.bias z [mg]\n"
        "u1,2026-03-02,0.002,0.0005,2\nu1,2026-03-09,0.003,,\n",
        "wide.csv",
    )
    one, other = read_history(long), read_history(wide)
    assert one.start == other.start == date(2026, 3, 2)
    for a, b in zip(one.series, other.series, strict=True):
        assert (a.unit, a.error, a.term) == (b.unit, b.error, b.term)
        assert a.day == pytest.approx(b.day)
        assert a.value == pytest.approx(b.value, rel=1e-12)
        assert a.sigma == pytest.approx(b.sigma, rel=1e-12, nan_ok=True)
    gyro = next(s for s in one.series if s.error == "gyro.bias")
    assert gyro.value == pytest.approx([0.002 * DEG, 0.003 * DEG])
    assert gyro.day == pytest.approx([0.0, 7.0])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("unit,date,error,term,value\n", "holds no value"),
        ("unit,error,term,value\nu1,gyro.bias,x,1 deg/s\n", "day or date missing"),
        ("unit,day,date,error,term,value\n", "give day or date, not both"),
        ("unit,date,eror,term,value\n", "did you mean error"),
        ("unit,date,error,term,value,value\n", "more than once"),
        (HEAD + "u1,2026-13-01,gyro.bias,x,1 deg/s,\n", "not a date like 2026-03-01"),
        (HEAD + "u1,2026-03-01,gyro.bias,x,0.1,\n", "has no unit"),
        (HEAD + "u1,2026-03-01,gyro.bias,x,0.1 g,\n", "wrong unit"),
        (HEAD + "u1,2026-03-01,gyro.bais,x,0.1 deg/s,\n", "did you mean gyro.bias"),
        (HEAD + "u1,2026-03-01,gyro.bias,w,0.1 deg/s,\n", "gyro.bias has x, y, z"),
        (HEAD + "u1,2026-03-01,gyro.bias,x,nan,\n", "finite"),
        (HEAD + "u1,2026-03-01,gyro.bias,x,0.1 deg/s,-1 deg/s\n", "larger than zero"),
        (HEAD + "u1,2026-03-01,gyro.bias,x\n", "has 4 cells, the header 6"),
        (HEAD + ",2026-03-01,gyro.bias,x,0.1 deg/s,\n", "which unit is it"),
        ("unit,day,gyro.bias x [mg]\nu1,0,1\n", "wrong unit"),
        ("unit,day,error,term,value\nu1,inf,gyro.bias,x,1 deg/s\n", "not a number of days"),
    ],
)
def test_what_is_wrong_in_a_file_is_said(tmp_path, text, said):
    with pytest.raises(InputError, match=said.replace("(", r"\(")):
        read_history(written(tmp_path, text))


def test_every_fault_comes_with_its_line(tmp_path):
    text = (
        HEAD + "u1,2026-03-01,gyro.bias,x,0.1,\nu1,2026-03-08,gyro.bias,x,0.1 deg/s,\nu1,x,gyro.bias,x,1 g,\n"
    )
    with pytest.raises(InputError) as caught:
        read_history(written(tmp_path, text))
    assert [fault.line for fault in caught.value.faults] == [2, 4]


def test_a_missing_file_and_a_binary_one_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot read"):
        read_history(tmp_path / "nothing.csv")
    binary = tmp_path / "b.csv"
    binary.write_bytes(b"\xff\xfe\x00\x01unit")
    with pytest.raises(InputError, match="no CSV file"):
        read_history(binary)


def test_rows_that_stand_twice_count_once(tmp_path):
    row = "u1,2026-03-01,gyro.bias,x,0.1 deg/s,\n"
    found = read_history(written(tmp_path, HEAD + row + row))
    assert len(found.series[0]) == 1
    assert found.notes == ("1 rows stand twice; they were used once",)


# ---------------------------------------------------------------- cleaning


def clean(one: Series, storage: float = np.nan) -> tuple[Series, str]:
    sizes = {one.error: storage}
    history = without_shocks(ordered(History((one,), "drawn")), sizes)
    return history.series[0], " ".join(history.notes)


def test_doubled_days_are_averaged_and_said():
    one, said = clean(series([1.0, 2.0, 4.0, 5.0], [0, 7, 7, 14]))
    assert one.value == pytest.approx([1.0, 3.0, 5.0])
    assert "more than one value on day 7" in said


def test_days_are_put_in_order():
    one, _ = clean(series([3.0, 1.0, 2.0], [14, 0, 7]))
    assert one.value == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_jump_after_a_repair_starts_the_history_anew(seed):
    rng = np.random.default_rng(seed)
    values = np.arange(20) * 0.1 + 0.1 * rng.normal(size=20)
    values[12:] += 10.0
    one, said = clean(series(values))
    assert one.fresh == (84.0,)  # the level starts anew there, what the unit did before still tells its drift
    assert "jumps on day 84" in said


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_lone_outlier_is_set_aside(seed):
    values = 0.1 * np.random.default_rng(seed).normal(size=20)
    values[9] += 10.0
    one, said = clean(series(values))
    assert len(one) == 19
    assert "lies alone" in said


def test_a_declared_event_starts_the_history_anew():
    one, said = clean(series(np.arange(10.0), events=(Event(35.0, "repair"),)))
    assert one.day[0] == 35.0
    assert "as the file says" in said


def test_after_a_recalibration_the_level_starts_anew():
    one, _ = clean(series(np.sin(np.arange(10.0)), events=(Event(35.0, "recalibration"),)))
    assert len(one) == 10
    assert one.fresh == (35.0,)


def test_other_words_are_remarks():
    """A look at the unit is no reason to forget what it did."""
    one, said = clean(series(np.sin(np.arange(10.0)), events=(Event(35.0, "Visual inspection"),)))
    assert len(one) == 10
    assert one.fresh == ()
    assert "'Visual inspection' on day 35 is a remark" in said


def test_every_repaired_unit_is_named():
    many = tuple(
        replace(series(np.sin(np.arange(8.0) + u), events=(Event(21.0, "repair"),)), unit=f"u{u:02d}")
        for u in range(25)
    )
    notes = " ".join(ordered(History(many, "drawn")).notes)
    assert all(f"u{u:02d}: starts anew" in notes for u in range(25))


def fleet(seed: int, weeks: int = 20) -> list[Series]:
    """Twelve channels that walk by one storage in 60 days, seen through a tenth of it."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(12, weeks)) * np.sqrt(7 / 60)
    values = np.cumsum(steps, axis=1) + 0.1 * rng.normal(size=(12, weeks))
    return [replace(series(v), unit=f"u{u:02d}") for u, v in enumerate(values)]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_step_of_a_few_sigmas_is_found_among_its_fleet(seed):
    """3 storages, eight sigmas of a week: a unit alone could not tell it from a lively drift."""
    many = fleet(seed)
    value = many[4].value.copy()
    value[9:] += 3.0
    many[4] = replace(many[4], value=value)
    found = without_shocks(ordered(History(tuple(many), "drawn")), {"gyro.bias": 1.0})
    assert [s.unit for s in found.series if s.fresh] == ["u04"]
    assert [s.fresh for s in found.series if s.fresh] == [(63.0,)]
    assert sum("jumps on day 63" in n for n in found.notes) == 1


def test_the_last_value_that_lies_apart_counts_both_ways():
    many = fleet(4)
    value = many[2].value.copy()
    value[-1] += 4.0
    many[2] = replace(many[2], value=value)
    found = without_shocks(ordered(History(tuple(many), "drawn")), {"gyro.bias": 1.0})
    assert found.series[2].doubtful
    past = [past_of(s, 1.0) for s in found.series]
    made = Hierarchical().forecast(past, [np.array([7.0])] * 12)
    wide, usual = (made[i].half_width(0.95)[0] for i in (2, 3))
    assert wide > 1.5 * usual  # it may be at either level


# ---------------------------------------------------------------- values that cannot be right


def test_equal_values_with_a_stated_uncertainty_are_stuck():
    one = series([0.1] * 4)
    one = replace(one, sigma=np.full(4, 0.05))
    found = without_suspects(History((one,), "drawn"), {"gyro.bias": 1.0})
    assert "stuck" in found.suspects[0]
    assert len(found.series[0]) == 1


def test_values_that_only_round_to_the_same_are_no_suspects():
    rng = np.random.default_rng(2)
    value = np.round(0.1 * rng.normal(size=40), 1)
    one = replace(series(value), sigma=np.full(40, 0.1))
    assert without_suspects(History((one,), "drawn"), {"gyro.bias": 1.0}).suspects == ()


@pytest.mark.parametrize(("values", "wrong"), [([0.1, 100.0], 1), ([0.1, 0.12, 100.0, 0.13, 0.11], 2)])
def test_a_slip_of_the_unit_is_suspected_before_anything_else(values, wrong):
    found = without_suspects(History((series(values),), "drawn"), {"gyro.bias": 1.0})
    assert f"on day {7 * wrong}" in found.suspects[0]
    assert "1000 times" in found.suspects[0]
    assert len(found.series[0]) == len(values) - 1


def test_a_large_drift_is_no_slip():
    walk = np.cumsum(np.random.default_rng(3).normal(size=30))
    assert without_suspects(History((series(walk),), "drawn"), {"gyro.bias": 1.0}).suspects == ()


def test_plain_drifts_are_not_taken_for_jumps():
    """False alarms: next to none of 150 histories, over gaps too; thousands in benchmarks."""
    rng = np.random.default_rng(5)
    many = []
    for u in range(150):
        day = np.cumsum(rng.choice([7.0, 7.0, 7.0, 28.0], size=26))
        steps = rng.normal(size=26) * np.sqrt(np.diff(day, prepend=0.0) / 7.0) * 0.05
        values = rng.normal() * 0.05 * day / 7 + np.cumsum(steps) + 0.1 * rng.normal(size=26)
        many.append(replace(series(values, day), unit=f"u{u:03d}"))
    found = without_shocks(ordered(History(tuple(many), "drawn")), {})
    assert sum(len(s) < 26 or bool(s.fresh) for s in found.series) <= 1


def test_gaps_and_single_points_are_said():
    day = np.array([0.0, 7, 14, 21, 140, 147, 154, 161])
    values = day + np.random.default_rng(1).normal(size=8)
    assert "nothing between day 21 and day 140" in clean(series(values, day))[1]
    assert "one point tells no drift" in clean(series([1.0]))[1]
    assert "irregular" in clean(series(np.arange(6.0), [0, 7, 12, 21, 28, 33]))[1]


# ---------------------------------------------------------------- days


def dated(*days: float) -> History:
    return History((series(np.zeros(len(days)), days),), "history.csv", date(2026, 3, 2))


def test_values_from_the_future_are_refused():
    with pytest.raises(InputError, match="after today, 2026-03-10"):
        check_days(dated(0.0, 30.0), date(2026, 3, 10))
    check_days(dated(0.0, 8.0), date(2026, 3, 10))


@pytest.mark.parametrize(
    ("text", "ahead"), [(None, 365.0), ("90", 90.0), ("90 days", 90.0), ("2026-04-01", 23.0)]
)
def test_until_is_a_date_or_days(text, ahead):
    assert horizon(dated(0.0, 7.0), text) == pytest.approx(7.0 + ahead)


@pytest.mark.parametrize("text", ["soon", "-5", "0", "1e9", "2026-03-01", ""])
def test_an_until_that_is_none_is_refused(text):
    with pytest.raises(InputError, match="--until"):
        horizon(dated(0.0, 7.0), text)


def test_calibrations_correct_each_other_and_other_values_are_residuals():
    assert correction_of("auto", History((), "calibrations")) == "last"
    assert correction_of("auto", dated(0.0)) == "none"
    with pytest.raises(InputError, match="--corrected-by"):
        correction_of("twice", dated(0.0))


# ---------------------------------------------------------------- dwell tables


def test_dwell_tables_with_days_are_a_history():

    from tests.fleet.fleets import check_table

    rng = np.random.default_rng(3)
    basis = small_basis()
    tables = []
    for week in range(5):
        gyro = np.full((1, 3), 0.001 * week * DEG)
        one = check_table(gyro, np.zeros((1, 3)), rng, temperatures=(20.0,), power_ons=8)
        tables.append(replace(one, day=one.day + 7.0 * week, run=one.run + 8 * week, source=f"w{week}.csv"))
    names = [str(i) for i in range(5)]

    def read(path: Path):
        return tables[int(path.name)]

    import os

    here = os.getcwd()
    try:
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            for name in names:
                Path(name).write_text("unit,run,day,duration_s,gyro_x_dps\n")
            found = gathered_history(source_files(names, read), basis.models, basis.region, date(2026, 1, 5))
    finally:
        os.chdir(here)
    assert found.start == date(2026, 1, 5)
    x = next(s for s in found.series if (s.error, s.term) == ("gyro.bias", "x"))
    assert x.day == pytest.approx(7.0 * np.arange(5))
    # run-to-run 0.002 deg/s and in-run 0.001 deg/s over eight power-ons
    assert np.all(np.abs(x.value - 0.001 * np.arange(5) * DEG) < 4 * x.sigma)
    assert x.sigma == pytest.approx(np.full(5, np.hypot(0.002, 0.001) * DEG / np.sqrt(8)), rel=0.1)
    z = next(s for s in found.series if (s.error, s.term) == ("accelerometer.bias", "z"))
    assert np.all(np.abs(z.value) < 0.002 * G)
