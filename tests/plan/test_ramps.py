"""Records made while the chamber moves: from the spec through plan, recount, scripts, a run, to readings."""

from __future__ import annotations

import copy
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.bench_run.errors import BenchFault
from planner.bench_run.job import job_from
from planner.bench_run.simulator.chamber import Chamber
from planner.catalog import exports
from planner.diagnose.update.bench_runs import run_of_test
from planner.dwells.dwell_files import read_dwells
from planner.errors import InputError
from planner.export.documents import read_sealed_plan
from planner.export.formats.csv import document_steps_text
from planner.export.json import document_text
from planner.plan.costs import repeat_time
from planner.protocols import ExportOptions
from planner.verify.recount import recount
from planner.verify.recount_steps import check_steps
from tests.bench_run.memory_line import VirtualClock
from tests.bench_run.rig import Rig
from tests.export import grammar
from tests.outcome import Run
from tests.recordings.recordings import save
from tests.specs import loaded, small
from tests.verify.plans import Planned, planned_from, sealed_again

RAMP, LEAD, RECORD = 1.5, 90.0, 120.0  # K/min, s, s
HALF_K = RAMP / 60.0 * (LEAD + RECORD / 2.0)


def spec(**ramps: Any) -> dict[str, Any]:
    """Faces in a soaked chamber and ramps through the same temperatures; a minute's flight."""
    made = copy.deepcopy(small())
    made["unit"]["gyro"]["temperature_rate"] = {"systematic": "0.01 deg/s/(K/min)"}
    made["unit"]["accelerometer"]["temperature_rate"] = {"systematic": "0.01 g/(K/min)"}
    fixed = {"temperatures": ["-20 degC", "40 degC"], "repeats": 2}
    table = made["benches"]["rate_table"] | {"axes": 2, "move": "5 s"}
    static = {"bench": "rate_table", "calibrates": ["gyro.bias", "accelerometer.bias"], "motions": 2}
    moving = {
        "bench": "rate_table",
        "calibrates": ["gyro.temperature_rate", "accelerometer.temperature_rate"],
        "motions": 2,
        "record": f"{RECORD} s",
        "gap": "20 s",
        "power_on": "30 s",
        "cool_down": "4 min",
        "temperature": {"ramp": f"{RAMP} K/min", "lead": f"{LEAD} s"},
    }
    return made | {
        "requirement": [{"error": "position", "limit": "1000 km", "rule": "rss"}],
        "trajectory": {"name": "level", "duration": "30 s", "sampling_rate": "10 Hz"},
        "sensitivities": "simulated",
        "effects": ["bias", "bias_temperature", "temperature_rate"],
        "benches": {"rate_table": table},
        # the ramps stand first in the spec: they come behind the soaked test all the same
        "tests": {"ramps": moving | ramps, "static": static | {"record": "60 s", "cool_down": "1 min"}},
        "plan": {
            "temperatures": {"range": ["-60 degC", "60 degC"]},
            "fixed": {"ramps": fixed, "static": fixed},
        },
    }


@cache
def made() -> Planned:
    return planned_from(spec())


def document() -> dict[str, Any]:
    return made().document


def air(document: dict[str, Any]) -> list[tuple[float, float]]:
    """(s, degC) of the chamber by hand: where each step leaves it, and evenly between where it has a rate."""
    knots, now = [(0.0, 20.0)], 20.0
    for step in document["steps"]:
        rate, t = step.get("temperature_rate_degc_min"), step["temperature_degc"]
        length = step["end_s"] - step["start_s"]
        if rate is None:
            end = now if t is None else t
            assert length > 0 or end == pytest.approx(now)
        else:
            end = now + rate / 60.0 * length
            assert t == pytest.approx((now + end) / 2.0 if step["action"] == "record" else end)
        if step["action"] not in ("ramp", "record", "soak"):
            assert end == pytest.approx(now), step["id"]  # nothing else moves the chamber
        knots.append((step["end_s"], end))
        now = end
    return knots


def moving(document: dict[str, Any]) -> list[dict[str, Any]]:
    return [s for s in document["steps"] if s["action"] == "record" and s["test"] == "ramps"]


def test_every_motion_is_recorded_up_and_down_through_the_temperature() -> None:
    knots = air(document())
    records = moving(document())
    assert len(records) == 2 * 2 * 2 * 2  # temperatures, repeats, motions, ways
    assert [r["temperature_rate_degc_min"] for r in records] == [RAMP, -RAMP] * 8
    for up, down in zip(records[::2], records[1::2], strict=True):
        assert up["motion"] == down["motion"]
    for r in records:
        before = np.interp(
            [r["start_s"] - LEAD, r["start_s"], r["end_s"], r["end_s"] + LEAD], *np.transpose(knots)
        )
        way = np.sign(r["temperature_rate_degc_min"])
        at = r["temperature_degc"] + way * np.array([-HALF_K, -RAMP, RAMP, HALF_K])  # 120 s are 2 · 1.5 K
        np.testing.assert_allclose(before, at, atol=1e-6)


def test_soaked_tests_come_before_ramps_and_the_times_add_up() -> None:
    steps = [s for s in document()["steps"] if s["test"]]
    names = [s["test"] for s in steps if s["temperature_degc"] is not None]
    assert names == ["static"] * names.index("ramps") + names[names.index("ramps") :]
    ramps = next(t for t in document()["tests"] if t["test"] == "ramps")
    each = 30 + 4 * (5 + LEAD + RECORD + LEAD + 20) + 240  # power-on, four records, cool-down
    aside = HALF_K / 2.0 * 60 + HALF_K / 4.0 * 60  # cooling 2, heating 4 K/min
    assert ramps["time_s"] == pytest.approx(2 * 2 * (each + aside))
    assert ramps["power_on_s"] == pytest.approx(2 * 2 * (each - 240 - 20))


def test_the_diagnosis_knows_what_a_test_on_a_ramp_tells() -> None:
    spec_of = made().loaded.spec
    run, records = run_of_test(spec_of, "ramps"), moving(document())[:4]
    assert run.repeat_s == pytest.approx(repeat_time(spec_of, spec_of.tests["ramps"]))
    rates = [r["temperature_rate_degc_min"] for r in records]
    np.testing.assert_allclose(run.conditions.temperature_rate * 60.0, rates)
    apart = np.diff([r["start_s"] for r in records])
    np.testing.assert_allclose(np.diff(run.conditions.time_on), apart)


def test_the_recount_agrees_and_finds_what_is_changed() -> None:
    assert recount(document(), made().loaded, made().trajectory).faults == ()
    places = [i for i, s in enumerate(document()["steps"]) if s.get("temperature_rate_degc_min")]
    for key, value in (("temperature_rate_degc_min", 1.0), ("temperature_degc", 3.0), ("end_s", 9e5)):
        edited = copy.deepcopy(document())
        edited["steps"][places[3]][key] = value
        assert any(f.faults for f in check_steps(sealed_again(edited), made().loaded.spec)), key


def test_scripts_lead_the_air_along_the_ramps(tmp_path: Path) -> None:
    """The simulated chamber's air, behind its setpoints by its settling of 20 s, is where the plan has it."""
    text = exports()["chamber"].files(document(), ExportOptions("host")).files["rate_table.chamber.txt"]
    clock = VirtualClock()
    chamber = Chamber(clock, settling_s=20.0)
    for line, ms in grammar.chamber(str(text)):
        assert not chamber.receive(line).startswith("NA")
        clock.sleep(ms / 1000)
    start = document()["steps"][0]["start_s"]
    for r in moving(document()):
        begin, middle, end = (
            chamber.at(t - start) for t in (r["start_s"], (r["start_s"] + r["end_s"]) / 2, r["end_s"])
        )
        assert middle == pytest.approx(r["temperature_degc"], abs=1.0)
        assert (end - begin) / RECORD * 60.0 == pytest.approx(r["temperature_rate_degc_min"], abs=0.15)


def test_every_format_has_the_ramps() -> None:
    assert "temperature_rate_degc_min" in document_steps_text(document()).splitlines()[0]
    for name in ("acutrol", "ics", "json", "csv", "chamber"):
        assert exports()[name].files(document(), ExportOptions()).files


def test_a_run_makes_the_ramps_and_goes_on_after_a_stop_in_one(tmp_path: Path) -> None:
    job = job_from(document())
    rig = Rig(axes=2)
    rig.run(job, tmp_path / "whole.jsonl")
    _as_planned(rig, job)
    stopped = Rig(axes=2)
    third = [s.id for s in job.steps if s.action == "record" and s.test == "ramps"][2]

    def stop(step: Any) -> None:
        if step.id == third:
            raise BenchFault("somebody pulled the plug")

    with pytest.raises(BenchFault, match="plug"):
        stopped.run(job, tmp_path / "half.jsonl", before=stop)
    stopped.clock.sleep(3600.0)
    stopped.run(job, tmp_path / "half.jsonl", resume=True)
    _as_planned(stopped, job)


def _as_planned(rig: Rig, job: Any) -> None:
    steps = {s.id: s for s in job.steps}
    ramped = [
        (steps[name], start, end) for name, start, end, _ in rig.recorder.made if steps[name].swept_degc
    ]
    assert len(ramped) == 16
    for step, start, end in ramped:
        assert end - start == pytest.approx(RECORD, abs=1.0)
        rate = (rig.chamber.at(end) - rig.chamber.at(start)) / (end - start) * 60.0
        assert rate == pytest.approx(step.temperature_rate_degc_min, abs=0.15)
        assert rig.chamber.at((start + end) / 2.0) == pytest.approx(step.temperature_degc, abs=1.0)


def test_a_chamber_that_does_not_follow_is_a_fault(tmp_path: Path) -> None:
    job, rig = job_from(document()), Rig(axes=2)
    rig.chamber._rates = (0.2 / 60.0, 0.2 / 60.0)  # cold fluid has run out
    with pytest.raises(BenchFault, match=r"does not follow its ramp|not settled"):
        rig.run(job, tmp_path / "run.jsonl")


def test_what_a_campaign_with_ramps_measures_is_found_by_calibrate(tmp_path: Path, run: Run) -> None:
    """simulate draws k dT/dt of both signs; calibrate finds it, and no soaked record tells it."""
    import yaml

    (tmp_path / "spec.yaml").write_text(yaml.safe_dump(spec(), sort_keys=False))
    (tmp_path / "plan.json").write_text(document_text(document()))
    assert read_sealed_plan(tmp_path / "plan.json")["steps"]
    assert run("simulate", "spec.yaml", "--plan", "plan.json", "--seed", "3", "-o", "data.csv").code == 0
    table = read_dwells(tmp_path / "data.csv")
    rates = table.temperature_rate * 60.0  # a chamber strays by a hundredth of K/min
    assert np.sum(np.abs(rates - RAMP) < 0.1) == np.sum(np.abs(rates + RAMP) < 0.1) == 8
    assert np.sum(np.abs(rates) < 0.1) == len(table) - 16
    assert run("calibrate", "data.csv", "--spec", "spec.yaml", "-o", "found").code == 0
    found = json.loads((tmp_path / "found/calibration.json").read_text())
    truth = json.loads((tmp_path / "truth.json").read_text())
    known = {(t["error"], t["term"]): t["value"] for t in truth["terms"]}
    for sensor in ("gyro", "accelerometer"):
        mine = [
            c for c in found["sensors"][sensor]["coefficients"] if c["error"].endswith("temperature_rate")
        ]
        assert len(mine) == 3
        for c in mine:
            off = c["value"] - known[c["error"], c["term"]]
            assert abs(off) < 4.0 * c["standard_error"]
            assert c["status"] == "determined"


def test_reduce_keeps_the_rate_of_a_record_on_a_ramp(tmp_path: Path, run: Run) -> None:
    """Samples labelled by step: each record comes out at its temperature, with its rate."""
    records = moving(document())[:4]
    knots = np.transpose(air(document()))
    rows, labels = [], []
    for r in records:
        time = np.arange(r["start_s"] - LEAD, r["end_s"] + LEAD, 0.1)
        rows.append(np.column_stack([time, np.zeros((len(time), 6)), np.interp(time, *knots)]))
        labels += [r["id"] if r["start_s"] <= t < r["end_s"] else "" for t in time]
    values = np.vstack(rows) + 1e-3 * np.random.default_rng(1).normal(size=(len(labels), 8)) * ([0] + [1] * 7)
    values[:, 6] += 1.0
    save(tmp_path / "raw.csv", values, fmt="%.9g")
    lines = (tmp_path / "raw.csv").read_text().splitlines()
    labelled = [f"{lines[0]},step", *(f"{a},{b}" for a, b in zip(lines[1:], labels, strict=True))]
    (tmp_path / "raw.csv").write_text("\n".join(labelled) + "\n")
    (tmp_path / "map.yaml").write_text(
        "time: {column: time_s, unit: s}\n"
        "gyro: {x: gyro_x_dps, y: gyro_y_dps, z: gyro_z_dps, unit: deg/s}\n"
        "acc: {x: acc_x_g, y: acc_y_g, z: acc_z_g, unit: g}\n"
        "temperature: {column: temp_degc, unit: degC}\nstep: step\nrecords: step\n"
    )
    outcome = run("reduce", "raw.csv", "--columns", "map.yaml", "-o", "data.csv")
    assert outcome.code == 0, outcome.err
    table = read_dwells(tmp_path / "data.csv")
    by_step = {r["id"]: r for r in records}
    found = [by_step[s] for s in table.step if s in by_step]
    assert len(found) == 4
    wanted = np.array([[r["temperature_degc"], r["temperature_rate_degc_min"]] for r in found])
    mine = np.isin(table.step, list(by_step))
    np.testing.assert_allclose(table.temperature_degc[mine], wanted[:, 0], atol=0.05)
    np.testing.assert_allclose(table.temperature_rate[mine] * 60.0, wanted[:, 1], atol=0.05)


def with_chamber(**changes: Any) -> dict[str, Any]:
    found = spec()
    table = found["benches"]["rate_table"]
    return found | {"benches": {"rate_table": table | {"chamber": table["chamber"] | changes}}}


@pytest.mark.parametrize(
    ("document", "code", "said"),
    [
        (
            spec(temperature={"ramp": "3 K/min"}),
            "P424",
            "3 K/min is faster than the chamber of 'rate_table', cooling 2",
        ),
        (with_chamber(range=["-22 degC", "42 degC"]), "P424", "outside the chamber"),
        (with_chamber(heating=None), "P424", "'heating'"),
        (
            spec() | {"requirement": [{"error": "position", "limit": "1 km", "rule": "worst_case"}]},
            "P425",
            "published",
        ),
        (spec() | {"plan": spec()["plan"] | {"overlap": ["cool_down"]}}, "P425", "overlap"),
        (spec() | {"effects": [*spec()["effects"], "thermal_lag"]}, "P425", "thermal_lag"),
        (spec(temperature="ramp"), "P1", "must be soak, or {ramp: 1 K/min}"),
        (spec(temperature={"ramp": "1 K"}), "P1", "K/min"),
    ],
)
def test_what_cannot_be_ramped_is_refused(document: dict[str, Any], code: str, said: str) -> None:
    if document["benches"]["rate_table"]["chamber"].get("heating", 1) is None:
        del document["benches"]["rate_table"]["chamber"]["heating"]
    with pytest.raises(InputError) as refused:
        loaded(document)
    faults = [f for f in refused.value.faults if f.code.startswith(code) and said in f.message]
    assert faults, refused.value.faults
