"""A name whose form the records do not test stands beside its variable, and one record makes no name."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.hypotheses.found import Found, Question
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.vetoes import forms
from planner.diagnose.vetoes.forms import _over
from planner.dwells.table_rows import rows_of
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.labs.shapes import Hidden
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped


def gyros(seed: int, name: str, strength: float) -> DwellTable:
    """Gyros at rest and turned, one of them with an effect of the library."""
    table, _ = campaign(seed, Hidden(name, "gyro_x", strength), centrifuge=False)
    return replace(rows_of(table, table.temperature_rate == 0.0), acc=None)


def found_on(table: DwellTable) -> UnitDiagnosis:
    return diagnose(table, shipped("small_uav").spec)


def rivals(found: UnitDiagnosis, name: str) -> set[str]:
    (effect,) = found.effects
    assert effect.effect == name
    return {r.effect for r in effect.rivals}


@pytest.mark.parametrize("seed", [94001])
@pytest.mark.further("seed", [94002, 94003, 94004])
def test_two_rates_show_one_odd_shape_whatever_it_is(seed: int) -> None:
    """A saturation, a dead zone and a cubic all were the cubic, with nothing beside it."""
    table = gyros(seed, "scale_factor_nonlinearity", 200.0)
    assert table.ref_rate is not None
    size = np.degrees(np.linalg.norm(table.ref_rate, axis=1))
    levels = np.unique(np.round(size[size > 1.0], 0))

    def found_at(some: list[int]) -> set[str]:
        """Rivals by the records at rest and at some of the six rates."""
        kept = (size < 1.0) | np.isin(np.round(size, 0), levels[some])
        return rivals(found_on(rows_of(table, kept)), "scale_factor_nonlinearity")

    assert "rate" not in found_at([0, 2, 3, -1])
    assert "rate" in found_at([0, -1])


@pytest.mark.parametrize(("seed", "strength", "tested"), [(94011, 60.0, True), (94012, 7.0, False)])
@pytest.mark.further(
    ("seed", "strength", "tested"), [(94012, 60.0, True), *((94013, t, t > 10.0) for t in (60.0, 7.0))]
)
def test_a_faint_line_over_the_days_may_be_any_course(seed: int, strength: float, tested: bool) -> None:
    """A square root of the days was an ageing of 17 sigma."""
    table = gyros(seed, "ageing", np.sqrt(2.0) * strength)
    some = rows_of(table, table.run % 2 == 0)  # every second power-on tells as much, and has all the days
    assert ("day" not in rivals(found_on(some), "ageing")) is tested


@pytest.mark.parametrize("seed", [94021])
@pytest.mark.further("seed", [94022, 94023, 94024, 94025])
def test_a_digit_lost_in_one_record_is_no_effect(seed: int) -> None:
    """A step of the bias between two records of a power-on was 43 sigma, all of it one reading."""
    table, _ = campaign(seed, centrifuge=False)
    still = np.linalg.norm(table.ref_rate, axis=1) < np.radians(0.1) if table.ref_rate is not None else True
    table = replace(rows_of(table, still & (table.temperature_rate == 0.0)), gyro=None)
    day = table.day + table.time_on / 86400.0
    assert table.acc is not None
    assert table.ref_acc is not None
    level = np.flatnonzero(np.abs(table.ref_acc[:, 0]) < 1.0)
    acc = table.acc.copy()
    acc[level[len(level) // 2], 0] += 0.06
    found = found_on(replace(table, day=day, acc=acc))
    assert not found.effects
    assert found.rows_left_out


def test_several_names_of_one_variable_give_way_to_another_that_says_decisively_more() -> None:
    """A rate that saturates was a scale factor over the load and over its square, and then the force."""
    names = ("specific_force", "rate", "specific_force", "time_on_and_rate")
    pool = cast(Pool, SimpleNamespace(blocks=[SimpleNamespace(name=name) for name in names]))
    assert _over(pool, {0: 434.7, 1: 683.2, 2: 377.5, 3: 594.6}, "specific_force") == 1
    assert _over(pool, {0: 675.0, 1: 683.2, 2: 377.5}, "specific_force") == 0
    assert _over(pool, {1: 683.2}, "specific_force") == 1
    assert _over(pool, {}, "specific_force") is None


@pytest.mark.parametrize(("own", "other", "stands"), [(0.4, 92.1, 2), (85.0, 92.1, 1)])
def test_a_name_and_its_variable_that_cancel_are_a_course_over_another_one(
    own: float, other: float, stands: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cubic and a curve over the force, eleven sigma beside each other, gave way to one of 0.4 sigma."""
    names = ("scale_factor_nonlinearity", "specific_force", "rate")
    blocks = [SimpleNamespace(name=n, columns={1: None}) for n in names]
    found = SimpleNamespace(
        pool=SimpleNamespace(blocks=blocks), library=[0], unknown=[1], on=lambda _: [0],
        others=lambda *_: [], share=lambda _: SimpleNamespace(delta=116.0), stands_for=lambda *_: None,
    )  # fmt: skip
    told = {1: own, 2: other}
    monkeypatch.setattr(forms, "given", lambda pool, _: pool)
    monkeypatch.setattr(forms, "score", lambda _, g: SimpleNamespace(criterion=told[g[0]]))
    monkeypatch.setattr(forms, "along", lambda *_: "specific_force")
    monkeypatch.setattr(forms, "_is_asked", lambda *_: True)
    question = SimpleNamespace(generic=(1, 2))
    forms._one_variable_for_a_name_and_its_own(cast(Found, found), 1, cast(Question, question))
    assert (found.library, found.unknown) == ([], [stands])
