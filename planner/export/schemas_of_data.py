"""JSON Schemas of what stands beside measured and simulated data: account, truth, random."""

from __future__ import annotations

from planner.export.schema_words import (
    COUNT,
    FIGURE,
    INTERVAL,
    NUMBER,
    TEXT,
    WORD,
    YES_OR_NO,
    Schema,
    listed,
    named,
    or_null,
    record,
)


def account() -> Schema:
    """DATA.account.json: every row, every stretch without one, every sample and its reason (`reduction`)."""
    of_run = {
        "unit": TEXT,
        "run": COUNT,
        "start_s": NUMBER,
        "end_s": NUMBER,
        "samples": COUNT,
    }
    jitter = record(usual_step_s=NUMBER, deviation_s=NUMBER, taken_over_s=NUMBER)
    return record(
        planner=TEXT,
        source=TEXT,
        rows=listed(record(**of_run, step=TEXT, left_out=named(COUNT))),
        stretches_left_out=listed(record(**of_run, kind=TEXT, reason=TEXT)),
        files=named(record({"jitter": jitter}, rate_hz=NUMBER, samples=named(COUNT))),
        motions=COUNT,
        record_s=FIGURE,
        record_is_lower_bound=YES_OR_NO,
        spec_snippet=WORD,
        allan=listed(_allan()),
        noise=listed(_noise()),
        notes=listed(TEXT),
    )


def _allan() -> Schema:
    """Allan deviations of a channel's longest rest with the terms that they show (IEEE Std 952, annex C)."""
    term = record(name=TEXT, value=FIGURE, ci95=INTERVAL, unit=TEXT, seen=YES_OR_NO)
    curve = {key: listed(NUMBER) for key in ("tau_s", "deviation", "low", "high")}
    return record(
        channel=TEXT,
        unit=TEXT,
        **curve,
        terms=listed(term),
        best_time_s=FIGURE,
        best_time_is_lower_bound=YES_OR_NO,
    )


def _noise() -> Schema:
    """White and coloured noise of a channel's samples; null where the rest does not tell it."""
    told = or_null(record(value=NUMBER, ci95=INTERVAL))
    return record(channel=TEXT, unit=TEXT, white_density=told, coloured=told, correlation_time_s=told)


def truth() -> Schema:
    """truth.json: the unit as it was drawn; `curve` comes on top of `value`, at `temperature_degc`."""
    curve = {"temperature_degc": listed(NUMBER), "curve": listed(NUMBER)}
    term = record(
        {"nonlinear_si": named(NUMBER), **curve},
        error=TEXT,
        term=TEXT,
        value=NUMBER,
        unit=TEXT,
        hidden=YES_OR_NO,
    )
    return record({"references_si": named(NUMBER)}, data=TEXT, seed=COUNT, terms=listed(term))


def random() -> Schema:
    """random.json: every spread of every channel with its interval."""
    spread = record(
        kind=TEXT, error=TEXT, channel=TEXT, value=FIGURE, unit=TEXT, ci95=INTERVAL, measured=YES_OR_NO
    )
    sensors = record({name: listed(spread) for name in ("gyro", "accelerometer")})
    return record(planner=TEXT, unit=TEXT, data=TEXT, random=sensors)
