"""What every flight has in common: how long, how finely sampled, from where, how warm, how long powered.

The fields take text with a unit, as a spec writes them, and hold SI.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

from planner.errors import Unfit
from planner.nouns.array import Array
from planner.quantities import DAY_S, Angle, Celsius, Metres, PositiveSeconds, Seconds, quantity, schema
from planner.units import from_si

MOST_SAMPLES = 2_000_000  # five and a half hours at 100 Hz; keeps a flight's arrays below 0.5 GB


def within(low: float, high: float, unit: str) -> AfterValidator:
    """A validator whose message speaks the user's unit: `low` and `high` are in SI."""

    def check(value: float) -> float:
        if not low <= value <= high:
            bounds = f"{from_si(low, unit):g} and {from_si(high, unit):g} {unit}"
            raise Unfit("P108", f"{from_si(value, unit):g} {unit} is not between {bounds}")
        return value

    return AfterValidator(check)


Hertz = Annotated[float, quantity("Hz", "100 Hz"), schema("100 Hz")]
Speed = Annotated[float, quantity("m/s", "50 m/s"), Field(ge=0), schema("50 m/s")]
DEG = float(np.radians(1.0))
# the local frame of a strapdown navigator turns over at the poles
Latitude = Annotated[Angle, within(-89.0 * DEG, 89.0 * DEG, "deg")]
Longitude = Annotated[Angle, within(-360.0 * DEG, 360.0 * DEG, "deg")]
Altitude = Annotated[Metres, within(-500.0, 100_000.0, "m")]
Heading = Annotated[Angle, within(-360.0 * DEG, 360.0 * DEG, "deg")]
SamplingRate = Annotated[Hertz, within(10.0, 1000.0, "Hz")]


def text(default: str) -> Any:
    """A default as a spec would write it, e.g. `text("50 m/s")`; the field's type reads it."""
    return Field(default=default)


class Settings(BaseModel):
    """Base of every mapping of settings: unknown keys are faults, nothing changes after loading."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True)


class TemperatureRamp(Settings):
    """The unit's temperature from take-off to the end, changing evenly."""

    start: Celsius
    end: Celsius


def _form(value: object) -> str:
    return "ramp" if isinstance(value, dict | TemperatureRamp) else "constant"


# read by its form, so that a fault speaks of that form only
Temperature = Annotated[
    Annotated[Celsius, Tag("constant")] | Annotated[TemperatureRamp, Tag("ramp")], Discriminator(_form)
]


class Environment(Settings):
    """Temperature of the unit, time since power-on at the start, time since the calibration."""

    temperature: Temperature = text("20 degC")
    time_on: Seconds = text("0 s")
    day: Seconds = text("0 day")

    @property
    def days(self) -> float:
        """Days since the calibration."""
        return self.day / DAY_S

    def temperature_degc(self, time_s: Array) -> Array:
        """(n,) degrees Celsius at the instants of a flight."""
        if isinstance(self.temperature, TemperatureRamp):
            ends = (self.temperature.start, self.temperature.end)
            return np.interp(time_s, (0.0, float(time_s[-1])), ends)
        return np.full(len(time_s), self.temperature)


class Flight(Environment):
    """Settings of every built-in flight."""

    duration: PositiveSeconds = text("60 s")
    sampling_rate: SamplingRate = text("100 Hz")
    latitude: Latitude = text("50 deg")
    longitude: Longitude = text("30 deg")
    altitude: Altitude = text("200 m")
    heading: Heading = text("45 deg")

    @model_validator(mode="after")
    def _is_bounded(self) -> Any:
        samples = self.duration * self.sampling_rate
        if samples > MOST_SAMPLES:
            most = f"{MOST_SAMPLES:,}"
            raise Unfit("P216", f"duration × sampling_rate is {samples:.3g} samples; the most is {most}")
        if samples < 2:
            raise Unfit("P216", "duration × sampling_rate is less than two samples")
        return self

    @property
    def time_s(self) -> Array:
        """(n + 1,) uniform instants from 0 to the duration (which the last interval hits exactly)."""
        intervals = max(2, round(self.duration * self.sampling_rate))
        return np.linspace(0.0, self.duration, intervals + 1)
