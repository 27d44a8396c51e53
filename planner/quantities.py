"""Field types for whatever a user writes: text with a unit in YAML, an SI number in the model, a pattern in the schema."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

from planner.units import Quantity, UnitError, parse, to_degc, to_si


def _reader(unit: str) -> Any:
    def read(value: object) -> float:
        try:
            return to_si(value, unit)
        except UnitError as error:
            raise ValueError(str(error)) from None

    return BeforeValidator(read)


def _schema(example: str) -> Any:
    return WithJsonSchema(
        {"type": "string", "description": f"number with unit, e.g. {example}", "examples": [example]}
    )


def _temperature(value: object) -> float:
    try:
        return to_degc(value)
    except UnitError as error:
        raise ValueError(str(error)) from None


def _quantity(value: object) -> Quantity:
    if isinstance(value, Quantity):
        return value
    try:
        return parse(value)
    except UnitError as error:
        raise ValueError(str(error)) from None


def _count(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{value!r} is not a whole number")
    return value


Seconds = Annotated[float, _reader("s"), Field(ge=0), _schema("15 min")]
PositiveSeconds = Annotated[float, _reader("s"), Field(gt=0), _schema("300 s")]
Share = Annotated[float, _reader("%"), Field(gt=0, lt=1), _schema("95 %")]
Celsius = Annotated[float, BeforeValidator(_temperature), _schema("-55 degC")]
KelvinPerSecond = Annotated[float, _reader("K/min"), Field(gt=0), _schema("4 K/min")]
Kelvin = Annotated[float, _reader("K"), Field(ge=0), _schema("2 K")]
Rate = Annotated[float, _reader("deg/s"), _schema("100 deg/s")]
PositiveRate = Annotated[float, _reader("deg/s"), Field(gt=0), _schema("600 deg/s")]
PositiveAngularAcceleration = Annotated[float, _reader("deg/s/s"), Field(gt=0), _schema("500 deg/s/s")]
Angle = Annotated[float, _reader("deg"), _schema("90 deg")]
Acceleration = Annotated[float, _reader("g"), _schema("50 g")]
Metres = Annotated[float, _reader("m"), _schema("1.5 m")]
AnyQuantity = Annotated[Quantity, BeforeValidator(_quantity), _schema("0.002 deg/s")]
Count = Annotated[int, BeforeValidator(_count), Field(ge=1, le=1_000_000)]
