"""JSON Schemas of what accept, forecast and recalibrate write (`fleet`, `recalibration_json`)."""

from __future__ import annotations

from typing import get_args

from planner.export.schema_words import (
    COUNT,
    FIGURE,
    INTERVAL,
    NUMBER,
    SPEC,
    TEXT,
    WORD,
    YES_OR_NO,
    Schema,
    listed,
    named,
    one_of,
    or_null,
    record,
)

RATES = record(good_rejected=NUMBER, bad_accepted=NUMBER)
REQUIREMENT = {"requirement": COUNT, "error": TEXT, "rule": TEXT}
VISIT = {"rest_power_ons": COUNT, "turn_power_ons": COUNT}


def accept() -> Schema:
    """accept.json: units with their verdicts, and every channel's residual against its room."""
    from planner.fleet.acceptance import Place
    from planner.fleet.judge import Verdict

    channel = record(
        channel=TEXT,
        term=TEXT,
        place=one_of(*get_args(Place)),
        residual=FIGURE,
        ci95_half=FIGURE,
        planned=FIGURE,
        room=FIGURE,
        unit=TEXT,
        share_of_limit=FIGURE,
        temperature_degc=FIGURE,
    )
    unit = record(
        unit=TEXT,
        verdict=one_of(*get_args(Verdict)),
        binds=record(**REQUIREMENT, at_s=FIGURE, value=FIGURE, limit=FIGURE, unit=TEXT),
        load=FIGURE,
        load_interval=INTERVAL,
        temperatures_degc=listed(FIGURE),
        power_ons=COUNT,
        records=COUNT,
        further_power_ons=FIGURE,
        further_records=FIGURE,
        decidable=YES_OR_NO,
        channels=listed(channel),
        notes=listed(TEXT),
    )
    counts = record(**dict.fromkeys(get_args(Verdict), COUNT))
    return record(planner=TEXT, spec=SPEC, rates=RATES, counts=counts, units=listed(unit), notes=listed(TEXT))


def check_plan() -> Schema:
    """check_plan.json: checks that decide a unit, the cheapest first."""
    check = record(
        load=FIGURE,
        decides=FIGURE,
        temperatures_degc=listed(NUMBER),
        tests=listed(record(test=TEXT, motions=listed(COUNT))),
        power_ons_per_temperature=COUNT,
        time_s=FIGURE,
        looks=COUNT,
        expected_power_ons_per_temperature=FIGURE,
    )
    return record(planner=TEXT, spec=SPEC, rates=RATES, checks=listed(check), notes=listed(TEXT))


def forecast() -> Schema:
    """forecast.json: the drift of every channel, and until when each unit keeps its requirements."""
    from planner.fleet.dates import Outcome
    from planner.fleet.drift import Correction

    unit = record(
        unit=TEXT,
        outcome=one_of(*get_args(Outcome)),
        overdue=YES_OR_NO,
        day=FIGURE,
        date=WORD,
        binds=or_null(record(**REQUIREMENT)),
        largest_terms=listed(record(term=TEXT, share_of_limit=FIGURE)),
        load=or_null(record(day=listed(FIGURE), median=listed(FIGURE), upper=listed(FIGURE))),
        notes=listed(TEXT),
    )
    return record(
        planner=TEXT,
        spec=SPEC,
        history=TEXT,
        start=WORD,
        confidence=NUMBER,
        until_day=FIGURE,
        until=TEXT,
        today_day=FIGURE,
        today=TEXT,
        corrected_by=one_of(*get_args(Correction)),
        methods=named(TEXT),
        validation=listed(_score()),
        units=listed(unit),
        channels=listed(_drift()),
        suspects=listed(TEXT),
        notes=listed(TEXT),
    )


def _score() -> Schema:
    """How a method did on the ends of histories that it had not seen."""
    return record(
        error=TEXT,
        method=TEXT,
        cases=COUNT,
        rmse=FIGURE,
        naive_rmse=FIGURE,
        coverage=FIGURE,
        interval_score=FIGURE,
        unit=TEXT,
        widened_by=FIGURE,
        beats_naive=YES_OR_NO,
        recommended=YES_OR_NO,
        why_not=WORD,
    )


def _drift() -> Schema:
    """A channel's history; its drift and forecast where there is enough of it."""
    ahead = record(day=listed(FIGURE), value=listed(FIGURE), half_width=listed(FIGURE))
    return record(
        {"drift_per_week": FIGURE, "drift_per_week_ci95_half": FIGURE, "forecast": ahead},
        unit=TEXT,
        error=TEXT,
        term=TEXT,
        method=TEXT,
        points=COUNT,
        display_unit=TEXT,
        day=listed(FIGURE),
        value=listed(FIGURE),
        corrected_by=FIGURE,
        why_not=WORD,
    )


def recalibration() -> Schema:
    """recalibration.json: visits, hours and what they renew, per unit; sessions of several units."""
    renewed = {"renews": listed(TEXT), "time_s": FIGURE}
    visit = record(**VISIT, **renewed, day=FIGURE, date=TEXT, load_before=FIGURE, load_after=FIGURE)
    shortest = record(
        VISIT, **renewed, day=FIGURE, until_day=FIGURE, until=TEXT, load_without=FIGURE, load_with=FIGURE
    )
    load = {"day": listed(FIGURE), "with": listed(FIGURE), "without": listed(FIGURE)}
    unit = record(
        unit=TEXT,
        time_s=FIGURE,
        whole=YES_OR_NO,
        proved=YES_OR_NO,
        overdue=YES_OR_NO,
        kept_until_day=FIGURE,
        kept_until=TEXT,
        visits=listed(visit),
        shortest=listed(shortest),
        binding=listed(record(term=TEXT, share_of_limit=FIGURE, renewable=YES_OR_NO)),
        load=record(**load),
    )
    session = record(
        day=FIGURE, date=TEXT, units=listed(TEXT), time_s=FIGURE, by_themselves_s=FIGURE, fits=YES_OR_NO
    )
    return record(
        planner=TEXT, spec=SPEC, start=WORD, units=listed(unit), sessions=listed(session), notes=listed(TEXT)
    )
