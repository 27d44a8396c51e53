"""How well the references are known, one sigma: those of a bench, and the attitude when the flight begins."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from planner.quantities import Kelvin, NonNegativeAngle, NonNegativeMetres, NonNegativeRatio, Switch
from planner.spec.part import SpecPart


class BenchAccuracy(SpecPart):
    """How well a bench's references are known, one sigma each, SI; 0 (left out) is perfect.

    level: rad, of each of the two tilts of the base, which everything on the bench shares; mounting: rad, of
    each of the three small angles of the unit on the bench, drawn anew at every installation; rate: relative
    error of the table's rate, one for the bench; temperature: K, offset of the chamber's thermometer against
    the unit, one for the bench
    """

    level: NonNegativeAngle = Field(0.0, description="tilt of the base about each axis, e.g. 0.01 deg")
    mounting: NonNegativeAngle = Field(
        0.0, description="each angle of the unit on the bench, new at every installation, e.g. 0.02 deg"
    )
    rate: NonNegativeRatio = Field(0.0, description="relative error of the table's rate, e.g. 20 ppm")
    temperature: Kelvin = Field(0.0, description="offset of the chamber's thermometer, e.g. 0.1 K")


class InitialAlignment(SpecPart):
    """How well the attitude is known when the flight begins, one sigma, rad.

    Given from outside: `roll_pitch` and `heading`. Self-aligned: the accelerometers level roll and pitch
    themselves, so that the tilt is tied to their errors, and `heading` is given.
    """

    roll_pitch: NonNegativeAngle = Field(0.0, description="roll and pitch, one sigma each, e.g. 0.05 deg")
    heading: NonNegativeAngle = Field(0.0, description="heading, one sigma, e.g. 0.5 deg")
    self_aligned: Switch = Field(
        False, description="true: the accelerometers level roll and pitch themselves at the start"
    )


def _perfect(written: Any) -> Any:
    """`aided: true` is an aid without an error."""
    return "0 m" if written is True else written


class Vertical(SpecPart):
    """What holds the computed height and its rate: an aid whose error is drawn once a flight."""

    aided: Annotated[NonNegativeMetres, BeforeValidator(_perfect)] = Field(
        description="one sigma of the aid's height, e.g. 10 m; true: it makes no error",
    )
