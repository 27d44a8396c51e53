"""The reduced tables of tests/data are what `reduce` gives of the recordings today."""

from __future__ import annotations

import numpy as np
import pytest

from tests.data import HERE, recording
from tests.data.make import TABLES


def columns(text: str) -> np.ndarray:
    """The rows of a CSV by name, its comments apart."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding="utf-8")


def test_every_table_has_a_maker_and_names_its_source() -> None:
    assert {path.stem for path in HERE.glob("*.csv")} == set(TABLES)
    for name in TABLES:
        assert (HERE / f"{name}.csv").read_text(encoding="utf-8").startswith("# source: ")


@pytest.mark.parametrize("name", TABLES)
def test_a_table_is_what_reduce_gives(name: str) -> None:
    recording("", "the recordings, to reduce them again")
    kept, made = columns((HERE / f"{name}.csv").read_text(encoding="utf-8")), columns(TABLES[name]())
    assert kept.dtype.names == made.dtype.names
    assert len(kept) == len(made)
    for column in kept.dtype.names:
        if kept[column].dtype.kind == "U":
            assert kept[column].tolist() == made[column].tolist()
        else:
            # the seventh digit may be rounded the other way on another machine
            np.testing.assert_allclose(kept[column], made[column], rtol=2e-6, atol=1e-12, err_msg=column)
