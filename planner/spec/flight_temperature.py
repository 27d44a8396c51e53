"""At which temperatures the flights start that a requirement speaks of."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, Tag

from planner.nouns.array import Array
from planner.quantities import Celsius, Number
from planner.spec.forms import of_forms
from planner.spec.part import SpecPart


class TemperatureShares(SpecPart):
    """At which temperatures the flights start, and which share of them at each."""

    distribution: dict[Celsius, Annotated[Number, Field(ge=0)]] = Field(
        min_length=1, description="temperature: weight, e.g. {-20 degC: 0.2, 20 degC: 0.5, 60 degC: 0.3}"
    )

    @property
    def temperatures_degc(self) -> Array:
        """(k,) ascending."""
        return np.array(sorted(self.distribution))

    @property
    def shares(self) -> Array:
        """(k,) of the flights at `temperatures_degc`, their sum 1."""
        weights = np.array([self.distribution[t] for t in sorted(self.distribution)])
        return np.asarray(weights / weights.sum())


FlightTemperature = Annotated[
    Annotated[Literal["range", "worst", "flight"], Tag("text")]
    | Annotated[TemperatureShares, Tag("mapping")],
    of_forms(
        "must be range, worst, flight, or {distribution: {-20 degC: 0.2, 20 degC: 0.5, 60 degC: 0.3}}",
        words=("range", "worst", "flight"),
    ),
]
