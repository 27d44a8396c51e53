"""What exported scripts say to table and chamber, as text; nothing here waits or listens.

A table with an Acutrol controller, a chamber with a controller of the ESPEC P300 kind. What a run says and
hears stands in their dialects (`dialects/acutrol.yaml`, `dialects/espec_p300.yaml`).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from planner.control.orders import AxisOrder
from planner.nouns.bench import BenchFacts

if TYPE_CHECKING:
    from planner.control.dialect import ChamberDialect

OFF = ":Mode:Off ALL"  # servoed to zero rate; the drives stay on
INTERLOCKS = (":Interlock:Reset ALL", ":Interlock:Close ALL")
POWER_ON, CONSTANT, READ_TEMPERATURE = "POWER,ON", "MODE,CONSTANT", "TEMP?"


def limits(bench: BenchFacts) -> tuple[str, ...]:
    """The bench's limits for both modes (p position, r rate) of every axis."""
    acceleration = bench.angular_acceleration_dps2
    given = (
        ("Rate", {"p": bench.rate_dps, "r": bench.rate_dps}),
        ("Acceleration", {"p": acceleration, "r": acceleration}),
    )
    return tuple(
        f":Limit:{name} {mode},{axis},{figure(value)}"
        for name, values in given
        for axis in range(1, bench.axes + 1)
        for mode, value in values.items()
        if value
    )


def demand(order: AxisOrder) -> tuple[str, str]:
    """The mode of an axis, then what is demanded of it."""
    mode = order.mode.title()
    return f":Mode:{mode} {order.axis}", f":Demand:{mode} {order.axis},{figure(order.value)}"


def setpoint(temperature_degc: float) -> str:
    """`TEMP,S-40.0`: the controller takes tenths of a degree."""
    return f"TEMP,S{sent_degc(temperature_degc)}"


def sent_degc(temperature_degc: float) -> str:
    """A setpoint as the controller takes it: tenths, never `-0.0`."""
    return fixed(temperature_degc, 1)


def rounding_note(
    bench: str, temperatures_degc: Iterable[float | None], dialect: ChamberDialect | None = None
) -> str | None:
    """What a person should know where a setpoint has finer digits than the controller takes.

    dialect: what the chamber speaks; None: tenths of a degC
    """
    sent, read = (sent_degc, float) if dialect is None else (dialect.sent, dialect.read)
    decimals, unit = (1, "degC") if dialect is None else (dialect.decimals, dialect.units)
    given = [t for t in dict.fromkeys(temperatures_degc) if t is not None]
    finer = [t for t in given if abs(t - read(sent(t))) > 1e-6]
    if not finer:
        return None
    most = max(finer, key=lambda t: abs(t - read(sent(t))))
    in_tenths = (decimals, unit) == (1, "degC")
    takes = "tenths of a degree" if in_tenths else f"steps of {10.0**-decimals:g} {unit}"
    return (
        f"{bench}: the chamber takes {takes}, so {len(finer)} of the plan's temperatures are "
        f"rounded, most {most:g} degC, sent as {sent(most)}"
    )


def fixed(value: float, decimals: int) -> str:
    """A number with so many decimals, never `-0.0`."""
    return f"{value:z.{decimals}f}"


def figure(value: float, decimals: int = 6) -> str:
    """A number as controllers read it: no exponent, no `-0`, as few digits as hold it."""
    text = fixed(value, decimals)
    return text.rstrip("0").rstrip(".") if "." in text else text
