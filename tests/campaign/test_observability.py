"""What a campaign leaves unobservable: against the row space of dense columns, and by its laws."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.campaign.model import Campaign, campaign
from planner.campaign.observability import Unobservable, unobservable
from planner.campaign.power_ons import PowerOns
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import ErrorName
from planner.spec.model import Spec
from tests.campaign.campaigns import spec_with
from tests.plugins.installing import Installed

G = 9.80665
FACES = [sign * np.eye(3)[axis] for axis in range(3) for sign in (1.0, -1.0)]
NODES = (-40.0, 10.0, 60.0)
BIAS, SCALE = ErrorName("accelerometer.bias"), ErrorName("accelerometer.scale_factor")
BOTH = (BIAS, SCALE)
Made = list[tuple[float, tuple[int, ...]]]  # of every power-on its temperature and faces


def spec(
    effects: tuple[str, ...] = ("bias", "bias_temperature", "scale_factor", "scale_factor_temperature"),
) -> Spec:
    size = {"bias": {"systematic": "20 mg", "run_to_run": "1 mg"}}
    scale = {"scale_factor": {"systematic": "0.5 %", "run_to_run": "0.002 %"}}
    gyro = {"bias": {"systematic": "0.03 deg/s", "run_to_run": "0.002 deg/s"}}
    return spec_with(gyro, size | scale).model_copy(update={"effects": effects})


def rests(made: Made) -> PowerOns:
    """Power-ons at rest on some faces, every record of 60 s; at least eight of them, by repeating all."""
    made = made * 8
    n = [len(faces) for _, faces in made]
    force = np.array([G * FACES[f] for _, faces in made for f in faces])
    still = np.zeros((len(force), 3))
    warm = np.repeat([t for t, _ in made], n)
    on = np.concatenate([60.0 * np.arange(1, k + 1) for k in n])
    conditions = Conditions(still, force, warm, np.zeros(len(force)), on, np.zeros(len(force)))
    starts = np.concatenate([[0], np.cumsum(n)[:-1]]).astype(np.int64)
    return PowerOns(conditions, np.full(len(force), 60.0), starts, np.ones(len(made)))


def of(made: Made, **changes: tuple[str, ...]) -> Campaign:
    return campaign(spec(**changes), rests(made))


def named(found: tuple[Unobservable, ...]) -> set[tuple[str, str, float]]:
    return {(u.error.effect, u.term, node) for u in found for node in u.nodes_degc}


def test_six_faces_at_every_temperature_tell_everything() -> None:
    assert unobservable(of([(t, tuple(range(6))) for t in NODES]), BOTH) == ()


def test_one_face_at_most_temperatures_and_six_at_one_tell_that_one() -> None:
    """What the starter once did: each test alone looks as if it could."""
    found = unobservable(of([(t, (4,)) for t in NODES] + [(10.0, tuple(range(6)))]), BOTH)
    assert named(found) == set(product(("bias", "scale_factor"), "z", (-40.0, 60.0)))
    assert {u.partners for u in found if u.error == BIAS} == {(SCALE,)}
    assert {u.partners for u in found if u.error == SCALE} == {(BIAS,)}
    assert not any(u.everywhere for u in found)


def test_an_axis_that_is_never_loaded_has_nothing_to_be_mixed_up_with() -> None:
    found = unobservable(of([(t, (4, 5)) for t in NODES]), BOTH)
    assert {(u.error, u.term, u.partners) for u in found} == {(SCALE, "x", ()), (SCALE, "y", ())}
    assert all(u.everywhere for u in found)


def test_only_what_is_asked_is_named() -> None:
    made = of([(t, (4,)) for t in NODES])
    assert {u.error for u in unobservable(made, (BIAS,))} == {BIAS}
    assert unobservable(made, ()) == ()
    assert {u.error for u in unobservable(made, (BIAS,), without=(SCALE,))} == set()


kinds = st.tuples(
    st.sampled_from(NODES), st.sets(st.integers(0, 5), min_size=1).map(lambda f: tuple(sorted(f)))
)


@settings(max_examples=40, deadline=None)
@given(made=st.lists(kinds, min_size=1, max_size=5))
def test_it_is_the_row_space_of_the_columns(made: Made) -> None:
    """Each face shows b + s·g k: bias and scale factor of a channel at a node need two readings that differ.

    Worked out by hand: a channel's loads at a node are the signs of its faces, 0 for the others. Channels
    without a load at a node have no node of the scale factor there, so that b alone is asked.
    """
    wanted = set()
    for channel, axis in enumerate("xyz"):
        loads = {t: {_load(f, channel) for at, faces in made for f in faces if at == t} for t, _ in made}
        loaded = {t for t, seen in loads.items() if seen != {0.0}} or set(loads)
        for t, seen in loads.items():
            if t in loaded and len(seen) < 2:
                wanted |= {("scale_factor", axis, t)}
                wanted |= {("bias", axis, t)} if seen != {0.0} else set()
    assert named(unobservable(of(made), BOTH)) == wanted


def _load(face: int, channel: int) -> float:
    return float(FACES[face][channel])


@settings(max_examples=30, deadline=None)
@given(made=st.lists(kinds, min_size=1, max_size=4), faces=kinds, place=st.integers(0, 3))
def test_further_records_at_the_same_temperatures_never_hide_anything(
    made: Made, faces: tuple[float, tuple[int, ...]], place: int
) -> None:
    more = (made[place % len(made)][0], faces[1])
    before, after = (named(unobservable(of(m), BOTH)) for m in (made, [*made, more]))
    assert after <= before


def of_one_temperature(method: str, **bias: str) -> Campaign:
    made, spec = of([(10.0, tuple(range(6)))]), spec_with({}, {"bias": bias})
    plan = spec.plan.model_copy(update={"method": method})
    return replace(made, spec=spec.model_copy(update={"effects": ("bias",), "plan": plan}), effects=("bias",))


@pytest.mark.parametrize("size", ["20 mg", "0.7 mg", "0.69 mg", "0.01 mg"])
@pytest.mark.parametrize("method", ["published", "information"])
def test_what_is_known_no_better_than_uncalibrated_is_not_told(size: str, method: str) -> None:
    """Eight power-ons of 1 mg leave 1.96/√8 = 0.7 mg: little of 20 mg, and far more than 0.01 mg.

    By information that counts in what is promised: few power-ons are no want of records.
    """
    found = unobservable(of_one_temperature(method, systematic=size, run_to_run="1 mg"), (BIAS,))
    assert bool(found) == (method == "published" and size in ("0.69 mg", "0.01 mg"))
    assert all(u.partners == () for u in found)


@pytest.mark.parametrize("method", ["published", "information"])
def test_what_noise_hides_is_not_told(method: str) -> None:
    """0.05 m/s/√h over 60 s is 0.011 mg: nothing is known of a bias of a micro-g."""
    assert unobservable(of_one_temperature(method, systematic="1e-6 g", run_to_run="1e-8 g"), (BIAS,))


def test_what_the_table_takes_up_anyway_is_not_asked(installed_example: Installed) -> None:
    """max(T0 − T, 0) at the nodes is a table of its own; beside a constant bias one cold record tells it."""
    knee, bias = ErrorName("gyro.cold_knee"), ErrorName("gyro.bias")
    cold, warm = [(-40.0, (4,)), (60.0, (4,))], [(30.0, (4,)), (60.0, (4,))]
    for made in (cold, warm):
        assert unobservable(of(made, effects=("bias", "bias_temperature", "cold_knee")), (knee, bias)) == ()
    plain = ("bias", "cold_knee")
    assert unobservable(of(cold, effects=plain), (knee, bias)) == ()
    assert {u.error for u in unobservable(of(warm, effects=plain), (knee, bias))} == {knee}


def test_a_coefficient_that_channels_share_is_told_by_all_of_them() -> None:
    """On three faces no gyro alone tells five parts of the Earth's rate from its bias; all together do."""
    earth = ErrorName("gyro.earth_rate")
    effects = ("bias", "earth_rate")
    upright = campaign(spec(effects), rests([(10.0, (4,))]))
    assert {u.error for u in unobservable(upright, (earth,))} == {earth}
    cube = campaign(spec(effects), rests([(10.0, tuple(range(6)))]))
    assert unobservable(cube, (earth, ErrorName("gyro.bias"))) == ()
    part = campaign(spec(effects), rests([(10.0, (0, 2, 5))]))
    assert unobservable(part, (earth,)) == ()
