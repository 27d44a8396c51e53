"""`check_effect`: ours, the example's and the skeleton keep the laws; each law catches who breaks it."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner import catalog
from planner.effects import BaseEffect, ChannelEffect, Parameter, Term
from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.testing import check_effect
from tests.outcome import Run
from tests.plugins.installing import Installed


@pytest.mark.parametrize("name", catalog.effects())
@settings(deadline=None, max_examples=5)
@given(seed=st.integers(0, 2**32 - 1))
def test_ours_keep_the_laws(name: str, seed: int) -> None:
    check_effect(catalog.effects()[name], seed)


def test_those_of_the_example_keep_the_laws(installed_example: Installed) -> None:
    for name in ("self_heating", "cold_knee", "ripple", "heat_flow"):
        for seed in range(5):
            check_effect(catalog.effects()[name], seed)


def test_the_skeleton_is_an_effect_as_it_stands(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "slow_start.py"
    assert run("effects", "--template", "slow_start", "-o", file).code == 0
    spec = importlib.util.spec_from_file_location("slow_start", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.EFFECT.name == "slow_start"
    check_effect(module.EFFECT)
    assert run("effects", "--template", "slow_start", "-o", file).code == 2  # nobody's work is overwritten


class Sound(ChannelEffect):
    """A warm-up, which every fault below is one change of."""

    name = "sound"
    units = {"gyro": "deg/s", "accelerometer": "g"}  # noqa: RUF012 - as a stranger would write it
    group = "bias"
    parameters = (Parameter("tau", "s", 600.0, low=60.0, high=6000.0),)
    needs = frozenset(("time_on",))
    variable = "time_on"
    title = "sound"
    equation = "y_i += k_i exp(−t / τ)"

    def drive(self, sensor: str, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        return np.exp(-conditions.time_on / nonlinear["tau"])


def changed(**attributes: object) -> BaseEffect:
    """An instance of Sound with other attributes; functions are methods."""
    return type("Changed", (Sound,), attributes)()


def driven(drive: Callable[[Conditions, Mapping[str, float]], Array], **attributes: object) -> BaseEffect:
    return changed(drive=lambda self, sensor, c, nonlinear: drive(c, nonlinear), **attributes)


def decay(c: Conditions, p: Mapping[str, float]) -> Array:
    return np.exp(-c.time_on / p["tau"])


def leaking(self: Sound, sensor: str, c: Conditions, nonlinear: Mapping[str, float] | None = None) -> Array:
    found = Sound.regressors(self, sensor, c, nonlinear)
    found[:, 1, 0] = 0.1 * found[:, 0, 0]
    return found


def forgetful(self: Sound, sensor: str, c: Conditions, nonlinear: Mapping[str, float] | None = None) -> Array:
    return Sound.regressors(self, sensor, c, nonlinear or {"tau": 300.0})


class Restless(Sound):
    calls = 0.0

    def drive(self, sensor: str, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        self.calls += 1.0
        return decay(conditions, nonlinear) + 1e-3 * self.calls


class Cached(Sound):
    answer: Array | None = None

    def regressors(
        self, sensor: str, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        found = super().regressors(sensor, conditions, nonlinear)
        if self.answer is None or self.answer.shape != found.shape:
            self.answer = found
        same = nonlinear is None or dict(nonlinear) == self.nonlinear or not nonlinear
        return self.answer if same else found


TABLED = {"temperature_of": "bias", "tabled": True}
FAULTS: dict[str, tuple[BaseEffect, str]] = {
    "shape": (
        changed(regressors=lambda self, s, c, nonlinear=None: np.zeros((len(c.day), 3))),
        "must be float64",
    ),
    "kind": (
        changed(
            regressors=lambda self, s, c, nonlinear=None: Sound.regressors(self, s, c, nonlinear).astype("f4")
        ),
        "must be float64",
    ),
    "infinite": (driven(lambda c, p: np.where(c.day > 364.0, np.inf, decay(c, p))), "not finite"),
    "infinite in its range": (driven(lambda c, p: decay(c, p) / (p["tau"] != 60.0)), "not finite at tau 60"),
    "another channel": (changed(regressors=leaking), r"term 'x' acts on channels \[0, 1\]"),
    "a channel too many": (
        changed(terms=lambda self, s: (Term("x", channels=(0, 1)), Term("y"), Term("z"))),
        "never acts but on",
    ),
    "undeclared need": (driven(lambda c, p: decay(c, p) + 1e-9 * c.day), "depend on day, which `needs`"),
    "idle need": (changed(needs=frozenset(("time_on", "day"))), "`needs` names day, and nothing"),
    "strange need": (changed(needs=frozenset(("time_on", "weather"))), "needs weather"),
    "variable": (changed(variable="day"), "variable 'day' is not among"),
    "not the same twice": (Restless(), "two answers"),
    "rows": (driven(lambda c, p: decay(c, p) - decay(c, p).sum()), "rows know of each other"),
    "order": (driven(lambda c, p: np.cumsum(decay(c, p))), "rows know of each other"),
    "its own array": (Cached(), "not the caller's own"),
    "writes": (
        driven(lambda c, p: np.exp(-np.multiply(c.time_on, 0.5, out=c.time_on) / p["tau"])),
        "two answers",
    ),
    "defaults": (changed(regressors=forgetful), "not at their defaults"),
    "idle parameter": (driven(lambda c, p: np.exp(-c.time_on / 600.0)), "parameter tau changes nothing"),
    "rough parameter": (
        driven(lambda c, p: decay(c, p) + 0.1 * np.sin(c.time_on * p["tau"] * 1e3)),
        "the derivative with respect to tau does not exist",
    ),
    "bias in a scale factor": (changed(group="scale_factor", variable=None), "adds nothing at zero input"),
    "group": (changed(group="noise"), "group 'noise' is none of"),
    "unit": (changed(units={"gyro": "deg/s", "accelerometer": "furlong"}), "units of the accelerometer"),
    "units": (changed(units={"gyro": "deg/s"}), "each of its sensors"),
    "sensors": (changed(sensors=("gyro", "compass")), "its sensors must be"),
    "parameter's unit": (
        changed(parameters=(Parameter("tau", "parsec", 600.0, 60.0, 6000.0),)),
        "parameter tau: unit 'parsec'",
    ),
    "two terms of one name": (changed(terms=lambda self, s: (Term("x"), Term("x"), Term("z"))), "one name"),
    "channel 3": (
        changed(terms=lambda self, s: (Term("x", (3,)), Term("y"), Term("z"))),
        "channels are 0, 1, 2",
    ),
    "tabled alone": (changed(tabled=True), "tabled is for the change"),
    "tabled misalignment": (changed(group="misalignment", **TABLED), "tabled is for the change"),
    "tabled and shared": (
        changed(terms=lambda self, s: (Term("all", (0, 1, 2)), Term("y"), Term("z")), **TABLED),
        "tabled is for the change",
    ),
    "misfit": (changed(misfit=1.0), "misfit 1 is no share"),
    "untitled": (changed(title=" "), "its title is empty"),
    "another's name": (changed(name="bias"), "the name is that of another: the effect 'bias' of planner"),
    "no name": (changed(name="self-heating"), "no name of an effect"),
    "gives up": (
        driven(lambda c, p: decay(c, p) / len(c.day)),
        "regressors fail: ZeroDivisionError|rows know",
    ),
}


def test_the_sound_one_is_sound() -> None:
    check_effect(Sound())


@pytest.mark.parametrize("fault", FAULTS)
def test_each_law_catches_who_breaks_it(fault: str) -> None:
    effect, says = FAULTS[fault]
    with pytest.raises(InputError, match=says):
        check_effect(effect)


def test_all_that_is_wrong_is_said_at_once() -> None:
    wrong = driven(
        lambda c, p: decay(c, p) + 1e-9 * c.day + 1e-9 * c.temperature_degc,
        needs=frozenset(("time_on", "rate")),
    )
    with pytest.raises(InputError) as caught:
        check_effect(wrong)
    text = str(caught.value)
    assert "depend on day" in text
    assert "depend on temperature_degc" in text
    assert "`needs` names rate" in text
