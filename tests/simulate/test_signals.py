"""Signals from power-on: the campaign closes on them, and what disturbs them is found again (K 3.2)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation

import planner
from planner.campaign.design import Design, design
from planner.errors import InputError
from planner.export.json import plan_document
from planner.nouns.conditions import Swinging
from planner.nouns.plan_file import steps_of
from planner.physics.earth import EARTH_RATE_RADPS
from planner.pipelines.planning import exact_plan
from planner.plan.spec_to_trajectory import trajectory_of
from planner.readers.packets import READER
from planner.recordings.coloured_noise import noise_of_samples
from planner.simulate.campaign import Settings, prepared, simulate
from planner.simulate.hidden import hidden_effect
from planner.simulate.motions import exposed, records_of
from planner.simulate.processes import coloured
from planner.simulate.signals import Disturbed, campaign_signals, recorded
from planner.units import unit_factor
from tests.documents import keeps
from tests.outcome import Run
from tests.plan.test_ramps import RAMP, document
from tests.plan.test_ramps import spec as ramps
from tests.readers.streams import checksum
from tests.specs import loaded

RATE, SIGMA, TIME = 100.0, 0.01, 0.5  # Hz; deg/s and s of the coloured noise

RUN_TO_RUN = {  # display units
    "gyro.bias": 0.002,
    "gyro.scale_factor": 3e-5,
    "accelerometer.bias": 3e-4,
    "accelerometer.scale_factor": 3e-5,
}


def spec(**changes: object) -> dict[str, Any]:
    """Six positions and six turns at room temperature, two power-ons each."""

    def unit(bias: dict[str, str]) -> dict[str, Any]:
        return {
            "bias": bias,
            "scale_factor": {"systematic": "0.5 %", "run_to_run": "0.003 %"},
            "misalignment": {"systematic": "0.3 deg"},
        }

    test = {"bench": "rate_table", "motions": 6, "power_on": "10 s", "temperatures": "room"}
    return {
        "planner": 1,
        "name": "signals",
        "requirement": [{"error": "position", "limit": "50 km", "rule": {"percentile": "95 %"}}],
        "trajectory": {"name": "level", "duration": "20 s"},
        "unit": {
            "noise": {"gyro": "0.003 deg/s/sqrt(Hz)", "accelerometer": "0.1 mg/sqrt(Hz)"},
            "gyro": unit({"systematic": "0.3 deg/s", "run_to_run": "0.002 deg/s", "in_run": "0.0002 deg/s"}),
            "accelerometer": unit({"systematic": "20 mg", "run_to_run": "0.3 mg"}),
        },
        "effects": ["bias", "scale_factor", "misalignment"],
        "benches": {"rate_table": {"axes": 2, "move": "3 s", "limits": {"rate": "600 deg/s"}}},
        "tests": {
            "static": test | {"record": "40 s", "calibrates": ["gyro.bias", "accelerometer.bias"]},
            "rates": test | {"record": "10 s", "calibrates": ["gyro.scale_factor"]},
        },
        "plan": {
            "method": "information",
            "temperatures": {"range": ["-40 degC", "60 degC"]},
            "fixed": {"static": {"repeats": 2}, "rates": {"repeats": 2}},
        },
    } | changes


@pytest.fixture(scope="module", name="plan")
def _plan() -> dict[str, Any]:
    return plan_document(exact_plan(loaded(spec())))


@pytest.fixture(scope="module", name="made")
def _made(plan: dict[str, Any]) -> Design:
    return design(steps_of(plan), loaded(spec()).spec)


@pytest.fixture(scope="module", name="recorded")
def _recorded(plan: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The campaign with coloured noise and spikes, as Parquet."""
    folder = tmp_path_factory.mktemp("signals")
    settings = {
        "coloured_gyro": f"{SIGMA} deg/s",
        "coloured_time": f"{TIME} s",
        "spikes_of_samples": 2e-4,
        "bursts_per_hour": 20,
    }
    found = planner.simulate_signals(spec(), folder, rate_hz=RATE, plan=plan, seed=5, settings=settings)
    assert found.to_dict()["runs"] == 4
    return folder


@pytest.fixture(scope="module", name="reduced")
def _reduced(plan: dict[str, Any], recorded: Path) -> Path:
    (recorded / "plan.json").write_text(json.dumps(plan))
    out = recorded / "data.csv"
    raw, plan_path = sorted(recorded.glob("*.parquet")), recorded / "plan.json"
    found = planner.reduce(*raw, columns=recorded / "map.yaml", plan=plan_path, latitude_deg=45.0)
    found.save(out)
    return out


# ---------------------------------------------------------------- motions


def test_the_mean_over_a_record_is_what_the_record_is_exposed_to(made: Design) -> None:
    for rows in made.runs:
        records = records_of(made, rows)
        time = (np.arange(int(records.end[-1] * 200.0)) + 0.5) / 200.0
        rate, force = exposed(made, records, time)
        inside, number = records.inside(time), records.at(time)
        for k, row in enumerate(rows):
            mine = inside & (number == k)
            np.testing.assert_allclose(rate[mine].mean(axis=0), made.conditions.rate[row], atol=2e-6)
            np.testing.assert_allclose(
                force[mine].mean(axis=0), made.conditions.specific_force[row], atol=2e-3
            )


@pytest.mark.parametrize(
    "text",
    [
        "accelerometer.scale_factor_asymmetry=0.1 %",
        "accelerometer.vibration_rectification=1 mg/g^2",
        "accelerometer.scale_factor_nonlinearity=0.1 %",
        "gyro.scale_factor_acceleration=0.01 %/g",
        "gyro.g_squared_sensitivity=0.001 deg/s/g^2",
    ],
)
def test_a_record_has_the_mean_of_what_the_force_does_at_every_instant(made: Design, text: str) -> None:
    """Turns about level axes are among its motions: there a mean of squares is not the square of the mean."""
    hidden, settings, bare = hidden_effect(text), Settings(references=False), prepared(loaded(spec()).spec)
    of_records = [simulate(made, bare, 3, hidden=h, settings=settings)[0] for h in ((), (hidden,))]
    added = {
        "gyro": of_records[1].gyro - of_records[0].gyro,
        "accelerometer": of_records[1].acc - of_records[0].acc,
    }
    drawn = [recorded(made, bare, 3, settings, Disturbed(), h, 200.0)[0] for h in ((), (hidden,))]
    (sensor,), swings = hidden.sensors, 0
    for rows, plain, moved in zip(made.runs, *map(campaign_signals, drawn), strict=True):
        name = "gyro" if sensor == "gyro" else "acc"
        difference = getattr(moved, name) - getattr(plain, name)
        records = records_of(made, rows)
        inside, number = records.inside(moved.time), records.at(moved.time)
        for k, row in enumerate(rows):
            mean = difference[inside & (number == k)].mean(axis=0)
            swings += bool(isinstance(made.conditions, Swinging) and made.conditions.swing[row].any())
            np.testing.assert_allclose(mean, added[sensor][row], atol=0.03 * np.abs(added[sensor]).max())
    assert swings >= 4


def test_a_record_without_time_before_it_is_no_start_from_rest() -> None:
    """Records from power-on and one behind another: each turns at its own rate from its first sample on."""
    hurried = spec()
    hurried["benches"]["rate_table"]["move"] = "0 s"
    for test in hurried["tests"].values():
        test["power_on"] = "0 s"
    made = design(steps_of(plan_document(exact_plan(loaded(hurried)))), loaded(hurried).spec)
    turned = 0
    for rows in made.runs:
        records = records_of(made, rows)
        assert records.begin[0] == 0.0
        time = (np.arange(int(records.end[-1] * 200.0)) + 0.5) / 200.0
        rate, force = exposed(made, records, time)
        for k, row in enumerate(rows):
            mine = records.inside(time) & (records.at(time) == k)
            asked = made.conditions.rate[row]
            np.testing.assert_allclose(
                np.linalg.norm(rate[mine], axis=1), np.linalg.norm(asked), atol=2.1 * EARTH_RATE_RADPS
            )
            np.testing.assert_allclose(
                force[mine].mean(axis=0), made.conditions.specific_force[row], atol=2e-3
            )
            turned += bool(np.linalg.norm(asked) > 0.01)
    assert turned == 12


def test_what_turns_between_records_is_what_the_attitude_does(made: Design) -> None:
    """Gravity carried by the rates alone, Ḃ = −ω × B, from power-on to the end: the motion is one motion."""
    rate_hz, records = 1000.0, records_of(made, made.runs[0])
    middle = (np.arange(int(records.end[-1] * rate_hz)) + 0.5) / rate_hz
    rate, _ = exposed(made, records, middle)
    _, ends = exposed(made, records, np.array([0.0, middle[-1] + 0.5 / rate_hz]))
    turns = Rotation.from_rotvec(-rate / rate_hz)
    while len(turns) > 1:
        odd = turns[-1:] if len(turns) % 2 else Rotation.from_rotvec(np.zeros((0, 3)))
        turns = Rotation.concatenate([turns[1::2] * turns[: len(turns) // 2 * 2 : 2], odd])
    carried = turns[0].apply(ends[0])
    # the Earth turns by 0.9 deg in 215 s: the bench's vertical follows, what the gyros carry does not
    off = np.arccos(carried @ ends[1] / np.linalg.norm(carried) / np.linalg.norm(ends[1]))
    assert off < 1.05 * EARTH_RATE_RADPS * records.end[-1]


# ---------------------------------------------------------------- the loop


def test_simulate_reduce_calibrate_apply_close(recorded: Path, reduced: Path, tmp_path: Path) -> None:
    account = reduced.with_name("data.account.json")
    found = planner.calibrate(reduced, spec(), noise=account)
    found.save(tmp_path / "cal")
    drawn = json.loads((recorded / "truth.json").read_text())
    for file, of in (
        (drawn, "truth"),
        (json.loads(account.read_text()), "account"),
        (json.loads((tmp_path / "cal" / "random.json").read_text()), "random"),
    ):
        keeps(file, of)
    truth = {(t["error"], t["term"]): t for t in drawn["terms"]}
    document = found.to_dict()
    compared = 0
    for sensor in document["sensors"].values():
        for c in sensor["coefficients"]:
            if c["status"] == "determined":
                low, high = c["ci95"]
                t = truth[c["error"], c["term"]]
                true = t["value"] * unit_factor(t["unit"])[0] / unit_factor(c["unit"])[0]
                # the interval doubled, and three sigma of what two power-ons differ from the unit by
                of_runs = RUN_TO_RUN.get(c["error"], 0.0) * unit_factor(t["unit"])[0]
                within = (high - low) + 3.0 * of_runs / np.sqrt(2.0) / unit_factor(c["unit"])[0]
                assert abs(c["value"] - true) < within, (c["error"], c["term"])
                compared += 1
    assert compared >= 24
    raw_path, columns = recorded / "run_0001.parquet", recorded / "map.yaml"
    raw_path, columns = recorded / "run_0001.parquet", recorded / "map.yaml"
    planner.apply(tmp_path / "cal", raw_path, tmp_path / "corrected.csv", columns=columns)
    lines = [line for line in (tmp_path / "corrected.csv").read_text().splitlines() if line[0] != "#"]
    rows = np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding="utf-8")
    raw = pq.read_table(recorded / "run_0001.parquet").to_pandas()
    first = raw["step"] == raw["step"][raw["step"] != ""].iloc[0]

    def size(columns: Any) -> float:
        return float(np.linalg.norm([np.median(np.asarray(columns[f"acc_{a}_g"])[first]) for a in "xyz"]))

    assert abs(size(rows) - 1.0) < 1e-3
    assert abs(size(rows) - 1.0) < 0.2 * abs(size(raw) - 1.0)


def test_coloured_noise_goes_into_random_json(reduced: Path, tmp_path: Path, run: Run) -> None:
    """σ and τ as they were drawn, by every gyro; none where none was."""
    (tmp_path / "spec.json").write_text(json.dumps(spec()))
    account = reduced.with_name("data.account.json")
    outcome = run("calibrate", reduced, "--spec", "spec.json", "--noise", account, "-o", "cal")
    assert outcome.code == 0, outcome.err
    told = json.loads((tmp_path / "cal" / "random.json").read_text())["random"]
    for axis in "xyz":
        of = {r["kind"]: r for r in told["gyro"] if r["channel"] == axis}
        assert of["coloured"]["value"] == pytest.approx(SIGMA, rel=0.25)  # 40 s hold eighty of its times
        assert of["coloured_correlation_time"]["value"] == pytest.approx(TIME, rel=0.7)
        assert of["coloured_correlation_time"]["unit"] == "s"
        assert of["white_density_of_samples"]["value"] == pytest.approx(0.003, rel=0.1)
    kinds = {r["kind"] for r in told["accelerometer"]}
    assert "white_density_of_samples" in kinds
    assert "coloured" not in kinds
    outcome = run("calibrate", reduced, "--spec", "spec.json", "--noise", "spec.json", "-o", "cal2")
    assert outcome.code == 2
    assert "no account of a reduction" in outcome.err


def test_spikes_are_counted_and_left_out(reduced: Path) -> None:
    account = json.loads(reduced.with_name("data.account.json").read_text())
    struck = sum(row["left_out"].get("spike", 0) for row in account["rows"])
    assert 0.3 * 2 < struck < 200


# ---------------------------------------------------------------- packets, thermometer, flight


def test_packets_are_the_units_stream(plan: dict[str, Any], tmp_path: Path) -> None:
    """34 bytes each with a checksum that a bit-by-bit one confirms; the map beside them reads them."""
    settings = {"thermometer_dies": "97 s"}  # between the second record and the third
    out = tmp_path / "bin"
    planner.simulate_signals(spec(), out, form="packets", rate_hz=RATE, plan=plan, seed=5, settings=settings)
    data = (out / "run_0001.bin").read_bytes()
    assert len(data) % 34 == 0
    for k in (0, 7, 999):
        packet = data[34 * k : 34 * k + 34]
        assert checksum(packet[:33]) == packet[33]
    assert READER.recognises(out / "run_0001.bin", data[:4096])
    (tmp_path / "plan.json").write_text(json.dumps(plan))
    found = planner.reduce(out, columns=out / "map.yaml", plan=tmp_path / "plan.json", latitude_deg=45.0)
    records = [step["id"] for step in plan["steps"] if step["action"] == "record"]
    told = found.record.table.step.tolist()
    assert told == [step for step in records if step in set(told)]  # of every power-on, by one map
    assert [step for step in told if "/static/" in step] == [
        step for step in records if "/static/" in step and step.endswith(("m1", "m2"))
    ]
    assert len({step.rpartition("/")[0] for step in told}) == 4
    assert any("temperature" in part.reason for part in found.record.left_out)


def test_a_flight_is_recorded_by_its_ideal_readings(tmp_path: Path) -> None:
    """With every error taken away the samples add up to the flight's increments."""
    quiet = {"white_gyro": "0 deg/s", "white_accelerometer": "0 g"}
    off = dict.fromkeys(("run_to_run", "in_run", "storage", "temperature_residual", "references"), "off")
    perfect = spec()
    for sensor in ("gyro", "accelerometer"):
        for budget in perfect["unit"][sensor].values():
            budget["systematic"] = budget["systematic"].replace(budget["systematic"].split()[0], "0", 1)
    planner.simulate_signals(perfect, tmp_path / "f", rate_hz=1000.0, flight=True, settings={**quiet, **off})
    rows = pq.read_table(tmp_path / "f" / "run_0005.parquet").to_pandas()
    one = loaded(perfect)
    flight = trajectory_of(one.spec.trajectory, one.folder)
    turned = np.radians([rows[f"gyro_{a}_dps"].sum() / 1000.0 for a in "xyz"])
    np.testing.assert_allclose(turned, flight.angle_increment.sum(axis=0), atol=1e-5)
    moved = np.array([rows[f"acc_{a}_g"].sum() * 9.80665 / 1000.0 for a in "xyz"])
    np.testing.assert_allclose(moved, flight.velocity_increment.sum(axis=0), rtol=1e-4, atol=1e-2)


@pytest.mark.parametrize(
    ("settings", "options", "says"),
    [
        ({"coloured_gyro": "1 m"}, {}, "simulation setting"),
        ({"coloured_time": "0 s", "coloured_gyro": "1 deg/s"}, {}, "simulation setting"),
        ({"colored_gyro": "1 deg/s"}, {}, "not known"),
        ({}, {"rate_hz": 1.0}, "--rate"),
        ({}, {"form": "wav"}, "parquet or packets"),
    ],
)
def test_what_cannot_be_simulated_is_refused(
    settings: dict, options: dict, says: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=says):
        planner.simulate_signals(spec(), tmp_path / "x", settings=settings, **options)
    assert not (tmp_path / "x").exists()


# ---------------------------------------------------------------- coloured noise


def test_white_and_coloured_noise_are_told_apart() -> None:
    """Intervals hold what was drawn in nineteen of twenty recordings, and white noise stays white."""
    hits = []
    for seed in range(20):
        rng = np.random.default_rng([7, seed])
        x = 0.02 * rng.normal(size=30_000) + 0.004 * coloured(30_000, 0.01, 1.0, rng)
        found = noise_of_samples(x + np.linspace(0.0, 0.01, len(x)), 100.0, "gyro_x")
        pairs = ((found.white, 0.002), (found.sigma, 0.004), (found.time, 1.0))
        hits.append([ends is not None and ends[1] <= true <= ends[2] for ends, true in pairs])
        alone = noise_of_samples(rng.normal(size=10_000), 100.0, "gyro_x")
        assert alone.sigma is None
    assert np.mean(hits, axis=0).min() >= 0.8
    assert np.mean(hits) >= 0.9


def test_too_little_says_nothing() -> None:
    assert noise_of_samples(np.zeros(5000), 100.0, "gyro_x") is None
    assert noise_of_samples(np.arange(50.0), 100.0, "gyro_x") is None


def test_on_ramps_the_samples_move_with_the_chamber() -> None:
    """Each record in the midst of its way: T at its middle, ± r through it, no jump that the stray is not."""
    made = steps_of(document())
    on = planner.load(ramps()).spec
    unit, _ = recorded(design(made, on), prepared(on), 3, Settings(), Disturbed(), rate=10.0)
    moving = [s for s in campaign_signals(unit) if any("/ramps/" in step for step in np.unique(s.step))]
    assert moving
    for s in moving:
        for k, step in enumerate(step for step in dict.fromkeys(s.step.tolist()) if step):
            inside = s.step == step
            slope = 60.0 * np.polyfit(s.time[inside], s.temperature_degc[inside], 1)[0]
            assert slope == pytest.approx(RAMP if k % 2 == 0 else -RAMP, rel=1e-6)
            row = np.flatnonzero(unit.design.step == step)[0]
            assert np.mean(s.temperature_degc[inside]) == pytest.approx(
                unit.true.temperature_degc[row], abs=0.01
            )
        assert np.abs(np.diff(s.temperature_degc)).max() < 0.5
