"""What calibration points leave of a sensor error over temperature: a table over their number, or curves.

A measured curve is kept as it is, of one unit or of several; a table says what evenly spaced points leave.
"""

from __future__ import annotations

from difflib import get_close_matches
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import AfterValidator, Field, GetJsonSchemaHandler, Tag, model_validator
from pydantic_core import CoreSchema

from planner.errors import Unfit
from planner.nouns.array import Array
from planner.quantities import AnyQuantity, Celsius, Count
from planner.spec.forms import of_forms, table_or_curves
from planner.spec.part import SpecPart

FEWEST_UNITS = 3  # whose measured curves tell a mean and a spread


class _Measured(SpecPart):
    """What was measured over temperature, on one unit or on several."""

    @model_validator(mode="before")
    @classmethod
    def _no_figure(cls, written: Any) -> Any:
        if isinstance(written, dict) and "figure" in written:
            raise Unfit("P321", "a measured curve is itself; 'figure' is for a table, leave it out")
        return written


class MeasuredCurve(_Measured):
    """A measured error over temperature; the planner places the calibration points on it."""

    curve: dict[Celsius, AnyQuantity] = Field(
        min_length=2, description="temperature: measured error, e.g. {-60 degC: 0.03 deg/s, 20 degC: 0 deg/s}"
    )

    @property
    def temperatures_degc(self) -> Array:
        """(n,) ascending."""
        return np.array(sorted(self.curve))

    @property
    def values(self) -> Array:
        """(n,) the error at `temperatures_degc`, SI."""
        return np.array([self.curve[t].si for t in sorted(self.curve)])


def _enough(curves: tuple[Any, ...]) -> tuple[Any, ...]:
    if len(curves) < FEWEST_UNITS:
        count = f"{len(curves)} unit{'s' if len(curves) > 1 else ''}" if curves else "no unit"
        raise Unfit(
            "P322",
            f"curves of {count} tell no mean and spread; give {FEWEST_UNITS} or more, "
            "or one unit's curve without the brackets of a list",
        )
    return curves


class MeasuredCurves(_Measured):
    """The error over temperature measured on several units: mean and covariance of all units are theirs."""

    curve: Annotated[
        tuple[Annotated[dict[Celsius, AnyQuantity], Field(min_length=2)], ...], AfterValidator(_enough)
    ] = Field(
        description="of each unit, temperature: measured error, e.g. [{-60 degC: 1 mg, 20 degC: 0 mg}, …]",
        json_schema_extra={"minItems": FEWEST_UNITS},
    )

    @property
    def units(self) -> tuple[MeasuredCurve, ...]:
        """Each unit's curve, as it was read here."""
        return tuple(MeasuredCurve.model_construct(curve=one) for one in self.curve)


CurveName = Literal["cosines", "kink", "cubic", "matern"]
CURVE_NAMES: tuple[CurveName, ...] = get_args(CurveName)


class ResidualTable(SpecPart):
    """What N evenly spaced points with straight lines leave, against N: `{1: …, 3: …, figure: largest}`.

    figure: `largest`, the largest value over the range is about the number; `sigma`, the root mean square
    over temperature and units is the number
    curve: what the curves look like that leave it; left out: a promise holds for each family
    """

    table: dict[Count, AnyQuantity] = Field(min_length=1)
    figure: Literal["largest", "sigma"] = Field(
        "largest",
        description="what the numbers are: the largest over the range, or sigma over temperature and units",
    )
    curve: CurveName | None = Field(
        None,
        description="family of the curves: cosines, kink (quadratic with one), cubic, matern (Matérn 3/2); "
        "left out: the promise holds for each of them",
    )

    @model_validator(mode="before")
    @classmethod
    def _from_one_mapping(cls, written: Any) -> Any:
        """In the file words stand among the numbers of points: `figure`, `curve`, rightly spelt or not."""
        if not isinstance(written, dict):
            return written
        words = {key: v for key, v in written.items() if get_close_matches(str(key), ["figure", "curve"])}
        if words.keys() == {"curve"} == written.keys():
            raise Unfit("P323", "a family of curves needs the table that they leave: {1: …, 3: …, curve: …}")
        return {"table": {key: value for key, value in written.items() if key not in words}, **words}

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """As it stands in the file; JSON knows only text as a key: the numbers of points are digits there."""
        schema = handler.resolve_ref_schema(handler(core))
        table = schema["properties"].pop("table")
        schema.pop("required", None)
        schema["additionalProperties"] = table["additionalProperties"]
        schema["propertyNames"] = {"pattern": "^([0-9]+|figure|curve)$"}
        return schema


Residual = Annotated[
    Annotated[MeasuredCurve, Tag("measured")]
    | Annotated[MeasuredCurves, Tag("units")]
    | Annotated[ResidualTable, Tag("table")],
    of_forms(
        "must be a table {1: 0.03 deg/s, 3: …, curve: kink}, one unit's {curve: {-60 degC: …, 20 degC: …}}, "
        "or several units' {curve: [{…}, {…}, {…}]}",
        table_or_curves,
    ),
]
