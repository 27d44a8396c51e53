"""A plan's records laid over a recording: steps, references by the motions, and what the plan cannot tell."""

from __future__ import annotations

import json

import numpy as np
import pytest

from planner.errors import InputError
from planner.physics.earth import EARTH_RATE_RADPS
from planner.recordings.plan_records import records_of
from planner.recordings.plan_references import references_of
from planner.units import STANDARD_GRAVITY_MPS2 as G
from tests.export.samples import bench
from tests.outcome import Run
from tests.recordings.recordings import save


def step(number: int, start: float, motion: dict[str, float], bench: str = "table") -> dict[str, object]:
    return {
        "id": f"{bench}/20/static/r01/m{number}",
        "bench": bench,
        "action": "record",
        "start_s": start,
        "end_s": start + 10.0,
        "test": "static",
        "temperature_degc": 20.0,
        "repeat": 1,
        "motion": motion,
        "units": 1,
    }


def plan(*steps: dict[str, object], arm: float | None = None) -> dict[str, object]:
    benches = {"table": bench(chamber=None), "arm": bench(kind="centrifuge", axes=1, arm_m=arm)}
    names = ("spec", "requirements", "allowances", "tests", "time_s", "bound_s", "gap")
    return {"planner": "1", "steps": list(steps), "benches": benches} | dict.fromkeys(names, 0)


FLAT = step(1, 5.0, {"position_1_deg": 0.0, "position_2_deg": 0.0})
TURNING = step(2, 25.0, {"rate_1_dps": 50.0})


def test_records_come_in_order_of_time():
    found = records_of(plan(FLAT, TURNING))
    assert [record.step for record in found] == [FLAT["id"], TURNING["id"]]
    assert (found[0].start, found[0].end) == (5.0, 15.0)
    with pytest.raises(InputError, match=f"{FLAT['id']}.start_s: 5 s, before the step .* 25 s"):
        records_of(plan(TURNING, FLAT))


def test_references_at_zero_and_about_the_vertical():
    latitude = np.radians(50.0)
    found = references_of(plan(FLAT, TURNING), latitude)
    earth = EARTH_RATE_RADPS * np.array([np.cos(latitude), 0.0, np.sin(latitude)])
    np.testing.assert_allclose(found[FLAT["id"]], [*earth, 0, 0, G], atol=1e-12)
    up = earth[2] + np.radians(50.0)
    # 500° in 10 s: Earth's horizontal part goes round and leaves at most its size
    assert found[TURNING["id"]][2] == pytest.approx(up, abs=1e-12)
    assert np.abs(found[TURNING["id"]][:2]).max() < EARTH_RATE_RADPS


def test_a_centrifuge_without_its_arm_has_no_reference():
    load = step(3, 50.0, {"acceleration_g": 10.0}, bench="arm")
    assert references_of(plan(FLAT, load), 0.5).keys() == {FLAT["id"]}
    told = references_of(plan(load, arm=2.0), 0.0)[load["id"]]
    assert told[2] == pytest.approx(np.sqrt(10 * G / 2.0), rel=1e-6)  # ω² R = a


def test_a_plan_without_benches_is_refused():
    with pytest.raises(InputError, match="benches"):
        references_of({"steps": []}, 0.5)


def recording(rate_z: float = 50.0) -> np.ndarray:
    rng = np.random.default_rng(1)
    time = np.arange(8000) / 200
    gyro = np.column_stack([0 * time, 0 * time, np.where((time > 20) & (time < 38), rate_z, 0.0)])
    gyro += 0.05 * rng.normal(size=gyro.shape)
    acc = np.array([0, 0, 1]) + 0.002 * rng.normal(size=gyro.shape)
    return np.column_stack([time, gyro, acc, np.full(8000, 20.0)])


def test_the_command_names_steps_and_takes_references(tmp_path, run: Run):
    save(tmp_path / "a.csv", recording())
    (tmp_path / "plan.json").write_text(json.dumps(plan(FLAT, TURNING)))
    outcome = run("reduce", "a.csv", "--plan", "plan.json", "--latitude", "50", "-o", "data.csv", "--json")
    assert outcome.code == 0, outcome.err
    assert [row["step"] for row in outcome.json["rows"]] == [FLAT["id"], TURNING["id"]]
    header = (tmp_path / "data.csv").read_text().splitlines()
    names = next(line for line in header if not line.startswith("#")).split(",")
    row = header[-1].split(",")
    assert float(row[names.index("ref_rate_z_dps")]) == pytest.approx(50.0032, abs=1e-4)
    assert float(row[names.index("ref_acc_z_g")]) == pytest.approx(1.0)


def test_a_table_that_turned_the_other_way_is_refused(tmp_path, run: Run):
    save(tmp_path / "a.csv", recording(-50.0))
    (tmp_path / "plan.json").write_text(json.dumps(plan(FLAT, TURNING)))
    outcome = run("reduce", "a.csv", "--plan", "plan.json", "--latitude", "50", "-o", "data.csv")
    assert outcome.code == 2
    assert "sign turned" in outcome.err


def test_without_latitude_there_are_no_references(tmp_path, run: Run):
    save(tmp_path / "a.csv", recording())
    (tmp_path / "plan.json").write_text(json.dumps(plan(FLAT, TURNING)))
    outcome = run("reduce", "a.csv", "--plan", "plan.json", "-o", "data.csv", "--json")
    assert outcome.code == 0, outcome.err
    assert "ref_rate" not in (tmp_path / "data.csv").read_text()
    assert any("--latitude" in note for note in outcome.json["notes"])
