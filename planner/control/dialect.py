"""What a device is asked and told, as data: a dialect, read from a file that needs no Python.

A table or a chamber differs from another in its words, units, acknowledgement and time-outs, not in what is
wanted of it. Words hold places in braces: `{axis}`, `{value}`; answers also `{measured}`, `{setpoint}`,
`{code}`, `{any}`. Blanks in an answer may be left out or doubled, and capitals do not matter.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Annotated, Literal

from pydantic import Field, model_validator

from planner.control.words import fixed
from planner.quantities import PositiveSeconds
from planner.spec.part import SpecPart
from planner.units import ZERO_CELSIUS_K, dimension_of, displayed, unit_factor

Said = tuple[str, ...]
Words = Annotated[Said, Field(min_length=1)]
PLACES = {"axis", "value", "measured", "setpoint", "code", "any", "message", "verb"}
_PLACE = re.compile(r"\{([a-z]*)\}")


class Connection(SpecPart):
    """How messages go out and come back; reply_within, late_within in s.

    join: several commands go out as one message with this between them; None: one message each
    """

    ends_with: Literal["\n", "\r\n", "\r"] = "\n"
    join: str | None = None
    reply_within: PositiveSeconds = 2.0
    late_within: PositiveSeconds = 5.0


class Acknowledgement(SpecPart):
    """What a device says to an order; a device that says nothing has none."""

    accepted: Words
    refused: Said = ()


class Question(SpecPart):
    """A question and the shapes of its answer, the fullest first; good: the answers that mean all is well."""

    ask: str
    answer: Words
    good: Said = ()

    def understood(self, text: str, axis: int | None = None) -> dict[str, str]:
        """What stands in the places of an answer. Raises ValueError for an answer of another shape."""
        known = () if axis is None else (("axis", str(axis)),)
        return matched(tuple(self.answer), text, known)

    def is_good(self, code: str) -> bool:
        """Whether an answer means that all is well."""
        plain = code.strip().strip('"').upper()
        return any(plain == word.upper() or _same_number(plain, word) for word in self.good)


class Limits(SpecPart):
    """The bench's limits, axis by axis: when going to an angle, and when turning."""

    position_rate: str | None = None
    turning_rate: str | None = None
    position_acceleration: str | None = None
    turning_acceleration: str | None = None


class TableOrders(SpecPart):
    """prepare: interlocks; stop: one axis to zero rate; stop_all: all at once, left out: one by one."""

    prepare: Said = ()
    limits: Limits = Limits()
    stop: Words
    stop_all: Said = ()
    position: Words
    rate: Words


class TableQuestions(SpecPart):
    """What a table can be asked; rate, errors and interlock are left out where it does not tell them."""

    position: Question
    rate: Question | None = None
    errors: Question | None = None
    interlock: Question | None = None


class TableUnits(SpecPart):
    """In what the table counts."""

    position: str = "deg"
    rate: str = "deg/s"
    acceleration: str = "deg/s^2"

    @model_validator(mode="after")
    def _fit(self) -> TableUnits:
        for name, like in (("position", "deg"), ("rate", "deg/s"), ("acceleration", "deg/s^2")):
            unit = getattr(self, name)
            if dimension_of(unit) != dimension_of(like):
                raise ValueError(f"{name}: {unit!r} has the wrong dimension; expected one like {like}")
        return self

    def sent(self, what: Literal["position", "rate", "acceleration"], value: float) -> float:
        """deg, deg/s or deg/s² → the device's number."""
        return displayed(math.radians(value), getattr(self, what))

    def read(self, what: Literal["position", "rate", "acceleration"], number: float) -> float:
        """The device's number → deg, deg/s or deg/s²."""
        return math.degrees(number * unit_factor(getattr(self, what))[0])


class Dialect(SpecPart):
    """What all dialects tell."""

    dialect: Literal[1]
    name: str = Field(pattern=r"^[a-z][a-z0-9_]{0,60}$")
    title: str = ""
    connection: Connection = Connection()
    acknowledgement: Acknowledgement | None = None

    def messages(self, commands: Sequence[str]) -> list[str]:
        """Commands as they go out: joined to one message, or one by one."""
        join = self.connection.join
        return list(commands) if join is None or not commands else [join.join(commands)]


class TableDialect(Dialect):
    """A rate table, a positioning table, a centrifuge."""

    device: Literal["table"]
    orders: TableOrders
    questions: TableQuestions
    units: TableUnits = TableUnits()
    decimals: Annotated[int, Field(ge=0, le=12)] = 6

    @model_validator(mode="after")
    def _known_places(self) -> TableDialect:
        limits = [text for text in vars(self.orders.limits).values() if text]
        told = [*self.orders.position, *self.orders.rate, *self.orders.stop, *limits]
        _check_places([*told, *self.orders.prepare, *self.orders.stop_all], {"axis", "value"})
        _check_questions(q for q in vars(self.questions).values() if q is not None)
        for name in ("position", "rate"):
            _needs("value", name, getattr(self.orders, name), getattr(self.questions, name))
        return self

    def lacks(self) -> list[str]:
        """What a run must do without, in words."""
        questions = self.questions
        missing = {
            "rates cannot be read: rest is seen by positions that stay": questions.rate is None,
            "errors cannot be asked: an order is known by what the axes do": questions.errors is None,
            "the interlock cannot be asked: it is known by an order that is refused": questions.interlock
            is None,
            "orders are not acknowledged": self.acknowledgement is None,
            "no limits are sent": not any(vars(self.orders.limits).values()),
        }
        return [text for text, is_missing in missing.items() if is_missing]


class ChamberOrders(SpecPart):
    """start: power and constant temperature; setpoint: the temperature to go to."""

    start: Said = ()
    setpoint: Words


class ChamberQuestions(SpecPart):
    """temperature: of the air, perhaps with the setpoint; setpoint: where it is asked apart."""

    temperature: Question
    setpoint: Question | None = None
    mode: Question | None = None


class ChamberDialect(Dialect):
    """A thermal chamber."""

    device: Literal["chamber"]
    orders: ChamberOrders
    questions: ChamberQuestions
    units: Literal["degC", "K"] = "degC"
    decimals: Annotated[int, Field(ge=0, le=6)] = 1

    @model_validator(mode="after")
    def _known_places(self) -> ChamberDialect:
        _check_places([*self.orders.start, *self.orders.setpoint], {"value"})
        _check_questions(q for q in vars(self.questions).values() if q is not None)
        _needs("value", "setpoint", self.orders.setpoint, self.questions.setpoint)
        if any("{measured}" not in shape for shape in self.questions.temperature.answer):
            raise ValueError("questions.temperature.answer: every shape needs {measured}")
        return self

    def sent(self, degc: float) -> str:
        """degC → the device's number."""
        return fixed(degc + self._zero, self.decimals)

    def read(self, text: str) -> float:
        """The device's number → degC. Raises ValueError for what is no number to go by."""
        return finite(text) - self._zero

    @property
    def _zero(self) -> float:
        return ZERO_CELSIUS_K if self.units == "K" else 0.0

    @property
    def tells_setpoint(self) -> bool:
        """Whether the setpoint can be read back."""
        shapes = self.questions.temperature.answer
        return self.questions.setpoint is not None or any("{setpoint}" in shape for shape in shapes)

    def lacks(self) -> list[str]:
        """What a run must do without, in words."""
        missing = {
            "the setpoint cannot be read back": not self.tells_setpoint,
            "the mode cannot be asked": self.questions.mode is None,
            "orders are not acknowledged": self.acknowledgement is None,
        }
        return [text for text, is_missing in missing.items() if is_missing]


def _same_number(one: str, other: str) -> bool:
    try:
        return float(one) == float(other)
    except ValueError:
        return False


def _needs(place: str, name: str, told: Sequence[str], question: Question | None) -> None:
    """Raises ValueError where an order or an answer has no place for its number."""
    if not any(f"{{{place}}}" in text for text in told):
        raise ValueError(f"orders.{name}: no {{{place}}} in it")
    if question is not None and any(f"{{{place}}}" not in shape for shape in question.answer):
        raise ValueError(f"questions.{name}.answer: every shape needs {{{place}}}")


def _check_places(texts: Sequence[str], known: set[str]) -> None:
    for text in texts:
        strange = set(_PLACE.findall(text)) - known
        if strange:
            raise ValueError(
                f"{text!r}: unknown place {{{strange.pop()}}}; known: {', '.join(sorted(known))}"
            )


def _check_questions(questions: Iterator[Question]) -> None:
    for question in questions:
        _check_places([question.ask], {"axis"})
        _check_places(question.answer, PLACES)


def filled(template: str, **values: object) -> str:
    """A template with its places filled."""
    return _PLACE.sub(lambda place: str(values[place[1]]), template)


def verb_of(message: str) -> str:
    """What stands before the first comma or blank: `TEMP` of `TEMP,S-40.0`."""
    return message.partition(",")[0].partition(" ")[0]


def matched(shapes: tuple[str, ...], text: str, known: tuple[tuple[str, str], ...] = ()) -> dict[str, str]:
    """The places of the first shape that a text has. Raises ValueError when it has none of them."""
    for shape in shapes:
        found = _pattern(shape, known).fullmatch(text.strip())
        if found:
            return {key: value.strip() for key, value in found.groupdict().items()}
    raise ValueError(f"{text!r} has not the shape of {shapes[0]!r}")


def fits(shapes: tuple[str, ...], text: str, known: tuple[tuple[str, str], ...] = ()) -> bool:
    """Whether a text has one of the shapes."""
    return any(_pattern(shape, known).fullmatch(text.strip()) for shape in shapes)


@lru_cache(maxsize=512)
def _pattern(shape: str, known: tuple[tuple[str, str], ...]) -> re.Pattern[str]:
    given, parts, end = dict(known), [], 0
    for place in _PLACE.finditer(shape):
        parts.append(_literal(shape[end : place.start()]))
        parts.append(_place_pattern(place[1], given))
        end = place.end()
    parts.append(_literal(shape[end:]))
    return re.compile("".join(parts), re.IGNORECASE)


def _literal(text: str) -> str:
    escaped = r"\s*".join(re.escape(part) for part in re.split(r"\s+", text))
    return re.sub("([:,;])", r"\1\\s*", escaped)


def _place_pattern(name: str, given: dict[str, str]) -> str:
    if name in given:
        return _literal(given[name])
    if name == "any":
        return ".*"
    shape = r"[\w.+\-\"]+" if name == "code" else r"[^,;\s]+"
    return rf"\s*(?P<{name}>{shape})\s*"


def finite(text: str) -> float:
    """A number that is one. Raises ValueError for words, NaN and infinity."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text!r} is no number to go by")
    return value
