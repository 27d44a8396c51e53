from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from planner.cli import app
from planner.errors import InputError
from planner.export.truth import truth_path, truth_text
from planner.simulate.campaign import Settings, Truth, prepared, simulate
from planner.simulate.hidden import hidden_effect
from planner.simulate.settings import pairs, settings_from
from planner.units import STANDARD_GRAVITY_MPS2
from tests.simulate.benches import campaign_of, noiseless
from tests.specs import SHIPPED

G = STANDARD_GRAVITY_MPS2


def test_every_term_can_be_set() -> None:
    found = settings_from(
        {
            "case": "worst",
            "signs": "plus",
            "white_gyro": "0.01 deg/s",
            "white_accelerometer": "0.2 mg",
            "in_run_time": "10 min",
            "temperature_jitter": "0.5 K",
            "temperature_error": "1 K",
            "run_to_run": "off",
            "in_run": False,
            "storage": "no",
            "temperature_residual": "off",
            "spikes": "0.5 %",
            "spike_size": 25,
            "references": "off",
        }
    )
    expected = Settings(
        {"gyro": np.radians(0.01), "accelerometer": 2e-4 * G}, 600.0, 0.5, 1.0, "worst", "plus",
        False, False, False, False, 0.005, 25.0, False,
    )  # fmt: skip
    assert found.white["gyro"] == pytest.approx(expected.white["gyro"])
    assert found.white["accelerometer"] == pytest.approx(expected.white["accelerometer"])
    assert {**vars(found), "white": 0} == {**vars(expected), "white": 0}


@pytest.mark.parametrize(
    ("written", "says"),
    [
        ({"whit_gyro": "1 deg/s"}, "did you mean white_gyro"),
        ({"white_gyro": "1 g"}, "white_gyro"),
        ({"white_gyro": "-1 deg/s"}, "less than zero"),
        ({"in_run": "perhaps"}, "on or off"),
        ({"case": "best"}, "random or worst"),
        ({"spikes": "nan"}, "no finite number"),
        ({"spikes": 2}, "outside"),
        ({"spikes": "many"}, "spikes"),
        ({"temperature_error": 3}, "temperature_error"),
    ],
)
def test_what_cannot_be_set_is_refused(written: dict, says: str) -> None:
    with pytest.raises(InputError, match=says):
        settings_from(written)


def test_a_pair_needs_its_sign() -> None:
    assert pairs(["in_run = off"]) == {"in_run": "off"}
    with pytest.raises(InputError, match="KEY=VALUE"):
        pairs(["in_run"])


@pytest.mark.parametrize("share", [0.02, 0.2])
def test_spikes_strike_their_share_by_their_size(share: float) -> None:
    spec, plan = campaign_of(temperatures=3, repeats=15)
    quiet = noiseless()
    noisy = Settings(**{**vars(quiet), "white": Settings().white})
    struck = Settings(**{**vars(noisy), "spikes": share, "spike_size": 40.0})
    a, _ = simulate(plan, prepared(spec), 1, settings=noisy)
    b, _ = simulate(plan, prepared(spec), 1, settings=struck)
    off = (b.gyro - a.gyro) / (noisy.white["gyro"] / np.sqrt(plan.duration))[:, None]
    hit = np.abs(off) > 1.0
    # a share of some hundred readings is known to its binomial spread; four of them
    assert abs(hit.mean() - share) < 4.0 * np.sqrt(share * (1 - share) / hit.size)
    np.testing.assert_allclose(np.abs(off[hit]), 40.0, rtol=1e-6)
    assert 0.2 < np.mean(off[hit] > 0) < 0.8


def test_the_white_noise_is_what_was_asked() -> None:
    spec, plan = campaign_of(temperatures=3, repeats=12)
    base = noiseless()
    loud = settings_from({"white_gyro": "0.05 deg/s"}, base)
    a, _ = simulate(plan, prepared(spec), 2, settings=base)
    b, _ = simulate(plan, prepared(spec), 2, settings=loud)
    scaled = np.degrees(b.gyro - a.gyro) * np.sqrt(plan.duration)[:, None]
    assert np.std(scaled) == pytest.approx(0.05, rel=4.0 / np.sqrt(2 * scaled.size))
    assert np.array_equal(a.acc, b.acc)


def test_in_run_noise_has_its_spread_and_time() -> None:
    """First-order Gauss-Markov: neighbours Δt apart correlate by exp(−Δt/τ)."""
    spec, plan = campaign_of(temperatures=1, repeats=150, name="close_the_loop.yaml")
    quiet = noiseless()
    on = Settings(**{**vars(quiet), "in_run": True, "in_run_time": 300.0})
    a, _ = simulate(plan, prepared(spec), 3, settings=quiet)
    b, _ = simulate(plan, prepared(spec), 3, settings=on)
    static = np.char.find(plan.step, "/static/") >= 0
    x = (b.gyro - a.gyro)[static]
    t, run = plan.conditions.time_on[static], plan.run[static]
    sigma = spec.unit.gyro["bias"].in_run.si
    # neighbours correlate, so n readings are worth about a fifth of them: 150 runs × 3 channels and more
    assert np.std(x) == pytest.approx(sigma, rel=0.15)
    near = run[1:] == run[:-1]
    r = np.mean(x[1:][near] * x[:-1][near]) / np.mean(x**2)
    assert r == pytest.approx(np.exp(-np.mean(np.diff(t)[near]) / 300.0), abs=0.08)


def test_several_hidden_effects_and_their_parameters_add_up() -> None:
    spec, plan = campaign_of(temperatures=1)
    texts = ["gyro.warm_up.x=0.01 deg/s,time_constant=120 s", "gyro.g_sensitivity.yz=0.02 deg/s/g"]
    plain, _ = simulate(plan, prepared(spec), 5)
    both, truth = simulate(plan, prepared(spec), 5, hidden=[hidden_effect(t) for t in texts])
    added = both.gyro - plain.gyro
    expected = np.radians(0.01) * np.exp(-plan.conditions.time_on / 120.0)
    np.testing.assert_allclose(added[:, 0], expected, atol=1e-14)
    np.testing.assert_allclose(added[:, 1], np.radians(0.02) / G * plain.ref_acc[:, 2], atol=1e-14)
    (warm,) = [t for t in truth.terms if t.hidden and t.error == "gyro.warm_up" and t.value]
    assert warm.nonlinear == {"time_constant": 120.0}
    assert '"time_constant": 120.0' in truth_text(truth)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("warm_up=0.01 deg/s,tau=600 s", "no parameter 'tau'; it has time_constant"),
        ("warm_up=0.01 deg/s,time_constant=600", "time_constant"),
        ("warm_up=0.01 deg/s,time_constant=-5 s", "must lie in 30 s … 12000 s"),
        ("g_sensitivity=0.01 deg/s/g,day=3", "it has none"),
    ],
)
def test_a_parameter_that_cannot_be_is_refused(text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        hidden_effect(text)


# ---------------------------------------------------------------- files


def test_truth_never_overwrites_that_of_other_data(tmp_path: Path) -> None:
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    assert truth_path(first) == tmp_path / "truth.json"
    (tmp_path / "truth.json").write_text(truth_text(Truth(1, ()), "a.csv"))
    assert truth_path(first) == tmp_path / "truth.json"
    assert truth_path(second) == tmp_path / "b.truth.json"
    (tmp_path / "truth.json").write_text("[1")
    assert truth_path(first) == tmp_path / "a.truth.json"


def test_the_command_takes_settings_from_a_file_and_from_the_line(tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text("white_gyro: 0 deg/s\nrun_to_run: off\nin_run: off\nstorage: off\n")
    spec = str(SHIPPED / "close_the_loop.yaml")

    def run(*more: str) -> dict:
        found = CliRunner().invoke(app, ["simulate", spec, "-o", str(tmp_path / "d.csv"), "--json", *more])
        assert found.exit_code == 0, found.output
        return json.loads(found.stdout)["result"]

    said = run("--settings", str(tmp_path / "s.yaml"), "--set", "temperature_jitter=0 K")
    assert said["written"] == [str(tmp_path / "d.csv"), str(tmp_path / "truth.json")]
    first = (tmp_path / "d.csv").read_bytes()
    run("--settings", str(tmp_path / "s.yaml"), "--set", "temperature_jitter=0 K")
    assert (tmp_path / "d.csv").read_bytes() == first
    run("--settings", str(tmp_path / "s.yaml"), "--set", "white_gyro=1 deg/s")
    assert (tmp_path / "d.csv").read_bytes() != first


@pytest.mark.parametrize(
    "more",
    [
        ["--set", "in_run"],
        ["--set", "x=1"],
        ["--settings", "none.yaml"],
        ["--case", "bad"],
        ["--hidden", "?=1"],
    ],
)
def test_the_command_refuses_without_a_traceback(tmp_path: Path, more: list[str]) -> None:
    import subprocess
    import sys

    command = [sys.executable, "-m", "planner", "simulate", str(SHIPPED / "close_the_loop.yaml")]
    found = subprocess.run(
        [*command, "-o", str(tmp_path / "d.csv"), *more], capture_output=True, text=True, check=False
    )
    assert found.returncode == 2, found.stderr
    assert "Traceback" not in found.stderr
    assert not (tmp_path / "d.csv").exists()
