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
