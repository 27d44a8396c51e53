"""JSON Schemas (draft 2020-12) of the files that planner reads and writes, by the file's name.

Those that planner reads come from the models that read them; those that it only writes are said here, by the
keys on which others may rely. A later version may write more keys; it takes none away without another number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from planner.errors import InputError
from planner.export.schema_words import (
    ANYTHING,
    COUNT,
    FIGURE,
    INTERVAL,
    NUMBER,
    SPEC,
    TEXT,
    YES_OR_NO,
    Schema,
    listed,
    named,
    one_of,
    or_null,
    record,
)
from planner.nouns.plan_file import DRAFT

VERSION = 1


@dataclass(frozen=True)
class FileKind:
    """A file by its name, and who makes it; schema: the command that prints its schema, where it has one."""

    name: str
    made_by: str
    schema: str = ""


FILES = (
    FileKind("spec.yaml", "you, `planner init`, `planner update`", "`planner schema`"),
    FileKind("plan.json", "`planner plan`", "`planner schema --of plan`"),
    FileKind("steps.csv", "`planner plan`"),
    FileKind("map.yaml", "`planner look`, `planner reduce --guess`", "`planner schema --of column-map`"),
    FileKind("data.csv, .parquet, .h5", "`planner reduce`, `planner simulate`"),
    FileKind("data.account.json", "`planner reduce`", "`planner schema --of account`"),
    FileKind("truth.json", "`planner simulate`", "`planner schema --of truth`"),
    FileKind("calibration.json", "`planner calibrate`", "`planner schema --of calibration`"),
    FileKind("random.json", "`planner calibrate`", "`planner schema --of random`"),
    FileKind("calibration.h, calibration.bin", "`planner calibrate`"),
    FileKind("diagnosis.json", "`planner diagnose`", "`planner schema --of diagnosis`"),
    FileKind("verify.json", "`planner verify -o`", "`planner schema --of verify`"),
    FileKind("sweep.json, sweep.csv", "`planner sweep`", "`planner schema --of sweep`"),
    FileKind("comparison.json", "`planner compare -o`", "`planner schema --of compare`"),
    FileKind("accept.json", "`planner accept -o`", "`planner schema --of accept`"),
    FileKind("check_plan.json", "`planner accept --plan -o`", "`planner schema --of check-plan`"),
    FileKind("forecast.json", "`planner forecast -o`", "`planner schema --of forecast`"),
    FileKind("recalibration.json", "`planner recalibrate -o`", "`planner schema --of recalibrate`"),
    FileKind("run.jsonl", "`planner run`: one object a line, of a step or an event"),
    FileKind("what --json prints", "every command", "`planner schema --of answer`"),
    FileKind("report.html", "most commands, with `-o`"),
)


def schema_of(of: str) -> Schema:
    """The schema of a file, its version in `$id` and title. Raises InputError for one that has none."""
    known = schemas()
    if of not in known:
        raise InputError(f"--of {of}: there is no schema of that; there are {', '.join(known)}")
    title = f"planner {'answer of --json' if of == 'answer' else of}, schema version {VERSION}"
    return {"$schema": DRAFT, "$id": f"urn:planner:{of}:{VERSION}", **known[of](), "title": title}


def schemas() -> dict[str, Callable[[], Schema]]:
    """File -> what makes its schema."""
    from planner.export import schemas_of_data, schemas_of_fleets
    from planner.nouns.plan_file import plan_schema
    from planner.recordings.map_schema import column_map_schema
    from planner.spec.schema import json_schema

    return {
        "spec": json_schema,
        "plan": plan_schema,
        "column-map": column_map_schema,
        "calibration": _calibration,
        "diagnosis": _diagnosis,
        "verify": _verify,
        "sweep": _sweep,
        "compare": _comparison,
        "accept": schemas_of_fleets.accept,
        "check-plan": schemas_of_fleets.check_plan,
        "forecast": schemas_of_fleets.forecast,
        "recalibrate": schemas_of_fleets.recalibration,
        "account": schemas_of_data.account,
        "truth": schemas_of_data.truth,
        "random": schemas_of_data.random,
        "answer": answer_schema,
    }


# ---------------------------------------------------------------- the files


def answer_schema() -> Schema:
    """What every command prints with --json."""
    fault = record(code=TEXT, path=TEXT, line=COUNT, column=COUNT, message=TEXT, remedy=TEXT)
    return record(
        command=TEXT, version=TEXT, ok=YES_OR_NO, exit_code=COUNT, faults=listed(fault), result=ANYTHING
    )


def _calibration() -> Schema:
    coefficient = record(
        error=TEXT,
        channel=TEXT,
        term=TEXT,
        temperature_degc=FIGURE,
        value=FIGURE,
        unit=TEXT,
        standard_error=FIGURE,
        ci95=or_null(INTERVAL),
        degrees_of_freedom=FIGURE,
        status=TEXT,
    )
    sensor = record(
        method=TEXT,
        coefficients=listed(coefficient),
        undetermined=listed(ANYTHING),
        residual=named(record(unit=TEXT, before=FIGURE, after=FIGURE)),
        tables=record(temperature_degc=listed(NUMBER)),
        notes=listed(TEXT),
    )
    return record(
        planner=TEXT,
        schema_version={"const": VERSION},
        unit=TEXT,
        data=TEXT,
        spec=SPEC,
        sensors=named(sensor),
        notes=listed(TEXT),
    )


def _diagnosis() -> Schema:
    term = record(name=TEXT, value=FIGURE, unit=TEXT, ci95=INTERVAL)
    rival = record(effect=TEXT, separated_by=FIGURE)
    effect = record(
        effect=TEXT,
        channels=listed(TEXT),
        terms=listed(term),
        p_value=FIGURE,
        rivals=listed(rival),
        below_bench_uncertainty=YES_OR_NO,
    )
    level = record(rms=FIGURE, ci95=INTERVAL)
    residual = record(
        unit=TEXT,
        before=level,
        after=level,
        within_run_before=FIGURE,
        within_run_after=FIGURE,
        noise_floor=FIGURE,
    )
    suspect = record(
        hypothesis=TEXT,
        value=FIGURE,
        unit=TEXT,
        ci95=INTERVAL,
        p_value=FIGURE,
        check=TEXT,
        stated_accuracy=FIGURE,
        chance_by_accuracy=FIGURE,
        within_accuracy=or_null(YES_OR_NO),
    )
    return record(
        planner=TEXT,
        schema_version={"const": VERSION},
        unit=TEXT,
        spec=SPEC,
        seed=COUNT,
        verdict=one_of("clean", "explained", "partly_explained", "unexplained", "untestable"),
        effects=listed(effect),
        unknown=listed(record(channels=listed(TEXT), varies_with=TEXT, p_value=FIGURE)),
        not_found=listed(record(effect=TEXT, upper_limit95=FIGURE, unit=TEXT)),
        untestable=listed(record(effect=TEXT, why=TEXT)),
        reference_suspects=listed(suspect),
        rows_left_out=listed(record(run=ANYTHING, channel=TEXT, size_sigma=FIGURE, guess=TEXT)),
        budget_exceeded=listed(record(error=TEXT, part=TEXT, measured=FIGURE, budget=FIGURE, unit=TEXT)),
        residual=named(residual),
        navigation=record(error=or_null(TEXT), unit=or_null(TEXT), before=FIGURE, after=FIGURE),
        next_measurement=listed(record(separates=listed(TEXT), condition=ANYTHING, time_s=FIGURE)),
        notes=listed(TEXT),
    )


def _verify() -> Schema:
    verdict = one_of("kept", "broken", "undecided")
    requirement = record(
        error=TEXT,
        at=TEXT,
        rule=TEXT,
        unit=TEXT,
        limit=NUMBER,
        achieved=FIGURE,
        at_promise=FIGURE,
        rms=FIGURE,
        share=NUMBER,
        ci95=INTERVAL,
        verdict=verdict,
        pessimism=FIGURE,
    )
    fault = record(check=TEXT, where=TEXT, what=TEXT)
    return record(
        planner=TEXT,
        spec=SPEC,
        plan_sha256=TEXT,
        verdict=verdict,
        recount=record(ok=YES_OR_NO, faults=listed(fault)),
        flights=COUNT,
        flights_wanted=COUNT,
        stopped=YES_OR_NO,
        seed=COUNT,
        requirements=listed(requirement),
        notes=listed(TEXT),
    )


def _sweep() -> Schema:
    point = record(
        {
            "time_s": NUMBER,
            "bound_s": NUMBER,
            "power_on_s": NUMBER,
            "requirements": listed(ANYTHING),
            "why": TEXT,
        },
        values=named(ANYTHING),
        digest=TEXT,
        status=one_of("planned", "infeasible", "stopped", "invalid"),
    )
    return record(planner=TEXT, spec=TEXT, keys=listed(TEXT), points=listed(point), wanted=COUNT)


def _comparison() -> Schema:
    """Lists run over the plans in the order given, differences over all but the first."""
    spent = record(name=TEXT, time_s=listed(NUMBER))
    reason = record(what=TEXT, why=TEXT, added_s=NUMBER)
    reached = record(error=TEXT, at=TEXT, rule=TEXT, unit=TEXT, limit=listed(FIGURE), achieved=listed(FIGURE))
    return record(
        differ=YES_OR_NO,
        plans=listed(TEXT),
        spec_sha256=listed(TEXT),
        time_s=listed(NUMBER),
        power_on_s=listed(NUMBER),
        gap=listed(FIGURE),
        benches=listed(spent),
        tests=listed(spent),
        actions=listed(spent),
        requirements=listed(reached),
        allowances=listed(record(error=TEXT, unit=TEXT, allowed=listed(FIGURE))),
        differences=listed(record(plan=TEXT, added_s=NUMBER, reasons=listed(reason))),
        same_steps=YES_OR_NO,
    )
