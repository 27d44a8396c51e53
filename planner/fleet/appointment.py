"""A day on which something is to be done with a unit."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date


@dataclass(frozen=True)
class Appointment:
    """One day: what is to be done with which unit, and why."""

    day: date
    summary: str
    description: str
