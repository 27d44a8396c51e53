"""What people are told while a run goes on, and that nothing of it disturbs the run."""

import re
import sys

import pytest

from planner.bench_run.equipment import Status
from planner.bench_run.session import undisturbed
from planner.bench_run.watching import Notifier, Page, Watching, duration, status_line
from planner.nouns.step import Step

STEP = Step("table/-40/drift/r01/m1", "table", "record", 100.0, 400.0, "drift", -40.0, 1)
NEXT = Step("table/remove", "table", "remove", 4000.0, 4600.0, attended=True)
STATUS = Status("table", STEP, 7, 20, 93784.0, NEXT, 3900.0, -39.96, {1: 90.0, 2: 0.0})


def test_the_line_says_time_left_people_temperature_and_angles():
    assert status_line(STATUS) == (
        "table/-40/drift/r01/m1; 8/20; 1 d 02:03 left; people in 01:05: remove; -40.0 degC; "
        "axis 1 at 90 deg, axis 2 at 0 deg"
    )
    assert duration(-5.0) == "00:00"


def test_the_page_refreshes_itself_and_keeps_what_somebody_must_look_at(tmp_path):
    path = tmp_path / "run.html"
    page = Page(path, "planner run <small>")
    page.watch(STATUS)
    first = path.read_text()
    assert '<meta http-equiv="refresh" content="10">' in first
    assert "planner run &lt;small&gt;" in first
    assert re.search(r"people needed</dt><dd>in 01:05 h: remove", first)
    page.watch(STATUS)
    assert path.read_text() == first  # not written every time
    page.attend("ATTENTION: table <turns>")
    page.end("stopped")
    assert "ATTENTION: table &lt;turns&gt;" in path.read_text()
    assert list(tmp_path.iterdir()) == [path]


def test_a_command_is_called_with_arguments_and_no_shell(tmp_path):
    out, said = tmp_path / "called", []
    code = "import sys; open(sys.argv[1], 'a').write(repr(sys.argv[2:]))"
    notifier = Notifier([sys.executable, "-c", code, str(out)], said.append)
    notifier("person", "install; $(touch /tmp/x) 'unit'")
    notifier.close()
    assert out.read_text() == repr(["person", "install; $(touch /tmp/x) 'unit'"])
    assert said == []


def test_what_fails_is_said_once_and_stops_nothing(tmp_path):
    said = []
    page = Page(tmp_path / "run.html", "run")
    page._path = tmp_path / "run.html" / "no" / "folder"
    (tmp_path / "run.html").write_text("")
    watching = Watching(page, Notifier(["/no/such/program"], said.append), lambda text: None, said.append)
    watching.event("attention", "look")
    watching.event("attention", "look again")
    watching.end("stopped", "ended")
    assert sum("--page failed" in text for text in said) == 1
    assert sum("--notify failed" in text for text in said) == 3


@pytest.mark.parametrize("error", [OSError(28, "full"), ValueError("I/O operation on closed file")])
def test_a_closed_or_full_terminal_changes_nothing(error):
    def fails(text):
        raise error

    undisturbed(fails)("said")
