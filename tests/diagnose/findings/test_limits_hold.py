"""What a diagnosis calls "no larger than", hidden three times as large: found, or the limit holds it."""

from __future__ import annotations

from functools import cache

import pytest

from planner import catalog
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.evidence_veto import limits_that_stand
from planner.nouns.diagnosis import NotFound, UnitDiagnosis, Unknown
from planner.pipelines.data import simulate
from planner.simulate.settings import settings_of
from planner.units import from_si
from tests.specs import shipped

UNIT = shipped("small_uav")
TIMES = 3.0


@cache
def found(seed: int, *hidden: str) -> UnitDiagnosis:
    """The campaign of small_uav's tests: six faces and turns at -60, -30 … 60 °C, in that order."""
    table, _ = simulate(UNIT, None, hidden, seed, settings_of(UNIT.spec))
    return diagnose(table, UNIT.spec)


@pytest.mark.parametrize(
    ("effect", "seed"),
    [
        ("hysteresis", 1),  # its limit was that of an effect at rest alone, a seventieth of its own
        ("settling", 1),
    ],
)
@pytest.mark.further(
    ("effect", "seed"),
    [
        *[(e, s) for e in ("hysteresis", "settling") for s in (2, 3)],
        *[(e, s) for e in ("g_sensitivity", "scale_factor_asymmetry", "earth_rate") for s in (1, 2)],
    ],
)
def test_a_limit_holds_what_it_denies(effect: str, seed: int) -> None:
    """Of its three channels at least the one that has the whole size, at the parameters that are told."""
    limit = next(n for n in found(seed).not_found if (n.effect, n.sensor) == (effect, "gyro"))
    size = TIMES * limit.upper_limit
    at = "".join(f",{name}={value:.9g} s" for name, value in limit.nonlinear.items())
    after = found(seed, f"gyro.{effect}={from_si(size, limit.unit):.9g} {limit.unit}{at}")
    held = [n.upper_limit for n in after.not_found if (n.effect, n.sensor) == (effect, "gyro")]
    assert effect in _told(after) or all(limit > 0.9 * size for limit in held)


def _told(diagnosis: UnitDiagnosis) -> set[str]:
    """Effects, their rivals, and what a suspected reference cannot be told from."""
    named = {name for e in diagnosis.effects for name in (e.effect, *(r.effect for r in e.rivals))}
    return named | {r.alias for r in diagnosis.reference_suspects}


@pytest.mark.parametrize("seed", [2])
@pytest.mark.further("seed", [5, 6])
def test_a_suspected_bench_leaves_no_limit_on_its_alias(seed: int) -> None:
    """Three asymmetries alike are a table's rate or theirs; "no larger than half of them" stood beside it."""
    alike = [f"gyro.scale_factor_asymmetry.{a}=2.7e-5 1" for a in "xyz"]
    after = found(seed, *alike)
    assert {r.alias for r in after.reference_suspects} == {"scale_factor_asymmetry"}
    why = next(u.why for u in after.untestable if (u.effect, u.sensor) == ("scale_factor_asymmetry", "gyro"))
    assert "table rate" in why
    assert "timed against a clock" in why
    assert "scale_factor_asymmetry" not in {n.effect for n in after.not_found if n.sensor == "gyro"}


@pytest.mark.parametrize("seed", [3])
@pytest.mark.further("seed", [7, 8])
def test_a_rate_that_is_off_at_one_speed_is_the_gyros_common_curve(seed: int) -> None:
    """It was called one with their scale factor, which the declared model has, at any size."""
    unit = shipped("tactical_leg")
    alike = [f"gyro.scale_factor_nonlinearity.{a}=3e-5 1" for a in "xyz"]
    table, _ = simulate(unit, None, alike, seed, settings_of(unit.spec))
    after = diagnose(table, unit.spec)
    assert {r.alias for r in after.reference_suspects} == {"scale_factor_nonlinearity"}
    assert "scale_factor_nonlinearity" not in {n.effect for n in after.not_found if n.sensor == "gyro"}


def test_no_limit_stands_beside_what_may_be_the_effect() -> None:
    """Something over the time since power-on on a gyro may be its settling, and is no accelerometer's."""
    limits = tuple(
        NotFound(effect, sensor, 1e-4, catalog.effects()[effect].units[sensor])
        for effect in ("settling", "hysteresis")
        for sensor in ("gyro", "accelerometer")
    )
    unknown = (Unknown(("gyro_x",), "time_on", 1e-9, 9.0),)
    after = limits_that_stand(UnitDiagnosis("u", "unexplained", (), unknown, limits, (), (), ()))
    stands = {(n.effect, n.sensor) for n in after.not_found}
    assert stands == {("settling", "accelerometer"), ("hysteresis", "gyro"), ("hysteresis", "accelerometer")}
    (gone,) = after.untestable
    assert (gone.effect, gone.sensor) == ("settling", "gyro")
    assert "gyro_x" in gone.why


def test_a_limit_of_some_terms_names_them() -> None:
    """Of eighteen products of rates these records tell three, which stood for all of them."""
    limits = {(n.effect, n.sensor): n for n in found(1).not_found}
    some = limits["cross_coupling", "gyro"].terms
    assert some == ("yxx", "yyy", "yzz")
    assert limits["scale_factor_asymmetry", "gyro"].terms == ()  # of all
