"""The fixture that calls the program from outside."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from planner.cli import main
from tests.outcome import Outcome, Run


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
