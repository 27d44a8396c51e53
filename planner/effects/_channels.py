"""What most effects share: one coefficient per channel, driven by something of that channel."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, wraps
from typing import cast

import numpy as np

from planner.effects._dependence import depends_on
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, Swinging, over_records
from planner.protocols import Condition, Effect, Group, Parameter, Sensor, Term

AXES = ("x", "y", "z")
CHANNELS = tuple(Term(axis) for axis in AXES)
REFERENCE_DEGC = 20.0  # bench room temperature: the point at which temperature effects are zero
Regressors = Callable[..., Array]  # of an effect, as the protocol has them
BOTH: tuple[Sensor, ...] = ("gyro", "accelerometer")


def sensed(sensor: Sensor, conditions: Conditions) -> Array:
    """(n, 3) what the sensor senses: rate for gyros, specific force for accelerometers."""
    return conditions.rate if sensor == "gyro" else conditions.specific_force


def per_channel(drive: Array) -> Array:
    """(n, 3) drive -> (n, 3, 3) regressors in which term i acts on channel i only."""
    regressors = np.zeros((len(drive), 3, 3))
    channel = np.arange(3)
    regressors[:, channel, channel] = drive
    return regressors


def every_channel(drive: Array) -> Array:
    """(n,) drive that all channels share -> (n, 3, 3) regressors in which term i acts on channel i only."""
    return per_channel(np.broadcast_to(drive[:, np.newaxis], (len(drive), 3)))


def _of_records(regressors: Regressors) -> Regressors:
    """Regressors at an instant → those of records too: their mean, where gravity goes round the unit.

    What is the bench's asks for directions of the bench, which the mean force of a record has.
    """

    @wraps(regressors)
    def averaged(
        self: BaseEffect, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        def at(seen: Conditions) -> Array:
            return regressors(self, sensor, seen, nonlinear)

        if not isinstance(conditions, Swinging) or self.bench_only or self.history:
            return at(conditions)
        return over_records(at, conditions) if _feels_force(self, sensor) else at(conditions)

    return averaged


@cache
def _feels_force(effect: BaseEffect, sensor: Sensor) -> bool:
    """Whether the force is in an effect on this sensor: in a nonlinearity of gyros it is not."""
    return "specific_force" in effect.needs and depends_on(cast(Effect, effect), sensor, "specific_force")


class BaseEffect:
    """What an effect says of itself unless it says otherwise; a subclass offers `terms` and `regressors`.

    A subclass writes `regressors` for instants; of records they become the mean over them.
    """

    name: str
    sensors: tuple[Sensor, ...] = BOTH
    units: Mapping[Sensor, str]
    group: Group
    parameters: tuple[Parameter, ...] = ()
    needs: frozenset[Condition] = frozenset()
    variable: Condition | None = None
    temperature_of: str | None = None
    tabled = False
    bench_only = False
    misfit = 0.0
    one_scale = False  # of the bench: whether it is off by the same share on every channel
    linear_in_force = False  # whether its regressors are: those of a record are then those of its mean force
    history = (
        False  # whether a row's regressors depend on the rows before it, which stand in the order of time
    )
    nodal = False  # whether its coefficients are the values at nodes, its regressors the weights of these
    apart = False  # whether each of its coefficients may be the only one there: an axis's share, no node's
    follows_drift = False  # whether one power-on cannot tell it from a drift: a table over what changes there
    largest: Mapping[Sensor, float] | None = None
    title: str
    equation: str
    source: str = ""

    def __init_subclass__(cls) -> None:
        """Wrap what the subclass says of instants."""
        super().__init_subclass__()
        if "regressors" in vars(cls):
            cls.regressors = _of_records(vars(cls)["regressors"])  # type: ignore[attr-defined]  # of every subclass

    @property
    def nonlinear(self) -> Mapping[str, float]:
        """Parameter -> its default."""
        return {p.name: p.default for p in self.parameters}


def side_by_side(drives: Array) -> Array:
    """(n, 3, 3k) drives of k coefficients a channel: its own (n, 3, k), or (n, k) that every channel has."""
    own = drives if drives.ndim == 3 else drives[:, np.newaxis]
    n, _, k = own.shape
    regressors = np.zeros((n, 3, 3 * k))
    for channel in range(3):
        regressors[:, channel, k * channel : k * (channel + 1)] = own[:, channel % own.shape[1]]
    return regressors


class ChannelEffect(BaseEffect):
    """Base of effects with one coefficient a channel, y_i += k_i · drive_i; a subclass offers `drive`."""

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """One per channel: x, y, z."""
        return CHANNELS

    def drive(self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float]) -> Array:
        """(n, 3), or (n,) when all channels share it: output in SI per SI unit of the coefficient."""
        raise NotImplementedError

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """(n, 3, 3) the drive on the diagonal; parameters that `nonlinear` leaves out keep their default."""
        drive = self.drive(sensor, conditions, {**self.nonlinear, **(nonlinear or {})})
        return every_channel(drive) if drive.ndim == 1 else per_channel(drive)
