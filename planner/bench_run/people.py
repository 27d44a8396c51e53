"""What the runner needs beside table and chamber: somebody at the bench, the unit's power, the recorder."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence
from typing import Protocol

from planner.bench_run.clock import Clock
from planner.bench_run.errors import BenchFault
from planner.nouns.step import Step


class Recorder(Protocol):
    """Switches the unit and records what it says."""

    def power(self, on: bool, step: Step, number: int) -> None:
        """Switch the unit on or off; number: of the power-on."""
        ...

    def start(self, step: Step, number: int) -> None:
        """Begin a record; when it is not stopped as complete it is void, and will be begun again."""
        ...

    def stop(self, step: Step, complete: bool) -> None:
        """End a record."""
        ...

    def lost(self, step: Step, number: int) -> None:
        """The record that an earlier session began in a power-on and never ended is void."""
        ...


class Operator(Protocol):
    """Somebody at the bench."""

    def attend(self, step: Step, seconds: float) -> None:
        """Come back when the unit is installed, turned round or removed."""
        ...


class NoRecorder:
    """The unit is on and recorded by other means; times stand in the journal."""

    def power(self, on: bool, step: Step, number: int) -> None:
        """Nothing."""

    def start(self, step: Step, number: int) -> None:
        """Nothing."""

    def stop(self, step: Step, complete: bool) -> None:
        """Nothing."""

    def lost(self, step: Step, number: int) -> None:
        """Nothing."""


class CommandRecorder:
    """Calls a program of the laboratory: `COMMAND power_on|power_off|start|stop|void STEP POWER_ON_NUMBER`.

    Raises BenchFault when it cannot be started or does not exit 0 within a minute.
    """

    def __init__(self, command: Sequence[str]) -> None:
        self._command, self._number = tuple(command), 0

    def power(self, on: bool, step: Step, number: int) -> None:
        """Switch the unit."""
        self._number = number
        self._call("power_on" if on else "power_off", step)

    def start(self, step: Step, number: int) -> None:
        """Begin a record."""
        self._number = number
        self._call("start", step)

    def stop(self, step: Step, complete: bool) -> None:
        """End a record, or say that it is void."""
        self._call("stop" if complete else "void", step)

    def lost(self, step: Step, number: int) -> None:
        """Say that a record of an earlier session is void."""
        self._number = number
        self._call("void", step)

    def _call(self, verb: str, step: Step) -> None:
        words = [*self._command, verb, step.id, str(self._number)]
        try:
            subprocess.run(words, check=True, timeout=60, stdin=subprocess.DEVNULL)
        except (OSError, subprocess.SubprocessError) as error:
            raise BenchFault(f"the recorder failed: {error}") from error


class Waiting:
    """Nobody to ask: the planned time of the step is waited."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def attend(self, step: Step, seconds: float) -> None:
        """Wait."""
        self._clock.sleep(seconds)


class Asking:
    """Somebody at the terminal, who says when it is done."""

    def __init__(self, ask: Callable[[str], object]) -> None:
        self._ask = ask

    def attend(self, step: Step, seconds: float) -> None:
        """Ask and wait for Enter."""
        motion = "" if step.motion is None else " " + ", ".join(f"{k} {v:g}" for k, v in step.motion.items())
        self._ask(f"{step.id}: {step.action}{motion}; the table stands still. Press Enter when done")
