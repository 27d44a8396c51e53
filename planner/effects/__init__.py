"""One file an effect: what it adds to a sensor's output, and all else that anybody must know of it.

An effect of one's own, in any installed package, builds on the names below and is found by the entry point
`planner.effects`; `planner effects --template NAME` writes a skeleton.
"""

from planner.effects._channels import (
    AXES,
    BOTH,
    REFERENCE_DEGC,
    BaseEffect,
    ChannelEffect,
    every_channel,
    per_channel,
    sensed,
)
from planner.protocols import Condition, Group, Parameter, Sensor, Term

__all__ = [
    "AXES",
    "BOTH",
    "REFERENCE_DEGC",
    "BaseEffect",
    "ChannelEffect",
    "Condition",
    "Group",
    "Parameter",
    "Sensor",
    "Term",
    "every_channel",
    "per_channel",
    "sensed",
]
