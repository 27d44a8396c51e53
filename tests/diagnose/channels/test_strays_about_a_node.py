"""A room strays about its node by more than a chamber does: it is one point of the table all the same."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.temperature_table import fitting_hats, strays_only, temperature_nodes
from tests.diagnose.hall import FACES, G
from tests.specs import shipped

SPEC = shipped("small_uav").spec
RADIUS = 1.5  # m, of the arm
LOADS = (0.0, 10.0, 20.0, 30.0, 40.0)  # g


def _alone(t: Array) -> Array:
    nodes = temperature_nodes(t)
    nearest = np.argmin(np.abs(t[:, None] - nodes), axis=1)
    return strays_only(nodes, nearest, t - nodes[nearest])


def test_a_room_between_two_chamber_points_is_one_point_and_a_sweep_is_none() -> None:
    soaked = np.concatenate([np.full(12, -47.0), np.full(12, 73.0)])
    room = np.concatenate([np.linspace(20.0, 25.8, 40), np.full(40, 22.5)])  # 3.3 K to one side of its middle
    assert _alone(np.concatenate([soaked, room])).all()
    assert not _alone(np.linspace(-40.0, 60.0, 400)).any()
    close = np.concatenate([np.full(12, 12.0), room, np.full(12, 32.0)])  # a quarter of the way to the next
    assert list(_alone(close)) == [True, False, True]
    assert _alone(np.concatenate([soaked, np.full(80, 22.5), [27.7]])).tolist() == [
        True,
        False,
        True,
    ]  # a ramp


def test_weights_of_what_strays_have_no_kink_at_their_node() -> None:
    soaked = np.concatenate([np.full(12, -47.0), np.full(12, 73.0)])
    t = np.concatenate([soaked, np.full(40, 22.5), np.arange(20.0, 25.9, 0.1)])
    weights = fitting_hats(t, temperature_nodes(t), 5.0)[64:]
    assert np.abs(np.diff(weights, 2, axis=0)).max() < 1e-9
    assert weights.sum(axis=1) == pytest.approx(np.ones(len(weights)))


def _rests_and_loads(seed: int) -> DwellTable:
    """Tumbles in a chamber at -47 and 73 °C, loads up to 40 g in a room of 23 ± 1.6 K; scale factors bend."""
    rng = np.random.default_rng([seed, 74])
    rows: list[tuple[float, ...]] = []
    for run in range(26):
        on_arm, degc = run % 13 > 1, (-47.0, 73.0)[run % 2]
        room, axis, t = 23.0 + 1.6 * rng.normal(), run % 3, rng.uniform(20.0, 90.0)
        up = np.eye(3)[(axis + 1) % 3]
        for k in range(15 if on_arm else 12):
            load = LOADS[k % 5] * (1.0 if run % 2 else -1.0) * np.eye(3)[axis]
            face, sign = FACES[k % 6]
            force = load + up if on_arm else sign * np.eye(3)[face]
            rate = np.sqrt(np.linalg.norm(load) * G / RADIUS) * up if on_arm else np.zeros(3)
            rows.append(
                (run + 1, run // 13, t, (room if on_arm else degc) + 0.1 * rng.normal(), *force, *rate)
            )
            t += 35.0
    x = np.array(rows)
    run, degc, force = x[:, 0].astype(int), x[:, 3], x[:, 4:7]
    z = (degc / 60.0)[:, None]
    k = rng.normal(size=(3, 3)) * np.array([2e-3, 3e-3, 2e-3])[:, None]
    scale = 1e-3 + k[0] * z + k[1] * z**2 + k[2] * z**3
    drawn = 5e-5 * rng.normal(size=(3, 27, 3))
    acc = (1.0 + scale + drawn[0, run]) * force + drawn[1, run] + 5e-5 * rng.normal(size=force.shape)
    n = len(x)
    return DwellTable(
        unit=np.full(n, "room"), run=run, day=x[:, 1], time_on=x[:, 2], duration=np.full(n, 30.0),
        temperature_degc=degc, temperature_rate=np.zeros(n), ref_rate=x[:, 7:10], ref_acc=G * force,
        gyro=None, acc=G * acc, bench=np.where((run - 1) % 13 > 1, "arm", "table"),
        source=f"room {seed}",
    )  # fmt: skip


@pytest.mark.parametrize("seed", [6, 7])
@pytest.mark.further("seed", [1, 2, 3, 4, 5, 8])
def test_what_a_room_strays_by_is_nothing_of_the_bench(seed: int) -> None:
    """It was a kink of the table at the room's node: a thermometer off by 32 K, another bench's gravity."""
    found = diagnose(_rests_and_loads(seed), SPEC)
    assert (found.effects, found.unknown, found.reference_suspects) == ((), (), ())
