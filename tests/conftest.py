"""The fixtures that call the program from outside, and that install a package of plug-ins."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from planner.cli import main
from planner.report.charts import theme
from tests.docs.forked import not_drawn
from tests.outcome import Outcome, Run
from tests.plugins.installing import EXAMPLE, Installed, found_in, install
from tests.shipped_plans import share_in

# the same examples in every run, however slow the machine: a law that fails fails for everybody
settings.register_profile("fixed", deadline=None, derandomize=True)
settings.load_profile("fixed")

gc.disable()  # until all tests are known: what they are made of stays to the end


def pytest_collection_finish() -> None:
    """Modules and tests are left out of every later look for what can go: a hundredth of the run's time."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session", autouse=True)
def _shipped_plans_are_shared(tmp_path_factory: pytest.TempPathFactory) -> None:
    """One folder of plans a run: beside the workers' own folders, or in the only one."""
    own = tmp_path_factory.getbasetemp()
    share_in((own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "shipped_plans")


@pytest.fixture(autouse=True)
def _charts_are_drawn_where_pages_are_looked_at(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """tests/report draws every chart; elsewhere they are empty, unless a test is marked `charts`."""
    if "report" not in request.path.parts and request.node.get_closest_marker("charts") is None:
        monkeypatch.setattr(theme, "drawn", not_drawn)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Run:
    """Call `planner` with arguments, in an empty folder; no call may end in a traceback."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: object) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["planner", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as end:
            main()
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        code = end.value.code
        return Outcome(code if isinstance(code, int) else 0, out, err)

    return call


@pytest.fixture
def installed_example(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Installed]:
    """The example package of plug-ins (tests/plugins/example_package), installed for this test."""
    folder = tmp_path_factory.mktemp("site")
    install(EXAMPLE, folder)
    with found_in(folder) as installed:
        yield installed
