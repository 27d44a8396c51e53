"""Measured data: reduce, look, calibrate, apply."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.api.answer import Answer, Row, of_units, page
from planner.api.given import SpecLike, read
from planner.errors import InputError
from planner.nouns.progress import Progress, silent

if TYPE_CHECKING:
    from pandas import DataFrame

    from planner.nouns.calibration import Calibration
    from planner.nouns.dwell_table import DwellTable
    from planner.recordings.look import Look
    from planner.recordings.reduction import Reduction
    from planner.report.blocks import Report


def frame_of(table: DwellTable) -> DataFrame:
    """A dwell table as a data frame, its columns as in the file. Raises InputError without pandas."""
    try:
        import pandas as pd
    except ImportError:
        raise InputError("to_pandas() needs pandas; pip install 'planner[notebook]'") from None
    from planner.dwells.dwell_files import dwells_bytes

    return pd.read_parquet(BytesIO(dwells_bytes(table, "parquet")))


def rows_of(table: DwellTable) -> Sequence[Row]:
    """A dwell table, one mapping a record, its keys as the columns of the file."""
    import pyarrow.parquet as pq

    from planner.dwells.dwell_files import dwells_bytes

    found: list[dict[str, Any]] = pq.read_table(BytesIO(dwells_bytes(table, "parquet"))).to_pylist()
    return found


# ---------------------------------------------------------------- recordings


@dataclass(frozen=True)
class ReduceAnswer(Answer):
    """A dwell table from raw recordings, and the account of every sample. Rows: its records."""

    record: Reduction
    read: tuple[Path, ...]

    def to_dict(self) -> dict[str, Any]:
        """The account."""
        from planner.export.reduction import reduction_document

        return reduction_document(self.record)

    def rows(self) -> Sequence[Row]:
        """One row a record."""
        return rows_of(self.record.whole)

    def to_pandas(self) -> DataFrame:
        """The dwell table."""
        return frame_of(self.record.whole)

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """The account in words."""
        from planner.report.subjects.reduction import reduction_report

        return (reduction_report(self.record),)

    @property
    def notes(self) -> tuple[str, ...]:
        """Of the table."""
        return tuple(self.record.table.notes)

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """The dwell table at `out`, the account beside it. Raises InputError for a file that was read."""
        from planner.dwells.dwell_files import dwells_bytes
        from planner.export.reduction import account_text

        form, beside = account_place(out, self.read)
        return {out: dwells_bytes(self.record.whole, form), beside: account_text(self.record)}


def account_place(out: Path, read: Sequence[Path]) -> tuple[str, Path]:
    """The form of a dwell table's file, and where its account goes; neither may be a file that is read."""
    from planner.dwells.dwell_files import dwell_form
    from planner.export.reduction import refuse_overwriting

    form, beside = dwell_form(out), out.with_name(out.stem + ".account.json")
    refuse_overwriting((out, beside), read)
    return form, beside


def reduce(
    *raw: str | Path,
    columns: str | Path | None = None,
    plan: str | Path | None = None,
    latitude_deg: float | None = None,
    progress: Progress = silent,
) -> ReduceAnswer:
    """Raw recordings → dwell table with an account of every sample.

    columns: a map's file, which column is what; plan: its steps are the records; latitude_deg: of the bench,
    for references from the plan. Raises InputError for what cannot be read, or holds no record.
    """
    from planner.pipelines import recordings as pipeline

    paths = [Path(one) for one in raw]
    beside = [None if one is None else Path(one) for one in (columns, plan)]
    found = pipeline.reduce(paths, beside[0], beside[1], latitude_deg, progress)
    return ReduceAnswer(found, (*paths, *(one for one in beside if one is not None)))


@dataclass(frozen=True)
class LookAnswer(Answer):
    """What is in a recording, and the column map that reads it. Rows: its power-ons."""

    record: Look

    @property
    def map_text(self) -> str:
        """The column map, commented."""
        return self.record.map_text

    def to_dict(self) -> dict[str, Any]:
        """Power-ons with rests, clock, gaps, findings; times in s."""
        from planner.export.look import look_document

        return look_document(self.record)

    def rows(self) -> Sequence[Row]:
        """One row a power-on."""
        return list(self.to_dict()["power_ons"])

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """The page."""
        from planner.report.subjects.look import look_report

        return (look_report(self.record),)

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """report.html and map.yaml in the folder `out`."""
        return {out / "report.html": page(self.reports[0], command), out / "map.yaml": self.map_text}


def look(
    *recording: str | Path, columns: str | Path | None = None, progress: Progress = silent
) -> LookAnswer:
    """What is in a recording: signals, rests, temperature, noise, gaps, what is odd.

    columns: a map's file; left out, it is guessed. Raises InputError for what cannot be read.
    """
    from planner.recordings.look import look as look_at

    paths = [Path(one) for one in recording]
    return LookAnswer(look_at(paths, None if columns is None else Path(columns), progress))


# ---------------------------------------------------------------- calibrate, apply


@dataclass(frozen=True)
class CalibrateAnswer(Answer):
    """The calibration of every unit in a table. Rows: coefficients, values in `unit`."""

    records: tuple[Calibration, ...]

    def to_dict(self) -> dict[str, Any]:
        """calibration.json; of several units under `units`."""
        from planner.export.calibration import calibration_document

        return of_units([calibration_document(one) for one in self.records])

    def rows(self) -> Sequence[Row]:
        """One row a coefficient."""
        from planner.export.calibration import calibration_document

        documents = [calibration_document(one) for one in self.records]
        return [
            {"of_unit": document["unit"], "sensor": name, **{**c, "ci95": None}, **_interval(c["ci95"])}
            for document in documents
            for name, sensor in document["sensors"].items()
            for c in sensor["coefficients"]
        ]

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """One of each unit."""
        from planner.report.subjects.calibration import calibration_report

        return tuple(calibration_report(one) for one in self.records)

    @property
    def notes(self) -> tuple[str, ...]:
        """Of every unit, and what its firmware files leave out."""
        from planner.export.firmware import left_out_notes

        return tuple(note for one in self.records for note in (*one.notes, *left_out_notes(one)))

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """calibration.json, random.json, C header, binary image, before_after.svg; a folder a unit."""
        from planner.export.calibration_files import calibration_files, unit_folders
        from planner.report.charts.calibration import before_after_svg

        files = calibration_files(self.records, out)
        places = unit_folders(out, [one.unit for one in self.records])
        for one, place in zip(self.records, places, strict=True):
            if one.sensors:
                files[place / "before_after.svg"] = before_after_svg(one)
        return files


def _interval(ends: Sequence[float] | None) -> dict[str, float | None]:
    low, high = ends or (None, None)
    return {"ci95_low": low, "ci95_high": high}


def calibrate(
    data: str | Path,
    spec: SpecLike,
    *,
    method: str = "declared_effects",
    prior: str | Path | None = None,
    robust: str = "no",
    latitude_deg: float | None = None,
    nodes: int | None = None,
    turn_deg: float | None = None,
    noise: str | Path | None = None,
    progress: Progress = silent,
) -> CalibrateAnswer:
    """Dwell table → coefficients of the declared error model with honest intervals, for every unit in it.

    method: see `planner calibrate --help`; prior: an old calibration.json that these records renew; robust:
    `no`, `huber` or `bisquare`; nodes: of smooth tables; turn_deg: by which a cube was turned;
    noise: account of a reduction, whose white and coloured noise goes into random.json.
    Raises NothingFound when the data determine nothing.
    """
    from planner.calibrate.methods import fit_options
    from planner.export.calibration import read_tables
    from planner.pipelines import data as pipeline

    old = None if prior is None else read_tables(Path(prior))
    options = fit_options(method, robust, latitude_deg, old, nodes, turn_deg)
    account = None if noise is None else Path(noise)
    return CalibrateAnswer(pipeline.calibrate(Path(data), read(spec), options, progress, account))


@dataclass(frozen=True)
class ApplyAnswer(Answer):
    """A corrected recording or dwell table, in the file `out`. Rows: what stands in it."""

    out: Path
    count: int
    said: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Where it is, and how many rows."""
        return {"written": str(self.out), "rows": self.count, "notes": list(self.said)}

    def rows(self) -> Sequence[Row]:
        """The file's rows."""
        import csv

        with self.out.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(line for line in file if not line.startswith("#")))

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """One line."""
        from planner.report.blocks import Report

        return (Report("Corrected data", "", f"{self.out}, {self.count} rows"),)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the correction lacks, and temperatures beyond the calibration's."""
        return self.said


def apply(
    calibration: str | Path, raw: str | Path, out: str | Path, *, columns: str | Path | None = None
) -> ApplyAnswer:
    """Correct a recording, or a dwell table, with a calibration, into the file `out`, in bounded memory.

    columns: a map's file, for a recording. Raises InputError for what cannot be read or written.
    """
    from planner.pipelines import data as pipeline

    of = None if columns is None else Path(columns)
    count, said = pipeline.apply(Path(calibration), Path(raw), Path(out), of)
    return ApplyAnswer(Path(out), count, tuple(said))
