"""Several power-ons a day: a unit that sat otherwise on one of the days, or before all of its turns."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.records import other_from_run_on as asked
from planner.diagnose.records.changed_power_ons import Span
from planner.diagnose.records.channels_agree import agree
from planner.diagnose.records.put_right import Search
from planner.dwells.table_rows import rows_of
from planner.nouns.array import Array
from planner.nouns.diagnosis import UnitDiagnosis
from tests.diagnose.hall import FACES, RATES, G, Hall, Log, days, read
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped

SPEC = shipped("small_uav").spec
A_DAY = 3  # power-ons


def shifts(seed: int, count: int, turning: Callable[[int], bool]) -> Hall:
    """Power-ons of six faces, or of turns about all axes, at one of three temperatures each."""
    rng, log = np.random.default_rng([seed, 21]), Log()
    for k in range(count * A_DAY):
        log.day = k // A_DAY + 0.3 + 0.08 * (k % A_DAY)
        log.on(rng.uniform(8.0, 50.0))
        degc = [-40.0, 10.0, 60.0][rng.integers(3) if k > 2 else k] + 0.3 * rng.normal()
        for i in rng.permutation(6) if not turning(k) else ():
            log.record(*FACES[i], degc)
        for axis in range(3) if turning(k) else ():
            for turn in RATES:
                log.record(axis, 1.0, degc, turn=turn)
    return log.hall()


def found(hall: Hall, seed: int, runs: Collection[int], theta: Array) -> UnitDiagnosis:
    """What is found where the unit is turned by θ (3,), deg, in some runs."""
    mine = np.isin(hall.run, list(runs))[:, None]

    def of(v: Array) -> Array:
        return v + np.where(mine, np.cross(np.radians(theta), v), 0.0)

    felt = replace(hall, up=of(hall.up), north=of(hall.north), turn=of(hall.turn))
    return diagnose(read(hall, seed, felt=felt), SPEC)


def _one_mounting(told: UnitDiagnosis, theta: Array, said: str) -> None:
    assert not told.effects
    assert not told.unknown
    (suspect,) = told.reference_suspects
    assert (suspect.hypothesis, suspect.unit) == ("mounting", "deg")
    assert said in suspect.check
    size = float(np.linalg.norm(theta))
    assert abs(suspect.value - size) < max(suspect.high - suspect.low, 0.02 * size)  # twice the 95 %


@pytest.mark.parametrize("seed", [402])
@pytest.mark.further("seed", [401, 403, 404])
def test_a_unit_that_sat_otherwise_on_one_day_is_said_with_its_runs(seed: int) -> None:
    """From a power-on on, a part of it was said, and all channels differed over days without a name."""
    hall, theta = shifts(seed, 4, lambda k: k % 3 == 2), np.array([0.12, -0.2, 0.08])
    told = found(hall, seed, range(7, 10), theta)
    _one_mounting(told, theta, "for runs 7 to 9, those of one day: in these it is turned")


@pytest.mark.parametrize("seed", [405])
@pytest.mark.further("seed", [406, 407, 408])
def test_a_unit_that_was_put_back_is_said_with_the_runs_between(seed: int) -> None:
    """It was crooked in three power-ons of two days: the noise had them, or a part was said from one on."""
    hall, theta = shifts(seed, 6, lambda k: k % 3 == 2), np.array([0.12, -0.2, 0.08])
    told = found(hall, seed, range(9, 12), theta)
    _one_mounting(told, theta, "for runs 9 to 11: in these it is turned")
    assert not told.rows_left_out


@pytest.mark.parametrize("seed", [411])
@pytest.mark.further("seed", [412, 413, 414])
def test_turns_that_all_came_after_it_do_not_hide_when_the_unit_was_mounted_anew(seed: int) -> None:
    """Its size was that of the rests alone, as though it had turned in the old mounting."""
    hall, theta = shifts(seed, 4, lambda k: k >= 8), np.array([0.05, -0.12, 0.07])
    _one_mounting(found(hall, seed, range(4, 13), theta), theta, "before run 4: from there on")


@pytest.mark.parametrize("seed", [422])
@pytest.mark.further("seed", [421, 423, 424])
def test_the_one_power_on_of_turns_before_it_is_not_off(seed: int) -> None:
    """Its rows were left out as of another unit, and what the turns after it had were errors of sensors."""
    hall, theta = shifts(seed, 4, lambda k: k in (2, 6, 8, 10)), np.array([-0.03, 0.1, -0.08])
    told = found(hall, seed, range(5, 13), theta)
    _one_mounting(told, theta, "before run 5: from there on")
    assert not told.rows_left_out


@pytest.mark.parametrize("seed", [431])
@pytest.mark.further("seed", [432, 433])
def test_a_unit_that_sat_otherwise_on_the_arm_from_a_power_on_on(seed: int) -> None:
    """It was "clean": the last power-ons with loads were each channel's own spread, 0.6 deg/s of it."""
    table, _ = campaign(seed)
    assert table.ref_acc is not None
    loads = np.linalg.norm(table.ref_acc, axis=1) > 1.5 * G
    arm = np.unique(table.run[loads])
    table = rows_of(table, loads | (table.run <= 20))  # no ramps, and few rests
    assert table.ref_acc is not None
    assert table.ref_rate is not None
    theta = np.radians([0.12, -0.2, 0.08])
    mine = (table.run >= arm[-5])[:, None]

    def said(u: Array) -> Array:
        return np.asarray(u - np.where(mine, np.cross(theta, u), 0.0))

    table = replace(table, ref_acc=said(table.ref_acc), ref_rate=said(table.ref_rate))
    judged = Search(SPEC, 1, lambda _: None).judged(table)
    told = asked.other_from_run_on(judged.found, judged.data, [])
    assert told is not None
    assert told.kind.name == "mounting"
    assert f"before run {arm[-5]}: on the centrifuge, from there on" in told.suspect.check
    assert np.linalg.norm(told.gamma - theta) < 0.05 * np.linalg.norm(theta)


def _said_by(G: Array, coefficients: Array) -> tuple[Array, Array]:
    """What channels (c, k, k) say that have these coefficients (c, k) each, without noise."""
    return G, np.einsum("cij,cj->ci", G, coefficients)


def test_one_channel_that_sees_most_is_believed_where_the_others_say_the_same() -> None:
    """It was refused: most of what a mounting explained was of the one accelerometer that is quiet."""
    G = np.array([np.diag([0.0, 1.0, 1.0]), np.diag([1.0, 0.0, 1.0]), 10.0 * np.diag([1.0, 1.0, 0.0])])
    same = np.array([10.0, -6.0, 8.0])
    assert agree(*_said_by(G, np.tile(same, (3, 1))), 1.0)
    alone = np.array([np.zeros(3), np.zeros(3), same])
    assert not agree(*_said_by(G, alone), 1.0)
    other = np.array([-same, -same, same])
    assert not agree(*_said_by(G, other), 1.0)
    most = np.concatenate([G[:2], 100.0 * G[2:]])
    assert not agree(*_said_by(most, np.tile(same, (3, 1))), 1.0)


@pytest.mark.parametrize(("crooked", "gain"), [(38.0, 14.0), (14.0, 38.0)])
def test_nothing_weaker_is_put_right_where_one_power_on_sat_crooked(
    monkeypatch: pytest.MonkeyPatch, crooked: float, gain: float
) -> None:
    """A gain of the read-out was, by 2e9 of the input, and the crooked power-on stayed as a spread of all."""
    judged = Search(SPEC, 1, lambda _: None).judged(read(days(431, 5), 431))

    def told(kind: asked.Kind, *_: object) -> asked.OtherFromRunOn | None:
        strength = {"mounting": crooked, "mixed_units": gain}.get(kind.name)
        span: Span = "alone" if kind.name == "mounting" else "on"
        runs, gamma = np.array([2]), np.array([1e-3])
        if strength is None:
            return None
        return asked.OtherFromRunOn(kind, runs, span, gamma, 1e-4, (), 0.0, strength, 1.0, 0.0)

    monkeypatch.setattr(asked, "_best", told)
    best = asked.other_from_run_on(judged.found, judged.data, [])
    assert (best is None) == (crooked > gain)
    assert best is None or best.kind.name == "mixed_units"
