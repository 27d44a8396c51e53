"""What hides in a campaign from plain NumPy is named, and nothing else is.

Strengths are whitened: the square root of the noncentrality that an observer who knows the noise would have.
The rates over many seeds are measured by benchmarks/study_diagnosis.py; here a seed of each.
"""

from __future__ import annotations

import json

import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from planner.dwells.dwell_files import read_dwells
from tests.calibrate.world import Hidden, Layout, Noise
from tests.data import recording
from tests.diagnose.worlds import (
    DECLARED,
    ON_GYROS,
    named,
    named_on,
    rivals_of,
    searched,
    unnamed,
)

# each on a channel of its own: all are found in one search; one by one in benchmarks/study_diagnosis.py
TOGETHER = (
    ON_GYROS[:3],
    (*ON_GYROS[9:], ("temperature_rate_table", "gyro_y")),
    (("temperature_rate", "acc_z"), ("warm_up", "acc_y"), ("temperature_rate_table", "acc_x")),
    ON_GYROS[3:6],
    ON_GYROS[6:9],
)


@pytest.mark.parametrize("together", TOGETHER[:3], ids=lambda one: "-".join(name for name, _ in one))
@pytest.mark.further("together", TOGETHER[3:])
def test_effects_of_20_sigma_are_named_on_their_channels_and_no_others(
    together: tuple[tuple[str, str], ...],
) -> None:
    sensor = "gyro" if together[0][1].startswith("gyro") else "accelerometer"
    hidden = [Hidden(effect, channel, tau_s=400.0, step_day=20.0) for effect, channel in together]
    assert len({h.channel for h in hidden}) == len(hidden)
    s = searched(21, hidden, sensor, strength=20.0)
    assert named(s.found) == {(effect, channel[-1]) for effect, channel in together}
    assert unnamed(s.found) == set()


def test_effects_of_7_sigma_are_named_or_stand_among_the_rivals() -> None:
    hidden = [Hidden("bias_step", "gyro_y", step_day=20.0), Hidden("g_sensitivity", "gyro_x")]
    s = searched(31, hidden, strength=7.0)
    assert len(s.found.library) == 2
    for h in hidden:
        assert h.effect in named_on(s, h.channel[-1]) | rivals_of(s)


def test_two_effects_on_one_channel_are_both_named() -> None:
    pairs = {
        "x": {"warm_up", "ageing"},
        "y": {"g_sensitivity", "temperature_rate"},
        "z": {"scale_factor_asymmetry", "warm_up"},
    }
    hidden = [Hidden(effect, f"gyro_{axis}") for axis, pair in pairs.items() for effect in sorted(pair)]
    s = searched(41, hidden, strength=16.0)
    for axis, pair in pairs.items():
        assert on_channel(named(s.found), axis) == pair
        assert on_channel(unnamed(s.found), axis) == set()


@pytest.mark.parametrize(
    "noise", [Noise(kind="student"), Noise(kind="correlated")], ids=lambda n: f"{n.kind}-{n.outliers}"
)
@pytest.mark.further("noise", [Noise(outliers=0.004)])
def test_where_nothing_hides_nothing_is_claimed(noise: Noise) -> None:
    s = searched(51, noise=noise)
    assert named(s.found) | unnamed(s.found) == set()


def test_one_repeat_is_enough_to_claim_nothing() -> None:
    layout = Layout(static_repeats=1, later=(), rate_repeats=1)
    for sensor in ("gyro", "accelerometer"):
        s = searched(53, sensor=sensor, layout=layout)
        assert named(s.found) | unnamed(s.found) == set()


def test_what_no_effect_explains_is_unknown_and_its_variable_is_named() -> None:
    """|dT/dt| has no sign, which one coefficient cannot have, but a table: both its sides are alike."""
    every = {"x": "day", "y": "rate", "z": "temperature_rate"}
    s = searched(
        61, [Hidden(f"unknown_{name}", f"gyro_{axis}") for axis, name in every.items()], strength=22.0
    )
    for axis in "xy":
        assert on_channel(unnamed(s.found), axis) == {every[axis]}
        assert on_channel(named(s.found), axis) == set()
    assert on_channel(named(s.found), "z") == {"temperature_rate_table"}
    assert on_channel(unnamed(s.found), "z") == set()


def on_channel(found: set[tuple[str, str]], axis: str) -> set[str]:
    """What was found on one channel; what chance finds on others is measured where nothing hides."""
    return {name for name, channels in found if axis in channels}


def test_forty_sigma_outliers_change_no_verdict() -> None:
    s = searched(71, [Hidden("temperature_rate", "gyro_z")], strength=15.0, noise=Noise(outliers=0.004))
    assert named(s.found) == {("temperature_rate", "z")}
    assert sum(int(rows.sum()) for rows in s.far.values()) > 3


# ---------------------------------------------------------------- campaigns that others made

WHOLE = "all 835 dwells of a campaign, power-on by power-on"
KNOWN = [6, 12]  # an effect, an unknown one
FURTHER = [0, 8]  # nothing; the arm: the accelerometers show it too
SHARED = {"earth_rate", "arm_bending", "misalignment_temperature"}  # these act on all channels of the data


@pytest.mark.parametrize("number", KNOWN)
@pytest.mark.further("number", FURTHER)
def test_campaigns_of_another_simulator_are_diagnosed_right(number: int) -> None:
    folder = recording(f"campaigns/{number:03d}", WHOLE)
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    data = prepared(read_dwells(folder / "data.csv"))
    gyro = diagnose_sensor(data, "gyro", DECLARED, 1).found
    axis = truth["axis"][-1]
    if truth["effect"] == "none":
        assert named(gyro) | unnamed(gyro) == set()
    elif truth["effect"] == "unknown":
        assert named(gyro) == set()
        assert unnamed(gyro) == {("rate", axis)}  # it sets in between 50 and 100 deg/s, about any axis
    else:
        assert {name for name, _ in named(gyro)} == {truth["effect"]}
        assert any(axis in channels for _, channels in named(gyro))
        assert truth["effect"] in SHARED or len(named(gyro)) == 1
        assert unnamed(gyro) == set()


@pytest.mark.parametrize("number", [8])
@pytest.mark.further("number", [0])
def test_nothing_is_claimed_on_their_accelerometers(number: int) -> None:
    """Only the arm of campaign 8 acts on them."""
    data = prepared(read_dwells(recording(f"campaigns/{number:03d}/data.csv", WHOLE)))
    found = diagnose_sensor(data, "accelerometer", DECLARED, 1).found
    assert {name for name, _ in named(found)} == ({"arm_bending"} if number == 8 else set())
    assert unnamed(found) == set()
