"""Curves that a process drew for one spec are those that another spec would have drawn by itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from planner.information import curves
from planner.information.curves import Curves
from tests.specs import loaded, small

AT = np.array([-55.0, -12.5, 0.0, 31.0])


def with_table(table: dict[int, str], low: str) -> Curves:
    tree: dict[str, Any] = small()
    tree["unit"]["gyro"]["bias"]["temperature_residual"] = table
    tree["plan"]["temperatures"]["range"] = [low, "60 degC"]
    return Curves(loaded(tree).spec)


def told(c: Curves) -> list[np.ndarray]:
    """Slopes and second moments of every family and error."""
    slopes = [each for family in c.slopes_by_family(AT).values() for each in family.values()]
    return [*slopes, *(one for family in c.moments(AT).values() for one in family.values())]


@pytest.mark.parametrize("table", [{1: "0.05 deg/s", 2: "0.02 deg/s"}, {1: "0.032 deg/s", 3: "0.0085 deg/s"}])
def test_what_another_spec_looked_at_changes_nothing(
    table: dict[int, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(curves, "_KEPT", {})
    alone = told(with_table(table, "-60 degC"))
    monkeypatch.setattr(curves, "_KEPT", {})
    told(with_table({1: "0.04 deg/s", 4: "0.01 deg/s"}, "-40 degC"))
    kept = len(curves._KEPT)
    after = told(with_table(table, "-60 degC"))
    assert len(curves._KEPT) - kept <= 1  # cosines go by their table, the others are there
    for one, other in zip(alone, after, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_oldest_shape_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(curves, "_KEPT", {})
    monkeypatch.setattr(curves, "MOST_KEPT", 2)
    told(with_table({1: "0.05 deg/s"}, "-60 degC"))
    assert len(curves._KEPT) == 2
