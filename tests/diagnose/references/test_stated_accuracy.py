"""`benches.*.accuracy` is what is known of the references beforehand: the same tilt reads as it says."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.pool import pool_of
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.search.sensor import begin
from planner.export.diagnosis_findings import findings_document, findings_from
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.pipelines.data import simulate
from planner.report.subjects.diagnosis_findings import told_by
from planner.report.subjects.diagnosis_words import headline
from planner.simulate.settings import settings_of
from planner.spec.load import LoadedSpec, load_spec
from planner.spec.model import Spec
from planner.spec.references import BenchAccuracy
from tests.diagnose.labs.unit import campaign
from tests.specs import SHIPPED

DRAWN = BenchAccuracy(level="0.05 deg", mounting="0.1 deg", rate="300 ppm", temperature="0.5 K")
PERFECT = BenchAccuracy()


@cache
def shipped_spec() -> LoadedSpec:
    return load_spec(SHIPPED / "small_uav.yaml")


@cache
def spec(accuracy: BenchAccuracy = PERFECT) -> Spec:
    shipped = shipped_spec().spec
    benches = {name: b.model_copy(update={"accuracy": accuracy}) for name, b in shipped.benches.items()}
    return shipped.model_copy(update={"benches": benches})


@cache
def simulated(seed: int) -> tuple[DwellTable, float]:
    """The accelerometers of a campaign on a bench as accurate as DRAWN; its tilt, deg."""
    drawn = replace(shipped_spec(), spec=spec(DRAWN))
    table, truth = simulate(drawn, None, (), seed, settings_of(drawn.spec), 45.0, "measured")
    tilt = [truth.references[f"rate_table.level_{axis}"] for axis in "xy"]
    return replace(table, gyro=None), float(np.degrees(np.hypot(*tilt)))


def diagnosed(table: DwellTable, accuracy: BenchAccuracy) -> UnitDiagnosis:
    found = diagnose(table, spec(accuracy))
    kept = findings_from(findings_document(found))["reference_suspects"]
    assert [(s.expected, s.stated) for s in kept] == [
        (s.expected, pytest.approx(s.stated)) for s in found.reference_suspects
    ]
    return found


@pytest.mark.parametrize("seed", [2])
@pytest.mark.further("seed", [1, 3])
def test_a_bench_as_accurate_as_stated_is_no_finding_and_no_lever_arm(seed: int) -> None:
    """Turned about a level axis the base's tilt stays, along the axis: it had been read as a lever arm."""
    table, tilt = simulated(seed)
    found = diagnosed(table, DRAWN)
    assert not found.effects
    assert found.verdict == "clean"
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "base_tilt"
    assert suspect.expected
    assert suspect.low <= tilt <= suspect.high
    assert headline(found).startswith("Nothing is missing")
    assert "no fault" in str(told_by(found.reference_suspects))


@pytest.mark.parametrize("seed", [2])
@pytest.mark.further("seed", [3])
def test_the_same_tilt_is_a_fault_where_the_spec_states_a_better_bench(seed: int) -> None:
    table, _ = simulated(seed)
    found = diagnosed(table, BenchAccuracy(level="0.002 deg"))
    (suspect,) = found.reference_suspects
    assert not suspect.expected
    assert suspect.chance < 1e-6
    assert found.verdict == "explained"
    assert headline(found) == "Reference suspect: base tilt"
    assert "out of its accuracy" in str(told_by(found.reference_suspects))


@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [1])
def test_on_a_bench_of_another_lab_too(seed: int) -> None:
    """0.15 deg of tilt, from plain NumPy."""
    table, _ = campaign(seed, fault="base_tilt")
    said = {}
    for level in ("0.2 deg", "0.01 deg", "0 deg"):
        found = diagnosed(replace(table, gyro=None), BenchAccuracy(level=level))
        (suspect,) = (s for s in found.reference_suspects if s.hypothesis == "base_tilt")
        said[level] = (suspect.expected, suspect.stated > 0.0)
    assert said == {"0.2 deg": (True, True), "0.01 deg": (False, True), "0 deg": (False, False)}


def test_a_size_that_is_stated_is_believed_sooner_than_one_far_beyond_it() -> None:
    table, _ = campaign(1, fault="base_tilt")
    begun = begin(prepared(table), "accelerometer", tuple(spec().effects))
    (tilt,) = (b for b in begun.pool.blocks if b.name == "base_tilt" and not b.place)  # of all benches

    def criterion(stated: float) -> float:
        block: Block = replace(tilt, stated=stated)
        return score(pool_of(begun.pool.state, [block], begun.cuts), [0]).criterion

    flat, odds = criterion(0.0), 2.0 * np.log(0.01)
    assert criterion(np.radians(0.15)) > flat + odds / 3.0
    assert criterion(np.radians(0.001)) == pytest.approx(flat + odds, abs=1e-3)
    assert criterion(np.radians(0.05)) > criterion(np.radians(0.03))
