"""What a base that leans does to parts of turns, against the turn itself, and in a plan's own campaign."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.references.tilt_in_turns import AXES, COLUMNS, tilted_turns
from planner.effects._bench_frame import load
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable
from planner.pipelines.data import simulate
from planner.simulate.settings import settings_of
from planner.solvers.distributions import TWO_SIDED
from planner.spec.model import Spec
from planner.units import STANDARD_GRAVITY_MPS2
from tests.specs import SHIPPED, loaded


def mean_force(axis: int, rate: float, duration: float, up: Array, lean: Array) -> Array:
    """(3,) g in body axes: a body that turns about its own axis from an attitude where `up` is up.

    lean: (3,) rad, added to what is up on the base; all in body axes of the beginning, which are the base's
    """
    angles = rate * duration * (np.arange(20_000) + 0.5) / 20_000
    turned = Rotation.from_rotvec(angles[:, None] * np.eye(AXES)[axis])
    return np.asarray(turned.inv().apply(up + lean).mean(axis=0))


def conditions(rate: Array, force: Array) -> Conditions:
    nothing = np.zeros(len(rate))
    return Conditions(rate, force * STANDARD_GRAVITY_MPS2, nothing + 20.0, nothing, nothing + 60.0, nothing)


@pytest.mark.parametrize("axis", range(AXES))
@pytest.mark.parametrize("upright", [True, False])
def test_columns_have_what_a_lean_does_to_turns_either_way(axis: int, upright: bool) -> None:
    rng = np.random.default_rng([axis, upright])
    up = np.eye(AXES)[axis if upright else (axis + 1) % AXES]
    lean = rng.normal(size=3) * (1.0 - up)
    turns = [(sign * rng.uniform(0.1, 6.0), rng.uniform(0.5, 9.0)) for sign in (1.0, -1.0) for _ in range(4)]
    level = np.array([mean_force(axis, *turn, up, np.zeros(3)) for turn in turns])
    wanted = np.array([mean_force(axis, *turn, up, lean) for turn in turns]) - level
    rate = np.array([w * np.eye(AXES)[axis] for w, _ in turns])
    seen = conditions(rate, level)
    assert not load(seen).any()  # a part of a turn about a level axis is no centrifuge
    columns = np.stack(tilted_turns(seen, np.array([t for _, t in turns]), parts=True), axis=2)
    assert columns.shape == (len(turns), AXES, COLUMNS)
    flat = columns.reshape(-1, COLUMNS)
    size, *_ = np.linalg.lstsq(flat, wanted.ravel(), rcond=None)
    np.testing.assert_allclose(flat @ size, wanted.ravel(), atol=1e-6)
    assert np.count_nonzero(np.abs(flat).max(axis=0) > 0.0) == 2  # lean's two, whichever way it points


def test_whole_turns_leave_what_is_along_a_level_axis_alone() -> None:
    rate, duration = np.array([[np.pi, 0.0, 0.0], [0.0, 0.0, np.pi]]), np.array([4.0, 4.0])
    columns = tilted_turns(conditions(rate, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])), duration, True)
    assert [k for k, one in enumerate(columns) if np.abs(one).max() > 1e-9] == [0]


def tilted(seed: int, rests: bool) -> tuple[Spec, DwellTable, float]:
    """The spec of a table that turns by 100 deg in a record, level to 0.03 deg; a campaign; its lean, deg."""
    tree = yaml.safe_load((SHIPPED / "tactical_leg.yaml").read_text(encoding="utf-8"))
    tree["benches"]["rate_table"]["accuracy"] = {"level": "0.03 deg"}
    turns = tree["tests"]["rates"] | {"record": "10 s"}
    if rests:
        tree["tests"]["rates"] = turns
    else:
        every = [*turns["calibrates"], *tree["tests"]["static"]["calibrates"]]
        tree["tests"] = {"rates": turns | {"calibrates": every}}
    spec = loaded(tree)
    table, truth = simulate(spec, None, (), seed, settings_of(spec.spec))
    lean = np.hypot(*(truth.references[f"rate_table.level_{axis}"] for axis in "xy"))
    return spec.spec, replace(table, gyro=None), float(np.degrees(lean))


@pytest.mark.parametrize(("seed", "rests"), [(1, False), (2, True)])
@pytest.mark.further(("seed", "rests"), [(seed, rests) for seed in (3, 4, 5) for rests in (False, True)])
def test_a_base_that_leans_as_stated_is_no_unknown_over_the_time_since_power_on(
    seed: int, rests: bool
) -> None:
    """Every one of 30 campaigns of such a plan had two accelerometers that vary with time since power-on."""
    spec, table, lean = tilted(seed, rests)
    found = diagnose(table, spec)
    assert not found.effects
    assert not found.unknown
    assert found.verdict == "clean"
    (suspect,) = found.reference_suspects  # not silent: noise had taken it up where nothing rests
    assert suspect.hypothesis == "base_tilt"
    assert suspect.expected
    sigma = (suspect.high - suspect.low) / (2.0 * TWO_SIDED)
    assert abs(suspect.value - lean) <= 3.3 * sigma
