"""Names that explain as much as each other: the usual size, the lower power, the library before the bench."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.found import LESS_READILY, TIE, best_of
from planner.diagnose.hypotheses.parity import power
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.search.sensor import begin
from planner.protocols import Sensor
from tests.diagnose.hall import read
from tests.diagnose.labs.unit import campaign
from tests.diagnose.search.test_settled_later import late
from tests.specs import shipped

SPEC = shipped("small_uav").spec


@pytest.fixture(scope="module", name="pool_of")
def _pool_of() -> Callable[..., Pool]:
    """Candidates of a campaign on a table and an arm; kept as long as this module's tests."""

    @cache
    def pool(sensor: Sensor, seed: int = 3) -> Pool:
        return begin(prepared(campaign(seed)[0], SPEC.unit), sensor, tuple(SPEC.effects)).pool

    return pool


def _named(pool: Pool, name: str, axis: int = 1) -> list[int]:
    return [i for i, b in enumerate(pool.blocks) if b.name == name and axis in b.columns and not b.generic]


def test_of_two_powers_that_the_records_do_not_tell_apart_the_lower_is_named(
    pool_of: Callable[..., Pool],
) -> None:
    pool = pool_of("gyro")
    (first,), (square,) = (
        _named(pool, n) for n in ("scale_factor_acceleration", "scale_factor_acceleration_squared")
    )
    assert best_of(pool, {first: 100.0, square: 100.0 + 0.5 * TIE}) == first
    assert best_of(pool, {first: 100.0, square: 100.0 + 2.0 * TIE}) == square


def test_of_two_exponentials_the_one_with_its_usual_time_is_named() -> None:
    """The library's settling takes 5 s, its warm-up 600: between 30 and 55 s it is the former."""
    data = prepared(read(late(701), 701), SPEC.unit)
    pool = begin(data, "gyro", tuple(SPEC.effects)).pool
    settling, warming = (
        min(_named(pool, n), key=lambda i: pool.blocks[i].nonlinear["time_constant"])
        for n in ("settling", "warm_up")
    )
    assert pool.blocks[warming].nonlinear["time_constant"] < 40.0
    for more in (-0.5, 0.5):
        assert best_of(pool, {settling: 100.0, warming: 100.0 + more * TIE}) == settling
    assert best_of(pool, {settling: 100.0, warming: 100.0 + 2.0 * TIE}) == warming


def test_a_lever_arm_is_the_librarys_where_the_table_alone_has_it_no_better(
    pool_of: Callable[..., Pool],
) -> None:
    pool = pool_of("accelerometer")
    (own,), (table,) = (_named(pool, n) for n in ("lever_arm", "lever_arm_on_the_table"))
    assert best_of(pool, {own: 100.0, table: 100.0 + 0.9 * LESS_READILY}) == own
    assert best_of(pool, {own: 100.0, table: 100.0 + 1.1 * LESS_READILY}) == table


@pytest.mark.parametrize(
    ("name", "degree"),
    [("g_sensitivity", 1), ("g_squared_sensitivity", 2), ("scale_factor_acceleration", 2),
     ("scale_factor_acceleration_squared", 3), ("scale_factor_nonlinearity", 3), ("drift", 0)],
)  # fmt: skip
def test_powers_are_those_of_the_equations(pool_of: Callable[..., Pool], name: str, degree: int) -> None:
    pool = pool_of("gyro")
    assert power(pool, _named(pool, name)[0]) == pytest.approx(degree, abs=1e-3)
