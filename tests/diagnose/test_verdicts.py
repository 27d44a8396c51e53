"""Verdicts on campaigns of another bench, from plain NumPy: the bench is asked first, evidence vetoes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from planner import catalog
from planner.diagnose.channels.channel import channel
from planner.diagnose.channels.read_temperature import straying, strays_of, with_read_temperature
from planner.diagnose.dwells_to_diagnosis import diagnose, told_from_zero
from planner.diagnose.noise.outliers import outliers
from planner.diagnose.records.not_as_said import screened
from planner.export.diagnosis_findings import findings_document, findings_from
from planner.nouns.conditions import Conditions
from planner.nouns.diagnosis import FoundEffect, FoundTerm, UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.spec.load import load_spec
from planner.spec.model import Spec
from tests.diagnose.labs.bench import bench
from tests.diagnose.labs.shapes import Hidden
from tests.diagnose.labs.unit import campaign
from tests.specs import SHIPPED


@cache
def spec() -> Spec:
    return load_spec(SHIPPED / "small_uav.yaml").spec


def blamed(found: UnitDiagnosis) -> set[str]:
    """The effects of the sensor that are claimed."""
    return {e.effect for e in found.effects if not catalog.effects()[e.effect].bench_only}


# ---------------------------------------------------------------- the bench is asked first


@pytest.mark.parametrize(("seed", "fault"), [(1, "base_tilt"), (7, "local_gravity"), (4, "mounting")])
def test_a_fault_of_the_bench_is_named_and_no_sensor_blamed(seed: int, fault: str) -> None:
    """Gravity is read by accelerometers alone; the other two turn the gyros' references too."""
    table, _ = campaign(seed, fault=fault)
    found = diagnose(replace(table, gyro=None) if fault == "local_gravity" else table, spec())
    assert fault in {s.hypothesis for s in found.reference_suspects}
    assert blamed(found) == set()
    assert all(s.check for s in found.reference_suspects)


def test_a_thermometer_that_lags_is_named_with_an_interval_that_holds_its_lag() -> None:
    table, _ = campaign(502, fault="thermometer_lag")  # the unit is 5 min behind the reading
    found = diagnose(replace(table, gyro=None), spec())
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "thermometer_lag"
    assert suspect.low <= -300.0 <= suspect.high
    assert suspect.high - suspect.low < 100.0
    assert blamed(found) == set()


def test_what_a_thermometer_strays_while_the_chamber_soaks_is_no_temperature() -> None:
    """Accelerometer x of a campaign of another lab: 0.8 mg/K at 63 degC, read with 0.05 K of noise."""
    rng = np.random.default_rng(3)
    starts = np.arange(0, 70, 7)
    soaked = np.repeat(np.linspace(-50.0, 60.0, 10), 7)
    read = soaked + 0.05 * rng.normal(size=70)
    ramp = np.zeros(70)
    ramp[:7], read[:7] = 2.0 / 60.0, read[:7] + np.arange(7.0)
    stray = straying(read, ramp, starts)
    assert not stray[:7].any()
    assert np.allclose(np.add.reduceat(stray, starts), 0.0)
    axis = Conditions(
        rate=np.zeros((70, 3)),
        specific_force=np.tile([[0.0, 0.0, 9.8], [9.8, 0.0, 0.0], [0.0, 9.8, 0.0], [0.0, 0.0, -9.8],
                                [-9.8, 0.0, 0.0], [0.0, -9.8, 0.0], [6.9, 6.9, 0.0]], (10, 1)),
        temperature_degc=read,
        temperature_rate=ramp,
        time_on=np.tile(np.arange(7) * 80.0 + 40.0, 10),
        day=np.repeat(np.arange(10.0), 7),
    )  # fmt: skip
    steep = 1e-4 * ((soaked - 20.0) / 10.0) ** 3
    c = channel("accelerometer", 0, axis, axis.specific_force[:, 0] + steep, ("bias", "bias_temperature"))
    wide = with_read_temperature(c, strays_of(c.model.conditions, starts), starts)
    (added,) = wide.J[:, c.J.shape[1] :].T
    slope = 3e-5 * ((soaked - 20.0) / 10.0) ** 2
    assert np.abs(added - slope * stray)[14:-7].max() < 0.1 * np.abs(slope * stray).max()


@pytest.mark.parametrize("seed", [5, 6, 7])
@pytest.mark.parametrize("fault", ["wrong_label", "wrong_run"])
def test_a_face_label_that_is_turned_is_found_row_by_row(seed: int, fault: str) -> None:
    table, _ = campaign(seed, fault=fault)
    seen = screened(table)
    (suspect,) = seen.suspects
    assert suspect.hypothesis == "wrong_label"
    rows = np.flatnonzero(~seen.kept)
    assert len(rows) == (1 if fault == "wrong_label" else 7)
    assert {r.run for r in seen.left_out} == set(table.run[rows].tolist())
    assert all("looks as if face" in r.guess for r in seen.left_out)


@pytest.mark.parametrize("seed", [8, 9, 13022, 13033])
def test_rows_of_a_second_unit_are_found_and_not_judged(seed: int) -> None:
    """Of the last two seeds the turns go from cold to hot and the unit changes between: the levels tell."""
    table, _ = campaign(seed, fault="mixed_units")
    seen = screened(table)
    assert [s.hypothesis for s in seen.suspects] == ["mixed_units"]
    first = int(seen.suspects[0].value)
    truth = np.unique(table.run)[np.unique(table.run) >= np.quantile(np.unique(table.run), 0.55)][0]
    assert abs(first - truth) <= 1


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_biases_that_all_step_at_once_are_those_of_a_second_unit(seed: int) -> None:
    """Scale factors and leans stay; one bias that steps is the sensor's own."""
    table, _ = campaign(seed)
    rng = np.random.default_rng(seed)
    runs = np.unique(table.run)
    later = (table.run >= runs[int(0.4 * len(runs))])[:, None]
    step = {"gyro": np.radians(0.02) * rng.choice([-1.0, 1.0], 3), "acc": 0.06 * rng.choice([-1.0, 1.0], 3)}
    both = {name: getattr(table, name) + later * step[name] for name in step}
    (suspect,) = screened(replace(table, **both)).suspects
    assert suspect.hypothesis == "mixed_units"
    assert abs(suspect.value - runs[int(0.4 * len(runs))]) <= 1
    alone = {name: getattr(table, name) + later * step[name] * [1.0, 0.0, 0.0] for name in step}
    assert not screened(replace(table, **alone)).suspects


@pytest.mark.parametrize("seed", [2, 3, 5])
def test_a_second_unit_that_was_taken_for_all_turns_is_one(seed: int) -> None:
    """The step of all biases lay where turns begin, as a level of turns does; sensors were blamed."""
    table, _ = campaign(seed)
    rng = np.random.default_rng(seed)
    rate = np.linalg.norm(table.conditions().rate, axis=1)
    first = int(table.run[rate > np.radians(1.0)].min())
    later = (table.run >= first)[:, None]
    step = {"gyro": np.radians(0.02) * rng.choice([-1.0, 1.0], 3), "acc": 0.06 * rng.choice([-1.0, 1.0], 3)}
    both = {name: getattr(table, name) + later * step[name] for name in step}
    (suspect,) = screened(replace(table, **both)).suspects
    assert suspect.hypothesis == "mixed_units"
    assert suspect.value == first
    for name in step:
        assert not screened(replace(table, **{name: both[name]})).suspects  # a sensor by itself


@pytest.mark.parametrize("seed", [5])
@pytest.mark.further("seed", [3])
def test_the_earths_rate_with_the_wrong_sign_is_no_g_sensitivity(seed: int) -> None:
    table, _ = campaign(seed, centrifuge=False)
    b = bench(seed, centrifuge=False)
    wrong = replace(table, ref_rate=table.ref_rate - 2.0 * np.radians(b.earth), acc=None)
    found = diagnose(wrong, spec())
    assert {e.effect for e in found.effects} == {"earth_rate"}
    up = next(t for e in found.effects for t in e.terms if t.name == "up")
    assert up.low < 2.0 * np.radians(15.041067 / 3600.0) * np.sin(b.latitude) < up.high


@pytest.mark.parametrize(("seed", "channel"), [(80009, "acc_z")])
@pytest.mark.further(("seed", "channel"), [(80020, "gyro_x"), (80045, "acc_z")])
def test_a_scale_factor_that_settles_after_power_on_has_no_other_name(seed: int, channel: str) -> None:
    table, _ = campaign(seed, Hidden("scale factor after power-on", channel, 25.0))
    found = diagnose(replace(table, **{"acc" if channel.startswith("gyro") else "gyro": None}), spec())
    assert not found.effects
    (unknown,) = found.unknown
    over = "rate" if channel.startswith("gyro") else "specific_force"
    assert unknown.varies_with == f"time_on_and_{over}"
    assert unknown.channels == (channel.replace("acc", "accelerometer"),)


@pytest.mark.parametrize("seed", range(10, 16))
def test_labels_and_units_of_a_clean_campaign_are_not_doubted(seed: int) -> None:
    table, _ = campaign(seed, tails=2.5 if seed % 2 else 0.0)
    seen = screened(table)
    assert seen.kept.all()
    assert not seen.suspects


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("rests", [0, 24])
def test_a_unit_measured_cold_first_and_then_hot_is_one_unit(seed: int, rests: int) -> None:
    """Leans that follow temperature, and their products with the scale factor, temperature by temperature.

    Where power-ons of rests come before them, levels of the turns are others, by what feels the time or g.
    """
    rng = np.random.default_rng(seed)
    runs = 24 + rests
    degc = np.repeat(np.tile(np.repeat([-60.0, -20.0, 20.0, 55.0], 6), runs // 24), 12)
    run, n = np.repeat(np.arange(runs), 12), runs * 12
    rate = np.radians(np.tile([-400.0, -200.0, -50.0, 50.0, 200.0, 400.0], n // 6)) * (run >= rests)
    w = rate[:, None] * np.eye(3)[np.repeat(np.arange(n // 6) % 3, 6)]
    lean = rng.uniform(-5e-3, 5e-3, (3, 3)) * (1.0 - np.eye(3))
    warm = (degc - 20.0) / 60.0
    scale = rng.uniform(-4e-3, 4e-3, 3) * (1.0 + warm[:, None] + 0.5 * warm[:, None] ** 2)
    y = (1.0 + scale) * (w + w @ lean.T + (warm[:, None] * w) @ (lean.T / 3.0))
    bias = rng.uniform(-3e-4, 3e-4, 3) * (1.0 + warm[:, None]) + 3e-4 * (run >= rests)[:, None]
    level = 2e-5 * rng.normal(size=(runs, 3))[run]
    table = DwellTable(
        unit=np.full(n, "A"),
        run=run,
        day=np.zeros(n),
        time_on=np.tile(np.arange(12) * 60.0 + 30.0, runs),
        duration=np.full(n, 30.0),
        temperature_degc=degc + rng.normal(0.0, 0.1, n),
        temperature_rate=np.zeros(n),
        ref_rate=w,
        ref_acc=None,
        gyro=y + bias + level + rng.normal(0.0, 1e-5, (n, 3)),
        acc=None,
    )
    assert not screened(table).suspects


# ---------------------------------------------------------------- evidence


def test_a_younger_effect_is_named_by_its_own_name() -> None:
    table, _ = campaign(17, Hidden("cross_coupling", "acc_y", 30.0))
    found = diagnose(replace(table, gyro=None), spec())
    assert [(e.effect, e.channels) for e in found.effects] == [("cross_coupling", ("accelerometer_y",))]


def test_what_rests_on_one_power_on_has_no_name() -> None:
    table, _ = campaign(18)
    assert table.gyro is not None
    gyro = table.gyro.copy()
    arm = np.unique(table.run)[-1]
    gyro[table.run == arm, 0] += (
        3e-8 * np.sum(table.conditions().specific_force ** 2, axis=1)[table.run == arm]
    )
    found = diagnose(replace(table, gyro=gyro, acc=None), spec())
    assert not [e for e in found.effects if "gyro_x" in e.channels]


def test_no_interval_that_leaves_zero_out_no_name() -> None:
    term = FoundTerm("x", "gyro_x", 1.0, -0.5, 2.5, 30.0, "deg/s")
    e = FoundEffect("warm_up", "gyro", ("gyro_x",), (term,), 1e-9, 8.0, nonlinear={"time_constant": 600.0})
    stands, falls, rest = told_from_zero([e])
    assert not stands
    assert falls[0].effect == "warm_up"
    assert rest[0].varies_with == "time_on"
    stands, _, _ = told_from_zero([replace(e, terms=(replace(term, low=0.2),))])
    assert stands


# ---------------------------------------------------------------- rows left out


class _Rest:
    """Just what `outliers` asks of a channel: a level at rest."""

    def __init__(self, r: np.ndarray) -> None:
        self.r, self.y, self.J = r, r, np.ones((len(r), 1))


def test_no_more_rows_go_than_chance_says_and_struck_ones_do() -> None:
    rng = np.random.default_rng(1)
    starts, ones = np.arange(0, 600, 6), np.ones(600)
    gone = {"normal": 0, "tails": 0}
    for _ in range(60):
        for name, r in (("normal", rng.normal(size=600)), ("tails", rng.standard_t(2.5, size=600))):
            gone[name] += int(outliers(_Rest(r), np.empty((600, 0)), starts, ones).rows.sum())  # type: ignore[arg-type]  # a stand-in of what is asked
    assert gone["normal"] <= 6  # 0.02 a campaign: 1.2 are expected, and 6 once in 700
    assert gone["tails"] <= 12
    r = rng.normal(size=600)
    struck = rng.choice(600, 5, replace=False)
    r[struck] += 25.0
    far = outliers(_Rest(r), np.empty((600, 0)), starts, ones)  # type: ignore[arg-type]  # a stand-in of what is asked
    assert set(np.flatnonzero(far.rows)) == set(struck.tolist())


def test_what_a_condition_has_in_common_is_no_accident() -> None:
    rng = np.random.default_rng(2)
    r, cells = rng.normal(size=600), np.tile(np.arange(6), 100)
    last = np.flatnonzero(cells == 5)[:20]
    cells[last] = 6
    r[last] += 30.0
    far = outliers(_Rest(r), np.empty((600, 0)), np.arange(0, 600, 6), np.ones(600), cells)  # type: ignore[arg-type]  # a stand-in of what is asked
    assert not far.rows[last].any()


def test_the_only_rows_in_an_attitude_are_not_judged_by_the_others() -> None:
    """Two rows of one power-on that alone tell a column: the others cannot say what they should read."""
    rng = np.random.default_rng(4)
    r, alone = rng.normal(size=600), np.zeros((600, 1))
    alone[[100, 101], 0] = 1.0
    r[[100, 101]] += 300.0
    far = outliers(_Rest(r), alone, np.arange(0, 600, 6), np.ones(600))  # type: ignore[arg-type]  # a stand-in of what is asked
    assert not far.rows.any()


def test_findings_survive_the_file() -> None:
    table, _ = campaign(5, fault="wrong_label")
    seen = screened(table)
    bare = UnitDiagnosis("u", "explained", (), (), (), (), (), ())
    found = replace(bare, reference_suspects=seen.suspects, rows_left_out=seen.left_out)
    again = findings_from(findings_document(found))
    assert again["reference_suspects"][0].hypothesis == "wrong_label"
    assert again["rows_left_out"][0].guess == seen.left_out[0].guess


# ---------------------------------------------------------------- a spec of the sensor alone

SHORT = """
planner: 1
unit:
  gyro: {bias: {run_to_run: 0.002 deg/s}}
  accelerometer: {bias: {run_to_run: 1 mg}}
effects: [bias, bias_temperature, scale_factor, scale_factor_temperature, misalignment]
"""


def test_a_spec_of_the_sensor_alone_is_enough(tmp_path: Path) -> None:
    from planner.api.given import read
    from planner.errors import InputError
    from planner.spec.sensor_alone import needs

    file = tmp_path / "sensor.yaml"
    file.write_text(SHORT, encoding="utf-8")
    loaded = read(file)
    assert set(loaded.absent) == {"name", "requirement", "trajectory", "benches", "tests"}
    with pytest.raises(InputError) as raised:
        needs(loaded, "the flight", "trajectory")
    assert raised.value.faults[0].path == "trajectory"
    file.write_text(SHORT.replace("0.002 deg/s", "0.002 m"), encoding="utf-8")
    with pytest.raises(InputError) as raised:
        read(file)
    assert raised.value.faults[0].line == 4
    whole = read(SHIPPED / "small_uav.yaml")
    assert whole.absent == ()
    assert whole.sha256 == load_spec(SHIPPED / "small_uav.yaml").sha256


# ---------------------------------------------------------------- shapes that look like two names, or a table


def test_a_load_that_saturates_is_a_curve_over_the_load_and_no_pair_of_powers() -> None:
    table, _ = campaign(21007, Hidden("saturation", "acc_y", 25.0))
    found = diagnose(replace(table, gyro=None), spec())
    assert not found.effects
    assert [(u.varies_with, u.channels) for u in found.unknown] == [("specific_force", ("accelerometer_y",))]


@pytest.mark.parametrize("seed", [11016])
@pytest.mark.further("seed", [11020])
def test_struck_rows_on_ramps_are_no_table_over_the_rate_of_temperature(seed: int) -> None:
    table, _ = campaign(seed, struck=0.007)
    found = diagnose(replace(table, acc=None), spec())
    assert not found.effects
    assert {r.effect for r in found.refused} & {"temperature_rate_table", "temperature_rate_table_over_time"}


@pytest.mark.parametrize(("seed", "channel"), [(11000, "gyro_y")])
@pytest.mark.further(("seed", "channel"), [(11027, "gyro_x")])
def test_what_a_few_struck_rows_on_ramps_explain_as_well_is_refused(seed: int, channel: str) -> None:
    table, _ = campaign(seed, struck=0.007)
    found = diagnose(replace(table, acc=None), spec())
    assert not found.effects
    why = {r.effect: r.why for r in found.refused if r.channels == (channel,)}
    assert why["temperature_rate_table_over_time"] == "a few records, each off by itself, explain it as well"
