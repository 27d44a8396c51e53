"""Values that may be written in several forms are read by their form, so a fault speaks of that form only."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    Discriminator,
    ValidationError,
    WrapValidator,
)

from planner.errors import Unfit
from planner.units import Quantity

INPUT_PATTERN = (
    r"^\s*[-+.0-9].*(/\s*(s|sec|min|h|hr)(\^?[23²])?|rpm|[0-9 ]m?g)\s*$"  # a key: a rate or a load
)
NAME_PATTERN = r"^[A-Za-z][A-Za-z0-9_-]{0,39}$"


def one_or_many(value: object) -> object:
    """One item may stand without the brackets of a list."""
    return value if isinstance(value, list | tuple) else [value]


def _name(value: str) -> str:
    if not re.search(NAME_PATTERN, value) or value.endswith("\n"):
        raise Unfit("P112", f"{value[:50]!r} is not a name; use letters, digits, '_' and '-', at most 40")
    return value


def first_format(value: object) -> object:
    """The spec's format; there is one so far."""
    if value is True or value != 1:
        raise Unfit("P113", "this planner reads format 1; write 'planner: 1', or `planner migrate SPEC` does")
    return 1


Name = Annotated[str, AfterValidator(_name)]


def _form(value: object) -> str:
    if isinstance(value, dict | BaseModel):
        return "mapping"
    if isinstance(value, list | tuple):
        return "list"
    return "text" if isinstance(value, str | Quantity) else "number"


def mapping_or_text(value: object) -> str:
    """`mapping`, or `list` (which is always wrong), else `text`."""
    return _form(value) if _form(value) in ("mapping", "list") else "text"


def list_or_number(value: object) -> str:
    """`list`, or `mapping` (which is always wrong), else `number`."""
    return _form(value) if _form(value) in ("list", "mapping") else "number"


def text_table_or_parts(*parts: str) -> Callable[[object], str]:
    """`parts` of a mapping that has one of these keys, or no number in any key; else `table`, or `text`.

    `inputs` of a table whose keys are rates or loads: `10 deg/s`, `5 g`.
    """

    def form(value: object) -> str:
        if not isinstance(value, dict):
            return _kind_of(value) if isinstance(value, BaseModel) else _or_text(value)
        if any(isinstance(key, Quantity) or re.search(INPUT_PATTERN, str(key)) for key in value):
            return "inputs"
        words = parts and not any(re.search(r"\d", str(key)) for key in value)
        return "parts" if value and (words or any(key in value for key in parts)) else "table"

    def _kind_of(value: BaseModel) -> str:
        return "inputs" if "table" in type(value).model_fields else "parts"

    def _or_text(value: object) -> str:
        return mapping_or_text(value).replace("mapping", "table")

    return form


def table_or_curves(value: object) -> str:
    """`table`, with a word as its `curve` or none; `measured`, `units` where that is a mapping or a list.

    The other forms are always wrong.
    """
    if _form(value) != "mapping":
        return _form(value)
    curve = value.get("curve") if isinstance(value, dict) else getattr(value, "curve", None)
    return {"mapping": "measured", "list": "units"}.get(_form(curve), "table")


def moment(value: object) -> str:
    """`end` and `any` are words, and so is whatever has no digit in it; the rest is a time."""
    return "word" if isinstance(value, str) and not re.search(r"\d", value) else "time"


class _Hashable(dict[str, Any]):
    """typing asks of what an annotation holds that it has a hash."""

    def __hash__(self) -> int:  # type: ignore[override]  # a dict has none, for it may change; these do not
        return hash(tuple(self.items()))


def of_forms(message: str, form: Any = _form, words: Sequence[str] = ()) -> Discriminator:
    """A choice by form; `message` says which forms there are. words: the only ones that text may be."""

    def known(value: object) -> str | None:
        return None if words and isinstance(value, str) and value not in words else str(form(value))

    return Discriminator(
        known if words else form,
        custom_error_type="form",
        custom_error_message=message,
        custom_error_context=_Hashable(words=" ".join(words)),
    )


def or_else(forms: str) -> Any:
    """What the text of a choice by form adds to its refusals: the other forms."""

    def read(value: object, text: Callable[[object], Any]) -> Any:
        try:
            return text(value)
        except ValidationError as error:
            (detail,) = error.errors(include_url=False)
            reason = detail.get("ctx", {}).get("error")
            raise Unfit(getattr(reason, "code", "P103"), f"{reason}, or {forms}") from None

    return WrapValidator(read)


def no_list(message: str) -> Any:
    """A field that is one of the ways which a list would leave open; `message` says which there are."""

    def read(value: object) -> object:
        if isinstance(value, list | dict):
            raise Unfit("P103", message)
        return value

    return BeforeValidator(read)
