"""What is said to the table and to the chamber, as text; nothing here waits or listens."""

from __future__ import annotations

from collections.abc import Iterable

from planner.bench_run.job import BenchFacts
from planner.bench_run.motion import AxisOrder

OFF = ":Mode:Off ALL"  # servoed to zero rate; the drives stay on
INTERLOCKS = (":Interlock:Reset ALL", ":Interlock:Close ALL")
POWER_ON, CONSTANT, READ_TEMPERATURE = "POWER,ON", "MODE,CONSTANT", "TEMP?"


def limits(bench: BenchFacts, fastest_dps: float) -> tuple[str, ...]:
    """The bench's limits for both modes (p position, r rate) of every axis.

    fastest_dps: the fastest rate of the campaign, the limit of mode r where the bench has none of its own.
    """
    given = (
        ("Rate", "p", bench.rate_dps),
        ("Rate", "r", bench.rate_dps or fastest_dps),
        ("Acceleration", "p", bench.angular_acceleration_dps2),
        ("Acceleration", "r", bench.angular_acceleration_dps2),
    )
    return tuple(
        f":Limit:{name} {mode},{axis},{plain(value)}"
        for name, mode, value in given
        if value
        for axis in range(1, bench.axes + 1)
    )


def motion(orders: Iterable[AxisOrder], still_turning: Iterable[int] = ()) -> str:
    """One frame: axes that turn without an order are stopped, the others get their mode and demand."""
    stops = [f":Mode:Off {axis}" for axis in still_turning]
    moves = [
        f":Mode:{o.mode.title()} {o.axis};:Demand:{o.mode.title()} {o.axis},{plain(o.value)}" for o in orders
    ]
    return ";".join([*stops, *moves])


def setpoint(temperature_degc: float) -> str:
    """`TEMP,S-40.0`: the controller takes tenths of a degree."""
    return f"TEMP,S{temperature_degc + 0.0:.1f}".replace("S-0.0", "S0.0")


def plain(value: float) -> str:
    """A number without exponent and without zeros that say nothing."""
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
