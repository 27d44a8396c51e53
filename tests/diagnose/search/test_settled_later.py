"""What settles within a minute of power-on, in records that begin later than that: told, and by its name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.diagnosis import FoundEffect
from tests.diagnose.hall import FACES, Hall, Log, hidden, read
from tests.diagnose.worlds import whole

OF_THREE_SIGMA = (
    1.7  # of the interval of 95 %, as a logarithm: one of twenty is outside, one of a thousand here
)


def late(seed: int, power_ons: int = 30) -> Hall:
    """Rests on six faces that begin half a minute after power-on, and turns."""
    rng, log = np.random.default_rng([seed, 72]), Log()
    for k in range(power_ons):
        log.on(rng.uniform(20.0, 35.0))
        degc = (-40.0, 20.0, 60.0)[k % 3] + 0.3 * rng.normal()
        for i in rng.permutation(6):
            log.record(*FACES[i], degc)
        for axis in range(3):
            for turn in (-180.0, 180.0):
                log.record(axis, 1.0, degc, turn=turn)
        log.day += rng.uniform(0.1, 0.5)
    return log.hall()


def _found(seed: int, time_constant: float, at_first: float) -> FoundEffect:
    """at_first: deg/s that are left when the first record begins."""
    hall = late(seed)
    size = at_first * np.exp(50.0 / time_constant)
    table = hidden(read(hall, seed), "gyro", seed % 3, -size * np.exp(-hall.time_on / time_constant))
    (effect,) = whole(replace(table, acc=None)).effects
    return effect


@pytest.mark.parametrize(("seed", "tau"), [(701, 16.0), (702, 25.0)])
@pytest.mark.further(("seed", "tau"), [(703, 18.0), (704, 20.0), (705, 25.0)])
def test_what_is_over_in_a_minute_is_a_settling_of_its_own_size(seed: int, tau: float) -> None:
    """It was a warm-up of the shortest time constant that one may have.

    A fit of records that hardly see it holds the time constant at 5 s, and told 2.0 to 2.3 deg/s of 0.09.
    """
    effect = _found(seed, tau, 4e-3)
    (term,) = [t for t in effect.terms if not t.parameter]
    assert effect.effect == "settling"
    off = float(np.log(np.radians(4e-3 * np.exp(50.0 / tau)) / term.value))
    assert abs(off) <= OF_THREE_SIGMA * abs(np.log((term.high if off > 0.0 else term.low) / term.value))


@pytest.mark.parametrize("tau", [45.0, 200.0])
def test_a_curve_with_two_names_has_the_other_for_a_rival_and_a_slow_one_has_not(tau: float) -> None:
    effect = _found(711, tau, 4e-3)
    names = {effect.effect, *(r.effect for r in effect.rivals)}
    assert "warm_up" in names
    assert ("settling" in names) == (tau < 60.0)


@pytest.mark.parametrize(("seed", "tau"), [(713, 44.0), (718, 45.0), (727, 41.0)])
@pytest.mark.further(("seed", "tau"), [(740, 33.0), (722, 41.0), (724, 49.0)])
def test_of_one_curve_with_two_names_the_time_that_it_takes_tells_the_likelier(seed: int, tau: float) -> None:
    """Rounding told: of five settlings of 30 to 45 s among two hundred effects all five were warm-ups."""
    assert _found(seed, tau, 4e-3).effect == "settling"
