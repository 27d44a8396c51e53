"""accept, forecast and recalibrate from outside: exit codes, files, words."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import numpy as np
import pytest
import yaml

from planner.dwells.dwell_files import write_dwells
from tests.documents import keeps
from tests.fleet.fleets import DEG, G, check_table
from tests.outcome import Outcome, Run
from tests.specs import small, with_limit


@pytest.fixture(name="run")
def _run_without_a_fault_of_ours(run: Run) -> Run:
    def call(*arguments: object) -> Outcome:
        done = run(*arguments)
        assert "internal error" not in done.err
        return done

    return call


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "spec.yaml"
    text = with_limit(small(recalibration={"rest": "1 min", "repeats": 6}), "9.2 m")
    path.write_text(yaml.safe_dump(text, sort_keys=False))
    return path


def table(tmp_path: Path, worst: float = 0.0) -> Path:
    rng = np.random.default_rng(3)
    gyro, acc = rng.normal(size=(5, 3)) * 0.0005 * DEG, rng.normal(size=(5, 3)) * 0.0005 * G
    acc[3, 1] += worst
    path = tmp_path / "check.csv"
    write_dwells(check_table(gyro, acc, rng), path)
    return path


def history(tmp_path: Path, weeks: int = 16, drift: float = 0.00015) -> Path:
    rng = np.random.default_rng(4)
    rows = ["unit,date,error,term,value,uncertainty"]
    for unit in ("a", "b"):
        rate = drift * rng.normal()
        for week in range(weeks):
            day = date(2026, 1, 5) + timedelta(days=7 * week)
            value = rate * week + 0.0002 * rng.normal()
            rows.append(f"{unit},{day},accelerometer.bias,x,{value:.6f} g,0.0002 g")
    path = tmp_path / "history.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def test_a_good_batch_is_accepted_with_a_report(run, spec, tmp_path):
    done = run("accept", table(tmp_path), "--spec", spec, "-o", tmp_path / "out")
    assert done.code == 0
    assert "Of 5 units: 5 accepted" in done.out
    page = (tmp_path / "out/report.html").read_text()
    assert "Of 5 units" in page
    assert "http" not in page.replace("http://www.w3.org", "")  # opens offline
    tree = json.loads((tmp_path / "out/accept.json").read_text())
    keeps(tree, "accept")
    assert tree["counts"] == {"accepted": 5, "rejected": 0, "undecided": 0}


def test_one_bad_unit_ends_with_exit_1_and_names_its_channel(run, spec, tmp_path):
    done = run("accept", table(tmp_path, 0.09 * G), "--spec", spec, "--json")
    assert done.code == 1
    keeps(done.json, "accept")
    bad = [u for u in done.json["units"] if u["verdict"] == "rejected"]
    assert [u["unit"] for u in bad] == ["u0003"]
    worst = max(bad[0]["channels"], key=lambda c: c["share_of_limit"])
    assert worst["channel"] == "accelerometer_y"
    assert worst["residual"] == pytest.approx(0.09, abs=0.003)
    assert bad[0]["binds"]["unit"] == "m"


def test_the_plan_that_is_given_is_the_one_that_counts(run, spec, tmp_path):
    assert run("plan", spec, "-o", tmp_path / "plan").code == 0
    data = table(tmp_path)
    with_plan = run("accept", data, "--spec", spec, "--plan", tmp_path / "plan", "--json").json
    without = run("accept", data, "--spec", spec, "--json").json
    # the same campaign is chosen again, so the same region
    loads = [[u["load"] for u in tree["units"]] for tree in (with_plan, without)]
    assert loads[0] == pytest.approx(loads[1], rel=1e-6)


def test_calibrations_are_judged_too(run, spec, tmp_path):
    write_dwells(
        replace(check_table(np.zeros((1, 3)), np.zeros((1, 3)), np.random.default_rng(1))), tmp_path / "c.csv"
    )
    assert run("calibrate", tmp_path / "c.csv", "--spec", spec, "-o", tmp_path / "cal").code == 0
    alone = run("accept", tmp_path / "cal", "--spec", spec, "--json")
    assert alone.code == 0
    assert "what their intervals leave" in " ".join(alone.json["notes"])
    assert all(c["residual"] == 0 for c in alone.json["units"][0]["channels"])
    as_residual = run("accept", tmp_path / "cal", "--spec", spec, "--json", "--residual")
    assert any(c["residual"] != 0 for c in as_residual.json["units"][0]["channels"])
    two = [f"{tmp_path / 'cal/calibration.json'}@{day}" for day in ("2026-01-01", "2026-03-01", "2026-05-01")]
    drift = run("forecast", *two, "--spec", spec, "--json", "--today", "2026-06-01")
    assert drift.code == 0
    assert drift.json["corrected_by"] == "last"
    for document, of in ((alone.json, "accept"), (drift.json, "forecast")):
        keeps(document, of)


def test_a_forecast_writes_report_and_calendar(run, spec, tmp_path):
    data = history(tmp_path)
    out = tmp_path / "out"
    done = run("forecast", data, "--spec", spec, "--today", "2026-06-01", "--until", "900", "-o", out)
    assert done.code == 0
    tree = json.loads((out / "forecast.json").read_text())
    keeps(tree, "forecast")
    assert {s["method"] for s in tree["validation"]} >= {"naive", "local_trend", "neural", "gaussian_process"}
    dated = [u for u in tree["units"] if u["date"] is not None]
    assert dated
    calendar = (out / "calibrations.ics").read_bytes().decode()
    for unit in dated:
        day = max(unit["date"], "2026-06-01")  # what is overdue stands on today
        assert f"DTSTART;VALUE=DATE:{day.replace('-', '')}" in calendar
    assert calendar.count("BEGIN:VEVENT") == len(dated)
    first = {f.name: f.read_bytes() for f in out.iterdir()}
    run("forecast", data, "--spec", spec, "--today", "2026-06-01", "--until", "900", "-o", out)
    assert {f.name: f.read_bytes() for f in out.iterdir()} == first  # same input, same bytes


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--method", "magic"], "known are naive"),
        (["--until", "soon"], "--until"),
        (["--confidence", "120"], "--confidence"),
        (["--today", "yesterday"], "no date"),
        (["--today", "2026-02-01"], "after today"),
        (["--start", "2026-01-01"], "this one has dates"),
        (["--corrected-by", "me"], "--corrected-by"),
    ],
)
def test_wrong_options_are_explained(run, spec, tmp_path, more, said):
    options = more if "--today" in more else ["--today", "2026-06-01", *more]
    done = run("forecast", history(tmp_path), "--spec", spec, *options)
    assert done.code == 2
    assert said in done.err


def test_files_of_several_kinds_and_missing_ones_are_refused(run, spec, tmp_path):
    mixed = run("forecast", history(tmp_path), table(tmp_path), "--spec", spec)
    assert mixed.code == 2
    assert "files of one kind" in mixed.err
    assert run("forecast", tmp_path / "nothing.csv", "--spec", spec).code == 2
    assert run("accept", tmp_path / "nothing.csv", "--spec", spec).code == 2


def test_one_point_is_an_answer_with_a_warning(run, spec, tmp_path):
    done = run("forecast", history(tmp_path, weeks=1), "--spec", spec, "--today", "2026-06-01")
    assert done.code == 0
    assert "one point tells no drift" in done.err
    assert "storage of the spec" in done.out


def test_recalibrations_are_planned_and_put_on_a_calendar(run, spec, tmp_path):
    out = tmp_path / "store"
    done = run("recalibrate", spec, "--start", "2026-12-01", "-o", out)
    assert done.code == 0
    tree = json.loads((out / "recalibration.json").read_text())
    keeps(tree, "recalibrate")
    (unit,) = tree["units"]
    assert unit["whole"]
    assert unit["visits"]
    assert max(unit["load"]["with"]) <= 1 + 1e-6
    assert (out / "recalibrations.ics").read_bytes().count(b"BEGIN:VEVENT") == len(unit["visits"])
    assert "What the store can renew" in (out / "report.html").read_text()


def test_what_the_store_cannot_carry_ends_with_exit_3_and_says_what_binds(run, spec, tmp_path):
    tight = tmp_path / "tight.yaml"
    tight.write_text(spec.read_text().replace("9.2 m", "8.1 m").replace("repeats: 6", "repeats: 1"))
    done = run("recalibrate", tight)
    assert done.code == 3
    keeps(run("recalibrate", tight, "--json").json, "recalibrate")
    assert "what takes most of the limit then" in done.err


def test_recalibration_follows_a_history(run, spec, tmp_path):
    done = run(
        "recalibrate",
        spec,
        "--history",
        history(tmp_path),
        "--today",
        "2026-06-01",
        "--until",
        "120",
        "--json",
    )
    assert done.code in (0, 3)
    assert [u["unit"] for u in done.json["units"]] == ["a", "b"]
    keeps(done.json, "recalibrate")


def test_overdue_units_come_first_everywhere(run, spec, tmp_path):
    """On a day long after its date a unit is overdue, not `due by` a day in the past."""
    data, out = history(tmp_path, drift=0.001), tmp_path / "late"
    done = run("forecast", data, "--spec", spec, "--today", "2028-11-01", "-o", out)
    assert done.code == 0
    tree = json.loads((out / "forecast.json").read_text())
    keeps(tree, "forecast")
    assert tree["today"] == "2028-11-01"
    assert tree["units"][0]["overdue"]
    assert "overdue: calibrate now" in done.out
    assert "overdue since" in done.out
    calendar = (out / "calibrations.ics").read_text()
    assert "overdue since" in calendar
    assert "DTSTART;VALUE=DATE:20281101" in calendar
    store = run("recalibrate", spec, "--history", data, "--today", "2028-11-01", "--until", "60", "--json")
    assert all(v["date"] >= "2028-11-01" for u in store.json["units"] for v in u["visits"])
    assert all(s["date"] >= "2028-11-01" for s in store.json["sessions"])
    keeps(store.json, "recalibrate")


def test_a_slip_of_the_unit_is_told_before_a_date(run, spec, tmp_path):
    path = tmp_path / "slip.csv"
    path.write_text(
        "unit,date,error,term,value\n"
        "u1,2026-01-05,accelerometer.bias,x,0.1 mg\nu1,2026-03-05,accelerometer.bias,x,100 mg\n"
    )
    done = run("forecast", path, "--spec", spec, "--today", "2026-03-06", "--json")
    assert "a slip of the unit" in done.json["suspects"][0]
    assert done.json["units"][0]["outcome"] != "passed"
    keeps(done.json, "forecast")


def test_a_semicolon_csv_gets_a_message_of_its_own(run, spec, tmp_path):
    path = tmp_path / "history.csv"
    path.write_text("unit;date;error;term;value\nu1;2026-01-05;gyro.bias;x;0,1 deg/h\n")
    done = run("forecast", path, "--spec", spec)
    assert done.code == 2
    assert "semicolons" in done.err


def test_a_check_is_planned(run, spec, tmp_path):
    done = run("accept", "--spec", spec, "--plan-check", "--load", "80", "-o", tmp_path / "check")
    assert done.code == 0
    tree = json.loads((tmp_path / "check/check_plan.json").read_text())
    keeps(tree, "check-plan")
    assert tree["checks"][0]["power_ons_per_temperature"] >= 1
    assert "power-on" in done.out


def test_a_check_that_may_stop_says_when(run, spec, tmp_path):
    done = run("accept", table(tmp_path), "--spec", spec, "--looks", "6", "--json")
    assert done.code == 0
    assert "of 6 power-ons" in " ".join(n for u in done.json["units"] for n in u["notes"])


def test_without_the_extra_auto_works_and_the_methods_of_it_say_how_to_have_them(
    run, spec, tmp_path, monkeypatch
):
    monkeypatch.setattr("planner.fleet.validation.find_spec", lambda name: None)
    refused = run("forecast", history(tmp_path), "--spec", spec, "--method", "structural", "--json")
    assert refused.code == 2
    assert [fault["code"] for fault in refused.envelope["faults"]] == ["P811"]
    assert "pip install 'planner[forecast]'" in refused.envelope["faults"][0]["remedy"]
    done = run("forecast", history(tmp_path), "--spec", spec, "--until", "200", "--json")
    assert done.code == 0
    assert "structural" not in json.dumps(done.json["methods"])
    assert "not compared, for lack of their packages: gaussian_process, neural, structural" in done.err


@pytest.mark.parametrize("command", ["accept", "forecast", "recalibrate"])
def test_a_file_that_is_none_is_told_before_a_plan_is_made(run, spec, tmp_path, monkeypatch, command):
    def planned(*arguments, **options):
        raise AssertionError("planned before the files were read")

    for room in ("acceptance", "fleet"):
        monkeypatch.setattr(f"planner.pipelines.{room}.basis_of", planned)
    names = [spec, "--history", "gone.csv"] if command == "recalibrate" else ["gone.csv", "--spec", spec]
    done = run(command, *names)
    assert done.code == 2
    assert "gone.csv" in done.err
