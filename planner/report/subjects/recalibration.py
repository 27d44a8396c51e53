"""Recalibrations in store: the schedule, what each visit renews, and what only a campaign can."""

from __future__ import annotations

from datetime import timedelta

from planner.fleet.appointment import Appointment
from planner.fleet.basis import Recalibrated
from planner.fleet.history import day_label
from planner.fleet.published_store import published, published_check
from planner.fleet.sessions import Session
from planner.fleet.store import Visit
from planner.fleet.visit_plans import ShortestVisit, StorePlan
from planner.report.blocks import Items, Picture, Report, Table, existing, facts, section, table
from planner.report.charts import fleet as charts
from planner.report.charts.year import YearMark, year_picture
from planner.report.numbers import (
    NOTHING,
    counted,
    digits,
    display_unit,
    hours,
    in_unit,
    names_are,
    percent,
    plain,
)
from planner.report.readable import shown_in

DRAWN = 8
SHOWN = 24  # lines of a table on a terminal: the page and the JSON have all
_TOP = 1.5  # times the limit: further up nothing is told
_TWO_SIDED_95 = 1.959963984540054  # quantile of the normal distribution


def recalibration_report(found: Recalibrated, name: str) -> Report:
    """The schedule, what visits renew, and what only a campaign can."""
    return Report(
        kind="Recalibration in store",
        title=name,
        answer=headline(found),
        sentences=(sentence(found),),
        notes=tuple(found.notes),
        facts=facts(
            ("units", str(len(found.plans))),
            ("visits", str(sum(len(p.visits) for p in found.plans))),
            ("days of work", str(len(found.sessions)) if found.sessions else ""),
            ("hours", hours(_hours(found))),
            ("today", day_label(found.start, found.today) if found.sessions else ""),
            ("looked until", day_label(found.start, float(found.plans[0].days[-1]))),
        ),
        sections=existing(
            section("sessions", "The year on one calendar", sessions_table(found), _calendar(found)),
            section("schedule", "The schedule", schedule_table(found), _picture(found)),
            section("shortest", "One visit: the shortest for a given date", shortest_table(found)),
            section("renews", "What the store can renew", renewal_table(found)),
            section("binding", "What is used up in the end", binding_table(found), only="page"),
            section("procedure", "What is done on a visit", Items(procedure(found)), only="page"),
            section("published", "Beside the published recalibration", published_table(found)),
            section("basis", "How to read this", Items(BASIS), only="page"),
        ),
    )


def _picture(found: Recalibrated) -> Picture:
    plans = found.plans[:DRAWN]
    visits = sum(len(p.visits) for p in plans)
    loads = [
        charts.Load(
            "with the visits" if p.unit == "spec" else p.unit,
            p.days,
            p.load,
            p.without,
            tuple((v.day, v.load_after) for v in p.visits),
        )
        for p in plans
    ]
    alt = f"Share of the limit over time of {len(plans)} units with {visits} visits, and without them"
    caption = (
        "Share of the limit over time: with the visits (line) and without them (dotted). The limit is at "
        "100 %; every visit falls on the last day of the grid before it."
    )
    return charts.loads_picture("schedule", alt, caption, loads, found.start, _TOP)


BASIS = (
    "A visit is made as late as the limits allow; units of a fleet come earlier where that adds no visit, so "
    "that the surface is set up once for several. A unit that is overdue comes today.",
    "After a visit the uncertainty starts anew; with a history, it grows as its drift says, with what the "
    "visit teaches about it. Sizes add, or their squares, as the "
    "requirement's rule says; what "
    "flights add (run-to-run, in-run) and the temperature residual of the plan stay in all along.",
    "Renewed is a term of which the visit leaves less than there is; all others go on drifting "
    "from where they are.",
    "No visit changes the temperature: a renewed bias is the one at room temperature, taken to "
    "hold for the table "
    "over temperature as a shift.",
    "Least hours: of all sequences of visits on a grid of days; visits that differ by less than a "
    "thousandth of the limit count as one. A search that keeps whatever may still win.",
)


def headline(found: Recalibrated) -> str:
    """What is overdue, visits and hours, or how far the store carries."""
    overdue = [p.unit for p in found.plans if p.overdue and p.unit != "spec"]
    late = f"{names_are(overdue)} overdue: recalibrate now. " if overdue else ""
    lacking = [p for p in found.plans if not p.whole]
    if lacking:
        first = min(lacking, key=lambda p: p.kept_until)
        who = "" if first.unit == "spec" else f" {first.unit}"
        return (
            f"{late}The store carries{who} until {day_label(found.start, first.kept_until)}, not to the end"
        )
    visits = sum(len(p.visits) for p in found.plans)
    if not visits:
        return "No recalibration is needed"
    days = f" on {counted(len(found.sessions), 'day')}" if found.sessions else ""
    return f"{late}{counted(visits, 'visit')}{days}, {hours(_hours(found))} h in all"


def _hours(found: Recalibrated) -> float:
    """Seconds of all work: of the days when units come together, else of every visit by itself."""
    if found.sessions:
        return sum(s.time_s for s in found.sessions)
    return sum(p.time_s for p in found.plans)


def sentence(found: Recalibrated) -> str:
    """The next visit, and the proof."""
    due = [(v.day, p.unit, v.visit) for p in found.plans for v in p.visits[:1]]
    proved = all(p.proved for p in found.plans)
    told = (
        "No schedule of such visits costs less"
        if proved
        else "The search was stopped: a cheaper one may exist"
    )
    if found.sessions:
        alone = sum(s.alone_s for s in found.sessions)
        told += f"; each by itself they would take {hours(alone)} h"
    if not due:
        return (
            f"{told}."
            if any(not p.whole for p in found.plans)
            else "Every unit keeps its requirements to the end."
        )
    day = min(due)[0]
    first = [(unit, visit) for on, unit, visit in due if on == day]
    if first[0][0] == "spec":
        words = visit_words(first[0][1])
        return f"The next visit is due on {day_label(found.start, day)}: {words}. {told}."
    who = ", ".join(unit for unit, _ in first)
    return f"The next day of work is {day_label(found.start, day)}: {who}. {told}."


def sessions_table(found: Recalibrated) -> Table | None:
    """A row per day of work, overdue units first in it."""
    late = {p.unit for p in found.plans if p.overdue}
    return table(
        "Days of work: who comes together",
        "on | units | hours | by themselves | who |",
        (
            (
                day_label(found.start, s.day),
                str(len(s.units)),
                hours(s.time_s),
                hours(s.alone_s),
                ", ".join(sorted(s.units, key=lambda u: (u not in late, u))),
                _remark(s, late if s.day <= found.today else set()),
            )
            for s in found.sessions
        ),
        wide=("by themselves",),
    )


def _remark(s: Session, late: set[str]) -> str:
    said = [
        "overdue" if late & set(s.units) else "",
        "" if s.fits else "more than a working day: no other carries them",
    ]
    return "; ".join(filter(None, said))


def _calendar(found: Recalibrated) -> Picture | None:
    if found.start is None or not found.sessions:
        return None
    late = {p.unit for p in found.plans if p.overdue}
    marks = [
        YearMark(s.day, len(s.units), s.day <= found.today and bool(late & set(s.units)))
        for s in found.sessions
    ]
    return year_picture("recalibrations", "visits in store", marks, found.start, found.today)


def visit_words(visit: Visit) -> str:
    """`4 power-ons with rests, 1 with turns, 2.60 h`."""
    parts = [f"{counted(visit.rests, 'power-on')} with rests"] if visit.rests else []
    parts += [f"{visit.turns} with turns"] if visit.turns else []
    return f"{', '.join(parts)}, {hours(visit.time_s)} h"


def schedule_table(found: Recalibrated) -> Table | None:
    """A row per visit."""
    return table(
        "Visits; share of the limit before and after",
        "unit | on | rests, power-ons | turns, power-ons | hours | before, % | after, % | renews",
        (
            (
                _who(p),
                day_label(found.start, v.day),
                str(v.visit.rests),
                str(v.visit.turns),
                hours(v.visit.time_s),
                f"{100 * v.load_before:.1f}",
                f"{100 * v.load_after:.1f}",
                _errors(v.renewed),
            )
            for v, p in sorted(
                ((v, p) for p in found.plans for v in p.visits), key=lambda one: (one[0].day, one[1].unit)
            )
        ),
    )


def _who(p: StorePlan) -> str:
    return "any unit" if p.unit == "spec" else p.unit


def _errors(names: tuple[str, ...]) -> str:
    """`gyro.bias, accelerometer.bias x y` from the names of terms."""
    by: dict[str, list[str]] = {}
    for name in names:
        error, term = name.split(" ")
        by.setdefault(error, []).append(term)
    return ", ".join(e if len(t) >= 3 else f"{e} {' '.join(t)}" for e, t in by.items()) or NOTHING


def shortest_table(found: Recalibrated) -> Table | None:
    """A row per day to be reached."""
    return table(
        "The shortest visit on the day a unit is due",
        "unit | visit on | lasts until | days | rests, power-ons | turns, power-ons | hours | without it, % "
        "| with it, %",
        (_shortest_row(s, found) for s in found.shortest),
        wide=("without it, %", "with it, %"),
        most=SHOWN,
    )


def _shortest_row(s: ShortestVisit, found: Recalibrated) -> tuple[str, ...]:
    who = "any unit" if s.unit == "spec" else s.unit
    v = s.visit
    cells = ("no visit", NOTHING, NOTHING) if v is None else (str(v.rests), str(v.turns), hours(v.time_s))
    ends = (day_label(found.start, s.day), day_label(found.start, s.until), digits(s.until - s.day, 4))
    return (who, *ends, *cells, f"{100 * s.load_without:.1f}", f"{100 * s.load_with:.1f}")


def renewal_table(found: Recalibrated) -> Table | None:
    """A row per term: what the most thorough visit leaves, beside what there is in the end."""
    most = found.bench.asked.repeats
    one, left = (_TWO_SIDED_95 * found.bench.left(n, n) for n in (1, most))
    grown = found.growth.start + found.growth.between[:, 0, -1]
    rows: list[tuple[str, ...]] = []
    for t, term in enumerate(found.basis.region.terms):
        values = [v if v < 1e3 else float("nan") for v in map(float, (one[t], left[t], grown[t]))]
        said = "renewed" if found.renewable[t] else "stays as it is"
        row = (*shown_in(term.unit, values), said)
        if rows and rows[-1][0].split(" ")[0] == term.error and rows[-1][1:] == row:
            rows[-1] = (f"{rows[-1][0]} {term.term}", *row)
        else:
            rows.append((term.name, *row))
    return table(
        "95 % of what is left of each term" + ("" if len(found.plans) == 1 else f", {found.plans[0].unit}"),
        f"error | after one power-on | after {most} | without, at the end | in |",
        rows,
    )


def binding_table(found: Recalibrated) -> Table | None:
    """What takes most of the limit on the last day that is kept."""
    return table(
        "The largest terms when the end is reached, or the limit",
        "unit | kept until | term | share of the limit, % | the store",
        (
            (
                _who(p),
                day_label(found.start, p.kept_until),
                name,
                f"{100 * share:.1f}",
                "renews it" if can else "cannot renew it",
            )
            for p in found.plans
            for name, share, can in p.binding[:3]
        ),
    )


def procedure(found: Recalibrated) -> tuple[str, ...]:
    """The work of one visit in sentences."""
    a = found.bench.asked
    again = ", then again after half a turn on the surface" if a.headings == 2 else ""
    return (
        f"Set up: {hours(a.set_up)} h. Every repeat is one power-on of the unit, "
        f"{digits(a.cool_down / 60, 3)} min off "
        "after it.",
        f"Rests: the unit on each of its six faces{again}, {digits(a.rest, 4)} s recorded on each, "
        f"{digits(a.move, 4)} s to move it.",
        f"Turns: about each axis, upright, {counted(a.turns, 'whole turn')} one way and the "
        "other against a mark, "
        f"{digits(a.turn, 4)} s a turn.",
        "Gyro bias from the rests (the Earth's rate cancels over the faces), gyro scale factor from "
        "(∫ω dt − angle) / angle, accelerometer bias and scale factor from faces up and down.",
    )


def published_table(found: Recalibrated) -> Table | None:
    """The published figures beside what this procedure leaves of the same unit."""
    rows = []
    for p, here in zip(published(), published_check(found.bench.asked), strict=True):
        values = [digits(in_unit(v, p.unit), 3) for v in (p.before, p.after, here)]
        cuts = [f"−{100 * (1 - v / p.before):.0f}" for v in (p.after, here)]
        rows.append((p.error, *values, display_unit(p.unit), *cuts))
    return table(
        "Residual errors before and after one repeat, one sigma (K table 2.19), and their reduction",
        "error | before | published after | here after | in | published, % | here, %",
        rows,
    )


def store_appointments(found: Recalibrated) -> list[Appointment]:
    """What belongs on a calendar; empty without a date of day 0."""
    if found.start is None:
        return []
    return [
        Appointment(
            found.start + timedelta(days=int(v.day)),
            f"Recalibrate {_who(p)} in store{': overdue' if p.overdue and v is p.visits[0] else ''}",
            f"{visit_words(v.visit)}\nrenews: {_errors(v.renewed)}\n"
            f"share of the limit: {100 * v.load_before:.0f} % before, {100 * v.load_after:.0f} % after",
        )
        for p in found.plans
        for v in p.visits
    ]


def why_not(found: Recalibrated) -> str:
    """Why the store cannot carry every unit to the end; empty if it can."""
    lacking = [p for p in found.plans if not p.whole]
    if not lacking:
        return ""
    p = min(lacking, key=lambda q: q.kept_until)
    stays = [name for name, _, can in p.binding if not can]
    c = found.basis.region.constraints[p.constraint]
    said = ", ".join(f"{name} {percent(share, 0)}" for name, share, _ in p.binding[:3])
    more = f"; the store cannot renew {', '.join(stays)}" if stays else ""
    who = "a unit" if p.unit == "spec" else p.unit
    return plain(
        f"the store keeps {who} within {c.error.replace('_', ' ')} until "
        f"{day_label(found.start, p.kept_until)} only; "
        f"what takes most of the limit then: {said}{more}. Calibrate by then, or allow more repeats"
    )
