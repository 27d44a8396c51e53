"""What a call of `planner` leaves: exit code, stdout, stderr."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

ENVELOPE = {"command", "version", "ok", "exit_code", "faults", "result"}


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """The result of `--json`; what stands on stdout as it is where that is JSON in any case."""
        return self.envelope["result"] if set(self.envelope) == ENVELOPE else self.envelope

    @property
    def envelope(self) -> Any:
        """stdout as JSON; NaN and Infinity are not JSON."""
        return json.loads(self.out, parse_constant=pytest.fail)


Run = Callable[..., Outcome]
"""The fixture `run`: arguments of `planner` -> what it leaves."""
