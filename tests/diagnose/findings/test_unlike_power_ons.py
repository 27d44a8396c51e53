"""Power-ons that differ in how the unit stood are a finding, though the noise has taken them up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.findings.unlike_power_ons import OF_LEANS as LEANS
from planner.diagnose.findings.unlike_power_ons import of_their_power_ons
from tests.diagnose.found import found_effect
from tests.diagnose.hall import Hall, chamber, days, read
from tests.diagnose.worlds import whole


def _turned(hall: Hall, angles: np.ndarray) -> Hall:
    """angles: (n, 3) rad by which the unit stood otherwise than is written."""
    return replace(
        hall,
        up=hall.up + np.cross(angles, hall.up),
        north=hall.north + np.cross(angles, hall.north),
        turn=hall.turn + np.cross(angles, hall.turn),
    )


@pytest.mark.parametrize(("seed", "hall"), [(2, days(2, 20)), (3, chamber(3, 6))])
@pytest.mark.further(("seed", "hall"), [(1, chamber(1, 5))])
def test_a_unit_that_is_clamped_anew_in_every_power_on(seed: int, hall: Hall) -> None:
    """The verdict was that nothing is missing, beside six budgets that were exceeded by hundreds."""
    rng = np.random.default_rng([seed, 91])
    angles = np.radians(0.15) * rng.normal(size=(int(hall.run.max()) + 1, 3))[hall.run]
    found = whole(read(hall, seed, felt=_turned(hall, angles)))
    assert found.verdict in ("explained", "partly_explained")
    assert not found.effects
    assert {s.hypothesis for s in found.reference_suspects} == {"mounting"}


@pytest.mark.parametrize(("seed", "hall"), [(11, chamber(11, 5)), (12, days(12, 20))])
def test_a_unit_that_stays_clamped(seed: int, hall: Hall) -> None:
    """Twice its budget of a turn-on change of misalignments is one that was meant too well."""
    rng = np.random.default_rng([seed, 92])
    angles = np.radians(2e-3) * rng.normal(size=(int(hall.run.max()) + 1, 3))[hall.run]
    found = whole(read(hall, seed, felt=_turned(hall, angles)))
    assert not found.reference_suspects


def test_days_and_temperatures_of_their_own_tell_nothing_of_unlike_power_ons() -> None:
    """Of power-ons that come back to a temperature, leans over it are told; days tell nothing either way."""
    several = [found_effect(e, "gyro_x", 1e-4, 1e-5) for e in ("bias_step", "g_sensitivity", LEANS)]
    for hall, stays in ((days(21, 20), ["g_sensitivity", LEANS]), (days(21, 5), ["g_sensitivity"])):
        effects, falls = of_their_power_ons(several, prepared(read(hall, 21)))
        assert [e.effect for e in effects] == stays
        assert {r.effect for r in falls} == {e.effect for e in several} - set(stays)
