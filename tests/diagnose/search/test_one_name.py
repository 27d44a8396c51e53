"""What one channel has the others of its sensor are likely to have as well."""

from __future__ import annotations

import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.hypotheses.found import ALIKE, Found
from planner.diagnose.search.sensor import begin
from planner.pipelines.data import simulate
from planner.simulate.settings import settings_of
from planner.spec.load import load_spec
from tests.diagnose.hall import axes_apart, read
from tests.diagnose.worlds import DECLARED
from tests.specs import SHIPPED


def test_a_name_is_owed_something_by_another_channel_that_has_it() -> None:
    pool = begin(prepared(read(axes_apart(111), 111)), "gyro", DECLARED).pool
    of = {b.key: i for i, b in enumerate(pool.blocks) if not b.generic}
    drift = of["drift", (0,)]
    found = Found(pool, [drift], [])
    assert found.alike(of["drift", (1,)], found.library) == ALIKE
    assert found.alike(drift, found.library) == 0.0  # it has itself
    assert found.alike(of["scale_factor_asymmetry", (1,)], found.library) == 0.0
    assert found.alike(of["earth_rate", (0, 1, 2)], found.library) == 0.0
    unnamed = next(i for i, b in enumerate(pool.blocks) if b.generic)
    assert found.alike(unnamed, [*found.library, unnamed]) == 0.0


@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [12, *range(13, 19)])
def test_three_gyros_that_drift_have_one_name(seed: int) -> None:
    """Beside what wanders within power-ons a drift is as well an exponential: each had a name for itself."""
    unit = load_spec(SHIPPED / "close_the_loop.yaml")
    table, truth = simulate(unit, None, ("drift=0.00001deg/s/s",), seed, settings_of(unit.spec))
    found = diagnose(table, unit.spec)
    assert len({e.effect for e in found.effects}) == 1
    sizes = {f"gyro_{a}": abs(truth.at("gyro.drift", a, 20.0)) for a in "xyz"}
    large = {c for c, size in sizes.items() if size > 0.2 * max(sizes.values())}
    assert large <= {c for e in found.effects for c in e.channels}
    assert not found.unknown
