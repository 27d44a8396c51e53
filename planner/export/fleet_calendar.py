"""Dates of recalibrations as whole days of a calendar (RFC 5545): same dates, same bytes."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

from planner.fleet.appointment import Appointment

REMIND_DAYS = 14


def calendar_bytes(name: str, appointments: Sequence[Appointment]) -> bytes:
    """The calendar with an event and a reminder two weeks ahead for every appointment, in order of days."""
    from icalendar import Alarm, Calendar, Event, vText

    calendar = Calendar()
    calendar.add("prodid", "-//planner//units in store//EN")
    calendar.add("version", "2.0")
    calendar.add("x-wr-calname", vText(name))
    for one in sorted(appointments, key=lambda a: (a.day, a.summary)):
        event, alarm = Event(), Alarm()
        digest = hashlib.sha256(f"{name}|{one.summary}|{one.day}".encode()).hexdigest()[:24]
        event.add("uid", f"{digest}@units.planner")
        # not the time of export: same dates, same bytes
        event.add("dtstamp", datetime(one.day.year, one.day.month, one.day.day, tzinfo=UTC))
        event.add("dtstart", one.day)
        event.add("dtend", one.day + timedelta(days=1))
        event.add("summary", one.summary)
        event.add("description", one.description)
        event.add("transp", "TRANSPARENT")
        alarm.add("action", "DISPLAY")
        alarm.add("trigger", timedelta(days=-REMIND_DAYS))
        alarm.add("description", one.summary)
        event.add_component(alarm)
        calendar.add_component(event)
    return bytes(calendar.to_ical())
