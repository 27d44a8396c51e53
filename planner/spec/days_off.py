"""Days on which nobody works: dates, ranges of dates, the holidays of a country, in `plan.shifts.holidays`.

A shift that would begin on such a day is not worked. Countries and their parts are those of the package
`holidays` (python-holidays), by their codes of ISO 3166: DE, DE-BY, GB-SCT.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import date, timedelta
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, WithJsonSchema

from planner.errors import Unfit
from planner.quantities import DAY_S, FIRST_MONDAY, date_of
from planner.spec.places import did_you_mean

if TYPE_CHECKING:
    from planner.spec.model import Spec

WEEKS = 53  # so far ahead of its start a campaign knows its days off
LONGEST_RANGE = 366
FORMS = "write a date 2026-12-24, a range 2026-12-24..2027-01-01, or a country such as DE or DE-BY"
_COUNTRY = re.compile(r"([A-Z]{2,3})(?:-(\w{1,30}))?")
_RANGE = re.compile(r"(\d{4}-\d{2}-\d{2})(?:\s*\.\.\s*(\d{4}-\d{2}-\d{2}))?")


def _entry(value: object) -> object:
    """Raises Unfit for what is no day off."""
    if not isinstance(value, str):
        raise Unfit("P115", f"{str(value)[:40]!r} is no day off; {FORMS}")
    if _RANGE.fullmatch(value):
        first, last = _ends(value)
        if last < first:
            raise Unfit("P115", f"{value!r} ends before it begins; write {last}..{first}")
        if (last - first).days >= LONGEST_RANGE:
            raise Unfit("P115", f"{value!r} is longer than a year; write the days on which nobody works")
    elif _COUNTRY.fullmatch(value):
        _known(value)
    else:
        raise Unfit("P115", f"{value[:40]!r} is no day off; {FORMS}")
    return value


DayOff = Annotated[
    str,
    BeforeValidator(_entry),
    WithJsonSchema({"type": "string", "examples": ["2026-12-24", "2026-12-24..2027-01-01", "DE-BY"]}),
]


def days_off(spec: Spec) -> dict[date, str]:
    """Day -> what it is, of the weeks that the calendar of the campaign knows; none without a date."""
    monday = first_monday(spec)
    return {} if monday is None else days_off_between(spec, monday, monday + timedelta(weeks=WEEKS))


def days_off_between(spec: Spec, first: date, last: date) -> dict[date, str]:
    """Day -> what it is, from a date up to before another, in order."""
    found: dict[date, str] = {}
    for entry in (entry for shift in spec.plan.shifts for entry in shift.holidays):
        for day, name in _days(entry, first, last):
            if first <= day < last:
                found[day] = name or found.get(day, "")
    return dict(sorted(found.items()))


def first_monday(spec: Spec) -> date | None:
    """Monday of the week in which the campaign starts, where the spec says its date."""
    dated = [s.start for s in spec.plan.shifts if s.start is not None and s.start >= 7 * DAY_S]
    return FIRST_MONDAY + timedelta(weeks=dated[0] // (7 * DAY_S)) if dated else None


def _days(entry: str, first: date, last: date) -> Iterator[tuple[date, str]]:
    if not _RANGE.fullmatch(entry):
        yield from _national(entry, range(first.year, last.year + 1)).items()
        return
    begin, end = _ends(entry)
    for n in range((end - begin).days + 1):
        yield begin + timedelta(days=n), ""


def _ends(entry: str) -> tuple[date, date]:
    match = _RANGE.fullmatch(entry)
    assert match is not None  # asked before
    return date_of(match[1]), date_of(match[2] or match[1])


@lru_cache(maxsize=64)
def _national(entry: str, years: range) -> dict[date, str]:
    """Public holidays; their names are English where the package has them so, in any locale."""
    country, _, part = entry.partition("-")
    return dict(
        _package().country_holidays(country, subdiv=part or None, years=years, language="en_US").items()
    )


def _known(entry: str) -> None:
    """Raises Unfit for a country, or a part of one, that the package does not know."""
    countries = _package().list_supported_countries()
    country, _, part = entry.partition("-")
    if country not in countries:
        raise Unfit("P115", f"{country!r} is no country of python-holidays{did_you_mean(country, countries)}")
    if part and part not in countries[country]:
        known = ", ".join(countries[country]) or "none"
        raise Unfit("P115", f"{country} has no part {part!r}; expected one of {known}")


def _package() -> Any:
    """python-holidays; imported when a country is named."""
    import holidays

    return holidays
