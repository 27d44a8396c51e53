"""Few power-ons, each with its own level: noise alone reads 1 in σ, and intervals are as long as they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.calibrate.dwells_to_fit import fit_sensor
from planner.diagnose.diagnosis_to_residual import residual_changes, unit_fits
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.findings.declared_and_found import declared_and_found
from planner.dwells.table_rows import by_run
from planner.nouns.diagnosis import UnitDiagnosis
from planner.spec.load import load_spec, spec_from_bytes
from tests.diagnose.few_power_ons import few_power_ons
from tests.diagnose.worlds import SPEC as WORLD
from tests.specs import SHIPPED

SPEC = load_spec(SHIPPED / "small_uav.yaml").spec
STEADY = spec_from_bytes(WORLD, Path("steady.yaml")).spec  # nothing drifts within a power-on
NOTHING = UnitDiagnosis("few", "clean", (), (), (), (), (), ())


@pytest.mark.parametrize(("runs", "tails"), [(5, 0.0), (8, 4.0)])
@pytest.mark.further(("runs", "tails"), [(12, 0.0), (5, 4.0)])
def test_noise_alone_is_one_sigma_where_power_ons_are_few(runs: int, tails: float) -> None:
    """3 to 4.5 on average, up to 7.7, where levels of power-ons counted as what varies within them.

    Of five power-ons what they draw is known so roughly that 0.9 is left of 1.
    """
    found = [
        change.sigma_before
        for seed in range(6)
        for change in residual_changes(unit_fits(few_power_ons(runs, seed, tails=tails), SPEC, NOTHING))
    ]
    least = 0.85 if runs == 5 else 0.96
    assert least < np.mean(found) < 1.04  # 36 figures, each known to 7 %, of t's tails to 12 %
    assert np.max(found) < 1.3


@pytest.mark.parametrize("runs", [2, 3])
def test_levels_of_two_or_three_power_ons_are_no_misfit(runs: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """At one temperature no curve takes them: 4.6 sigma on average of all that is drawn, up to 18 within."""
    monkeypatch.setattr("tests.diagnose.few_power_ons.TEMPERATURES", (20.0,))
    found = [
        change
        for seed in range(6)
        for change in residual_changes(unit_fits(few_power_ons(runs, seed), SPEC, NOTHING))
    ]
    assert 0.9 < np.mean([c.weighed_before for c in found]) < 1.1
    assert max(c.weighed_before for c in found) < 1.6
    assert max(c.sigma_before for c in found) < 1.3


def test_draws_that_no_repeat_tells_leave_nothing_of_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each power-on at a temperature of its own: what its scale factor may have drawn was taken off no turn.

    0.79 on average of what the noise model expects, and 7 sigma of units whose scale factors draw nothing.
    """
    monkeypatch.setattr("tests.diagnose.few_power_ons.TEMPERATURES", tuple(np.linspace(-45.0, 55.0, 8)))
    found = [
        change.sigma_before
        for seed in range(4)
        for change in residual_changes(unit_fits(few_power_ons(8, seed), SPEC, NOTHING))
    ]
    assert 0.85 < np.mean(found) < 1.04
    assert max(found) < 1.3


@pytest.mark.parametrize("runs", [5, 8])
def test_noise_that_grows_with_the_input_is_told_by_few_power_ons(runs: int) -> None:
    """One white variance for all gave what the input drives 0.8, and what rests tell 1.5 of its interval."""
    shares, whites = [], []
    for seed in range(4):
        table, _ = by_run(few_power_ons(runs, seed, level=2.0, share=4e-5))
        for found in fit_sensor(table, "gyro", STEADY):
            assert found.noise.known  # the draws of power-ons are the spec's
            theta = dict(zip((c.kind for c in found.noise.components), found.variances.theta, strict=True))
            shares.append(np.sqrt(theta["rate_noise"]))
            mean = np.radians(1e-3) * np.sqrt(60.0 / found.noise.duration)
            whites.append(np.sqrt(theta["white"]) / mean)
    assert np.mean(shares) == pytest.approx(4e-5, rel=0.15)  # each known to some 10 %
    assert np.mean(whites) == pytest.approx(1.0, abs=0.15)


def test_what_the_other_sensor_lacks_shortens_no_interval() -> None:
    """A cubic of the gyro, whose coefficient accelerometers at 1 g cannot tell from their scale factor."""
    hidden = {
        "gyro_z": lambda u, t: 4e-9 * u[:, 2] ** 3,
        "acc_z": lambda u, t: 1e-5 * u[:, 1] * (t - 20.0),
    }
    table = few_power_ons(6, 2, level=1.0, hidden=hidden)
    found = {(e.effect, e.sensor): e for e in diagnose(table, SPEC).effects}
    assert ("scale_factor_nonlinearity", "gyro") in found
    terms = {t.name: t for t in found["misalignment_temperature", "accelerometer"].terms}
    alone = declared_and_found(table, SPEC, "accelerometer", ["misalignment_temperature"], [2])[2].terms
    for name, truth in (("zx", 0.0), ("zy", 1e-5)):
        by_itself = alone["misalignment_temperature", name]
        assert terms[name].low < truth < terms[name].high
        assert terms[name].high - terms[name].low == pytest.approx(by_itself.high - by_itself.low, rel=0.05)
