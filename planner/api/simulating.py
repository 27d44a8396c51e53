"""What a bench would have measured: simulate, simulate_signals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.api.answer import Answer, PlanLike, Row, plan_tree_if_any
from planner.api.data import frame_of, rows_of
from planner.api.given import SpecLike, whole
from planner.nouns.progress import Progress, silent

if TYPE_CHECKING:
    from pandas import DataFrame

    from planner.nouns.dwell_table import DwellTable
    from planner.pipelines.signals import Written
    from planner.report.blocks import Report
    from planner.simulate.campaign import Truth


@dataclass(frozen=True)
class SimulateAnswer(Answer):
    """The dwell table that the bench would have measured, and the truth behind it. Rows: its records."""

    table: DwellTable
    truth: Truth

    def to_dict(self) -> dict[str, Any]:
        """How many records of how many power-ons."""
        return {"rows": len(self.table), "runs": len(set(self.table.run.tolist()))}

    def rows(self) -> Sequence[Row]:
        """One row a record."""
        return rows_of(self.table)

    def to_pandas(self) -> DataFrame:
        """The dwell table."""
        return frame_of(self.table)

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """One line."""
        from planner.report.blocks import Report

        said = self.to_dict()
        return (Report("Simulated data", "", f"{said['rows']} records of {said['runs']} power-ons"),)

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """The dwell table at `out`, the truth beside it."""
        from planner.dwells.dwell_files import dwell_form, dwells_bytes
        from planner.export.truth import truth_path, truth_text

        return {
            out: dwells_bytes(self.table, dwell_form(out)),
            truth_path(out): truth_text(self.truth, out.name),
        }


def simulate(
    spec: SpecLike,
    *,
    plan: PlanLike | None = None,
    hidden: Sequence[str] = (),
    seed: int = 1,
    settings: Mapping[str, object] | None = None,
    curves: str = "measured",
    latitude_deg: float = 45.0,
) -> SimulateAnswer:
    """The dwell table that the bench of a plan would have measured, with any undeclared effects.

    plan: left out, the spec's tests by default; hidden: `EFFECT=VALUE`, as of the command; settings: keys of
    its `--set`, and `case`, `signs`, `temperature_error`, `spikes`; curves: family of the temperature curves.
    Raises InputError for an effect, a setting or a family that there is not.
    """
    from planner.pipelines import data as pipeline
    from planner.simulate.settings import settings_from, settings_of

    loaded = whole(spec)
    drawn = settings_from(dict(settings or {}), settings_of(loaded.spec))
    tree = plan_tree_if_any(plan)
    return SimulateAnswer(*pipeline.simulate(loaded, tree, hidden, seed, drawn, latitude_deg, curves))


@dataclass(frozen=True)
class SignalsAnswer(Answer):
    """Recordings from power-on, in files. Rows: the coefficients of the unit that made them."""

    written: Written

    def to_dict(self) -> dict[str, Any]:
        """Where they are, and how long."""
        w = self.written
        return {"written": [str(path) for path in w.files], "runs": w.runs, "samples": w.samples}

    def rows(self) -> Sequence[Row]:
        """The truth."""
        terms = self.written.truth.terms
        return [{"error": t.error, "term": t.term, "value_si": t.value, "hidden": t.hidden} for t in terms]

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """One line."""
        from planner.report.blocks import Report

        w = self.written
        return (Report("Simulated signals", "", f"{w.samples} samples of {w.runs} power-ons"),)


def simulate_signals(
    spec: SpecLike,
    out: str | Path,
    *,
    form: str = "parquet",
    rate_hz: float = 1000.0,
    flight: bool = False,
    plan: PlanLike | None = None,
    hidden: Sequence[str] = (),
    seed: int = 1,
    settings: Mapping[str, object] | None = None,
    curves: str = "measured",
    latitude_deg: float = 45.0,
    progress: Progress = silent,
) -> SignalsAnswer:
    """What the unit says from power-on, sample by sample, of a plan's campaign or the spec's flight (K 3.2).

    form: `parquet`, or `packets` of 34 bytes with a map each; settings: as of `simulate`, and coloured_gyro,
    coloured_accelerometer, coloured_time, spikes_of_samples, bursts_per_hour, thermometer_dies.
    Raises InputError for a form, a rate, an effect or a setting that there is not.
    """
    from planner.export.signals import form_named
    from planner.pipelines.signals import simulate_signals as flow

    tree = plan_tree_if_any(plan)
    found = flow(
        whole(spec), tree, Path(out), form_named(form), hidden, seed, dict(settings or {}),
        rate=rate_hz, flight=flight, latitude_deg=latitude_deg, curves=curves, progress=progress,
    )  # fmt: skip
    return SignalsAnswer(found)
