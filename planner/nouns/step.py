"""One step of a plan: an action on a bench, from when to when."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

Action = Literal[
    "install",
    "ramp",
    "soak",
    "power_on",
    "move",
    "record",
    "power_off",
    "cool_down",
    "pause",
    "remove",
]
ACTIONS: tuple[str, ...] = get_args(Action)  # in the order in which a bench does them
_BATCH = re.compile(r"b(\d+)/")


@dataclass(frozen=True)
class Step:
    """One action on one bench, with people if attended. Times in s from the start; motion in deg, deg/s.

    temperature_degc: of a ramp that at its end, of a record that in its middle
    attended: None where an older plan does not say; temperature_rate_degc_min: of a chamber that moves
        evenly meanwhile, None where it stands, or goes as fast as it can
    """

    id: str
    bench: str
    action: str
    start_s: float
    end_s: float
    test: str | None = None
    temperature_degc: float | None = None
    repeat: int | None = None
    motion: Mapping[str, float] | None = None
    units: int = 1
    attended: bool | None = False
    temperature_rate_degc_min: float | None = None

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return self.end_s - self.start_s

    @property
    def swept_degc(self) -> tuple[float, float] | None:
        """Where a chamber that moves evenly is when the step begins, and when it ends; None: it stands."""
        if self.temperature_rate_degc_min is None or self.temperature_degc is None:
            return None
        way = self.temperature_rate_degc_min * self.seconds / 60.0
        begin = self.temperature_degc - (way / 2.0 if self.action == "record" else way)
        return begin, begin + way

    @property
    def visit(self) -> str:
        """The bench and temperature of a test's step, as its id begins: `rate_table/-30`; else the id."""
        return self.id if self.test is None else self.id.partition(f"/{self.test}/")[0]

    @property
    def batch(self) -> int | None:
        """Which batch of units it is for: `b02/…`, which only the id tells; None: the only one."""
        found = _BATCH.match(self.id)
        return None if found is None else int(found[1])
