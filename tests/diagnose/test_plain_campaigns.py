"""The plan's own campaign gives no alarm: what wanders within power-ons is no effect."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose import records
from planner.diagnose.hypotheses.prepared import prepared
from planner.diagnose.hypotheses.sensor import diagnose_sensor
from planner.diagnose.hypotheses.verdicts import _scatter
from planner.diagnose.records import screened
from planner.pipelines.data import simulate
from planner.simulate.settings import settings_of
from planner.spec.load import load_spec
from tests.diagnose.labs.unit import campaign
from tests.specs import SHIPPED


@pytest.mark.parametrize("seed", [6, 20, 42])
def test_what_wanders_within_power_ons_is_no_effect(seed: int) -> None:
    """At 5.3 to 6.2 sigma of white noise it had been asymmetry or drift of an accelerometer."""
    unit = load_spec(SHIPPED / "small_uav.yaml")
    table, _ = simulate(unit, None, (), seed, settings_of(unit.spec))
    found = diagnose_sensor(prepared(table), "accelerometer", tuple(unit.spec.effects), 1)
    assert found.found.all == []
    assert any("scatter" in veto.why for veto in found.refused)


def test_scatter_is_judged_as_often_as_it_says() -> None:
    """Contrasts whose own variance is four times what the noise model says: p stays uniform."""
    rng = np.random.default_rng(5)
    gram = rng.uniform(0.5, 1.5, size=(25, 1, 1))
    p = np.array(
        [_scatter(gram, 2.0 * np.sqrt(gram[:, :, 0]) * rng.normal(size=(25, 1))) for _ in range(2000)]
    )
    for level in (0.01, 0.05, 0.2, 0.5):
        assert np.mean(p < level) == pytest.approx(level, abs=4.0 * np.sqrt(level / 2000))
    assert _scatter(gram, 1.0 + np.sqrt(gram[:, :, 0]) * rng.normal(size=(25, 1))) < 1e-2


def test_another_unit_is_seen_in_some_of_very_many_power_ons(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows between the last judged power-on of this unit and the first of the other are not judged either."""
    table, _ = campaign(1, fault="mixed_units")
    whole = screened(table)
    monkeypatch.setattr(records, "MOST_ROWS", len(table) // 2)
    monkeypatch.setattr(records, "LEAST_OF_MANY", 20)
    some = screened(table)
    assert [s.hypothesis for s in whole.suspects] == [s.hypothesis for s in some.suspects] == ["mixed_units"]
    assert not np.any(some.kept & ~whole.kept)
    assert len(set(table.run[whole.kept]) - set(table.run[some.kept])) <= 4
