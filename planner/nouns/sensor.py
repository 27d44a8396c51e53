"""The two sensors of a unit, and the names of their errors: `gyro.bias` is an effect on a sensor."""

from __future__ import annotations

from typing import Literal

Sensor = Literal["gyro", "accelerometer"]
SENSORS: tuple[Sensor, ...] = ("gyro", "accelerometer")


def channel_name(sensor: Sensor, axis: int) -> str:
    """`gyro_x` … `accelerometer_z`."""
    return f"{sensor}_{'xyz'[axis]}"


def short(channel: str) -> str:
    """`acc_x` for `accelerometer_x`, as files and pages write it."""
    return channel.replace("accelerometer_", "acc_")


class ErrorName(str):
    """`<sensor>.<effect>`, e.g. `gyro.bias`: reads, sorts and prints as its text, and knows its two parts.

    Raises ValueError for a text of another shape or an unknown sensor.
    """

    sensor: Sensor
    effect: str

    def __new__(cls, text: str) -> ErrorName:
        """Read the text."""
        if isinstance(text, ErrorName):
            return text
        sensor, point, effect = text.partition(".")
        if sensor not in SENSORS or not point or not effect:
            raise ValueError(f"{text!r} is no error of a sensor; write e.g. gyro.bias")
        found = super().__new__(cls, text)
        found.sensor, found.effect = sensor, effect
        return found

    @classmethod
    def of(cls, sensor: Sensor, effect: str) -> ErrorName:
        """The error that an effect is on a sensor."""
        return cls(f"{sensor}.{effect}")

    @property
    def parts(self) -> tuple[Sensor, str]:
        """Sensor and effect."""
        return self.sensor, self.effect

    def __getnewargs__(self) -> tuple[str]:
        return (str(self),)
