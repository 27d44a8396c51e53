"""Choices that a test leaves open become tests; faults in them stand where the file has them."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from planner.errors import InputError
from tests.specs import loaded, small


def with_choice(**choice: Any) -> dict[str, Any]:
    """A spec with a second bench and a test that leaves something open."""
    spec = copy.deepcopy(small())
    bench = spec["benches"]["rate_table"]
    spec["benches"] = {"rate_table": bench, "table_2": bench | {"kind": "rate_table"}}
    spec["tests"]["gyro_drift"] |= choice
    return spec


def test_without_a_choice_nothing_changes():
    assert list(loaded(small()).spec.tests) == ["gyro_drift", "accelerometer_drift"]


def test_every_combination_is_a_test_of_its_own():
    spec = loaded(with_choice(bench=["rate_table", "table_2"], record=["60 s", "15 min"])).spec
    made = {name: (t.bench, round(t.record, 3)) for name, t in spec.tests.items()}
    assert made == {
        "gyro_drift": ("rate_table", 60.0),
        "gyro_drift-232_379s": ("rate_table", 232.379),
        "gyro_drift-15min": ("rate_table", 900.0),
        "gyro_drift-table_2": ("table_2", 60.0),
        "gyro_drift-table_2-232_379s": ("table_2", 232.379),
        "gyro_drift-table_2-15min": ("table_2", 900.0),
        "accelerometer_drift": ("rate_table", 300.0),
    }
    assert all(t.calibrates == ("gyro.bias",) for name, t in spec.tests.items() if name.startswith("gyro"))


def test_motions_are_chosen_among_lists_or_numbers():
    spec = loaded(with_choice(motions=[1, 6])).spec
    assert [t.motion_count for name, t in spec.tests.items() if name.startswith("gyro")] == [1, 6]
    several = [[{"position_1": "0 deg"}], [{"position_1": "0 deg"}, {"position_1": "90 deg"}]]
    spec = loaded(with_choice(motions=several)).spec
    assert [t.motion_count for name, t in spec.tests.items() if name.startswith("gyro")] == [1, 2]


@pytest.mark.parametrize(
    ("choice", "path", "said"),
    [
        ({"bench": ["rate_table", "tabel_2"]}, "tests.gyro_drift-tabel_2.bench", "did you mean 'table_2'"),
        ({"bench": ["rate_table", "table_2"], "repeats": 3}, "tests.gyro_drift.bench", "fixed by hand"),
        (
            {"motions": [1, 2, 3, 4, 5, 6, 7], "bench": ["rate_table", "table_2"]},
            "tests.gyro_drift",
            "at most 12",
        ),
        ({"record": ["5 min", "60 s"]}, "tests.gyro_drift.record", ""),
    ],
)
def test_what_is_wrong_has_its_place(choice, path, said):
    with pytest.raises(InputError) as error:
        loaded(with_choice(**choice))
    faults = error.value.faults
    assert any(f.path.startswith(path) and said in f.message and f.line > 1 for f in faults), faults
