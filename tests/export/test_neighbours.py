"""An export replaces what is planner's own, and says so; what is somebody's it leaves alone."""

from pathlib import Path

import pytest

from planner.errors import InputError
from planner.export.outputs import replaced


def test_a_neighbour_that_is_somebodys_is_refused(tmp_path):
    (tmp_path / "operator.html").write_text("my own notes")
    placed = {tmp_path / "shift.ics": b"new", tmp_path / "operator.html": "<p>plan_sha256: ab</p>"}
    with pytest.raises(InputError, match=r"operator\.html in .* is there already"):
        replaced(placed, tmp_path / "shift.ics")
    assert (tmp_path / "operator.html").read_text() == "my own notes"


def test_an_earlier_export_is_replaced_with_a_word(tmp_path):
    (tmp_path / "operator.html").write_text("<p>plan_sha256: 00</p>")
    (tmp_path / "shift.ics").write_text("anything: the user named it")
    placed = {tmp_path / "shift.ics": b"new", tmp_path / "operator.html": "<p>plan_sha256: ab</p>"}
    assert replaced(placed, tmp_path / "shift.ics") == (f"{tmp_path / 'operator.html'} is replaced",)


def test_what_is_the_same_or_new_needs_no_word(tmp_path):
    (tmp_path / "a").write_text("same")
    assert replaced({tmp_path / "a": "same", tmp_path / "b": "new"}, Path("elsewhere")) == ()
