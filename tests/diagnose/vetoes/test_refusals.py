"""What the power-ons refuse goes, each once, though what stands in its place may have taken others along."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from planner.diagnose.vetoes import refusals as module
from planner.diagnose.vetoes.refusals import refusals
from planner.diagnose.vetoes.verdicts import ALONE, Veto


class Believed(SimpleNamespace):
    """Two names, by their numbers."""

    @property
    def all(self) -> list[int]:
        return [*self.library, *self.unknown]

    def share(self, b: int) -> SimpleNamespace:
        return SimpleNamespace(delta=float(b))


def test_a_name_that_went_with_one_before_it_is_not_refused_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """It ended in an internal error: a gyro that goes with which way is up, by two names, both refused."""
    block = SimpleNamespace(reference=False, generic=False)
    found = Believed(library=[0, 1], unknown=[], pool=SimpleNamespace(blocks=[block, block]))
    monkeypatch.setattr(module, "vetoed", lambda f, b, starts: Veto(b, ALONE, 3))
    monkeypatch.setattr(module, "_unnamed_in_place", lambda f, b, starts, budgets: f.library.clear())
    assert [v.block for v in refusals(found, np.array([0]), {})] == [0]
    assert not found.library


@pytest.mark.parametrize(("sigma", "told"), [(4.1, False), (6.0, True)])
def test_a_faint_name_that_is_refused_leaves_no_variable(
    sigma: float, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A drift of 4 sigma that one power-on alone had came back as a step after power-on."""
    blocks = [SimpleNamespace(generic=False, name="drift"), SimpleNamespace(generic=True, name="time_on")]
    found = Believed(library=[], unknown=[], pool=SimpleNamespace(blocks=blocks))
    found.without, found.axes, found.on = (lambda *b: None), (lambda b: {0}), (lambda axes: [])
    asked: list[int] = []
    monkeypatch.setattr(module, "on", lambda pool, some, axes: list(some))
    monkeypatch.setattr(module, "score", lambda *_: SimpleNamespace(delta=sigma**2, criterion=12.0))
    monkeypatch.setattr(module, "_stands_in_place", lambda f, g, *_: not asked.append(g))
    module._unnamed_in_place(found, 0, np.array([0]), {})
    assert asked == ([1] if told else [])
