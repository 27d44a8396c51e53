"""What an arm bends by comes to each channel through the unit's own leans and scale factor.

Of 3 deg/s that a bent arm adds to a gyro across it, a misalignment of 0.25 deg carries 0.013 deg/s to the
next one: a load curve of its own beside the arm where the product is left out.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner import catalog
from planner.campaign.channel_model import channel_model
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.measurement import evaluate, jacobian
from planner.nouns.conditions import Conditions
from planner.response import Acting, response, true_input
from planner.units import STANDARD_GRAVITY_MPS2 as G
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped

SPEC = shipped("small_uav").spec
DECLARED = ("bias", "scale_factor", "misalignment", "arm_bending")


@pytest.mark.parametrize("seed", [3])
@pytest.mark.further("seed", [1, 2, 4, 5])
def test_a_bent_arm_leaves_nothing_beside_it(seed: int) -> None:
    table, _ = campaign(seed, fault="arm_bending", strength=2.0)
    found = diagnose(table, SPEC)
    assert {e.effect for e in found.effects} == {"arm_bending"}
    assert len({c for e in found.effects for c in e.channels}) == 6
    assert not found.unknown
    assert not found.reference_suspects


def arm(seed: int) -> Conditions:
    """Forty records on an arm at 2 to 50 g, each body axis up and outwards in turn."""
    rng = np.random.default_rng(seed)
    n, k = 40, np.arange(40)
    up, out = np.eye(3)[k % 3], np.eye(3)[(k + 1 + k // 3 % 2) % 3] * (-1.0) ** (k // 6)[:, None]
    load = rng.uniform(2.0, 50.0, n)[:, None] * G
    return Conditions(
        rate=np.sqrt(load / 1.5) * up,
        specific_force=G * up + load * out,
        temperature_degc=np.full(n, 20.0),
        temperature_rate=np.zeros(n),
        time_on=60.0 + 30.0 * k,
        day=np.zeros(n),
    )


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_channel_reads_the_bent_input_through_its_row_of_the_leans(seed: int, axis: int) -> None:
    """y = (1 + κ) M (u + θ × u) + b by dense algebra, and its slopes by differences."""
    here, rng = arm(seed), np.random.default_rng([seed, axis])
    model = channel_model("gyro", axis, here, DECLARED)
    names = [(c.effect, c.term) for c in model.columns()]
    theta = rng.normal(size=len(names)) * [1e-6 / G if e == "arm_bending" else 5e-3 for e, _ in names]
    at = {name: float(t) for name, t in zip(names, theta, strict=True)}
    letter, u = "xyz"[axis], here.rate
    up = u / np.linalg.norm(u, axis=1, keepdims=True)
    load = here.specific_force - up * np.sum(up * here.specific_force, axis=1, keepdims=True)
    about = np.cross(up, load)
    turn = at["arm_bending", "arm"] * about + at["arm_bending", "face"] * np.abs(about)
    row = np.array([1.0 if j == axis else at["misalignment", letter + "xyz"[j]] for j in range(3)])
    read = (1.0 + at["scale_factor", letter]) * ((u + np.cross(turn, u)) @ row) + at["bias", letter]
    parts = evaluate(model, theta)
    np.testing.assert_allclose(parts.predicted, read, rtol=1e-12, atol=1e-15)
    J = jacobian(model, theta, parts)
    for i in range(len(theta)):
        step = np.where(np.arange(len(theta)) == i, np.abs(theta), 0.0)
        ahead, back = (evaluate(model, theta + s).predicted for s in (step, -step))
        slope = (ahead - back) / (2.0 * np.abs(theta[i]))
        np.testing.assert_allclose(J[:, i], slope, rtol=1e-9, atol=1e-7 * np.abs(slope).max())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_is_simulated_goes_through_the_leans_and_back(seed: int) -> None:
    here, rng = arm(seed), np.random.default_rng(seed)
    known = catalog.effects()
    acting = [
        Acting(known[name], rng.normal(size=len(known[name].terms("gyro"))) * size)
        for name, size in (("misalignment", 5e-3), ("scale_factor", 5e-3), ("arm_bending", 1e-6 / G))
    ]
    y = response("gyro", here, acting)
    u = here.rate
    bent = u + known["arm_bending"].regressors("gyro", here) @ acting[2].values
    lean = np.eye(3)
    terms = [t.name for t in known["misalignment"].terms("gyro")]
    for name, value in zip(terms, acting[0].values, strict=True):
        lean["xyz".index(name[0]), "xyz".index(name[1])] = value
    np.testing.assert_allclose(y, (bent @ lean.T) * (1.0 + acting[1].values), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(true_input("gyro", y, here, acting), u, rtol=1e-9, atol=1e-9)
