"""The flow of simulated signals: spec, and a plan or its flight → recordings from power-on in a folder."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from planner.errors import InputError
from planner.export.signals import Form, packets_map, signal_files
from planner.export.truth import truth_text
from planner.nouns.progress import Progress, silent
from planner.pipelines.data import bench_design
from planner.plan.spec_to_trajectory import on_its_day, trajectory_of
from planner.simulate.campaign import Truth, prepared
from planner.simulate.families import family_named
from planner.simulate.hidden import hidden_effect
from planner.simulate.settings import settings_from, settings_of
from planner.simulate.signals import Signals, campaign_signals, disturbed_by, flight_signals, recorded
from planner.spec.load import LoadedSpec
from planner.units import UnitError
from planner.whole_files import write_whole

RATES_HZ = (10.0, 10_000.0)


@dataclass(frozen=True)
class Written:
    """What was written: files, power-ons, samples, and the unit as it was drawn."""

    files: tuple[Path, ...]
    runs: int
    samples: int
    truth: Truth


def simulate_signals(
    loaded: LoadedSpec,
    plan: Mapping[str, object] | None,
    out: Path,
    form: Form,
    hidden: Sequence[str],
    seed: int,
    written: Mapping[str, object],
    *,
    rate: float = 1000.0,
    flight: bool = False,
    latitude_deg: float = 45.0,
    curves: str = "measured",
    progress: Progress = silent,
) -> Written:
    """One recording a power-on of the campaign, or one of the flight, and truth.json, in the folder `out`.

    Raises InputError for a setting, an effect or a rate that cannot be.
    """
    if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
        raise InputError(f"--rate must lie between {RATES_HZ[0]:g} and {RATES_HZ[1]:g} Hz, not {rate:g}")
    try:
        disturbed, rest = disturbed_by(written)
    except (UnitError, ValueError) as error:
        raise InputError(f"simulation setting: {error}") from error
    spec = loaded.spec
    unit, truth = recorded(
        bench_design(spec, plan, latitude_deg),
        prepared(spec, family_named(curves)),
        seed,
        settings_from(rest, settings_of(spec)),
        disturbed,
        [hidden_effect(text) for text in hidden],
        rate,
    )

    if flight:
        last_day = float(unit.design.conditions.day.max())
        flown = on_its_day(trajectory_of(spec.trajectory, loaded.folder), spec, last_day)
        recordings = iter([flight_signals(unit, flown)])
    else:
        recordings = campaign_signals(unit)
    return _written(recordings, out, form, rate, truth, progress)


def _written(
    recordings: Iterator[Signals], out: Path, form: Form, rate: float, truth: Truth, progress: Progress
) -> Written:
    """The files of recordings in a folder, one recording at a time; with packets the map that reads them."""
    files, runs, samples, starts = list[Path](), 0, 0, dict[str, float]()
    for signals in recordings:
        progress(f"recording power-on {signals.run}")
        for name, content in signal_files(signals, form).items():
            if out / name not in files:
                files.append(out / name)
                write_whole(out / name, content)
                starts[name] = signals.start_s
        runs, samples = runs + 1, samples + len(signals.time)
    if form == "packets":
        files.append(out / "map.yaml")
        write_whole(files[-1], packets_map(starts, rate))
    files.append(out / "truth.json")
    write_whole(files[-1], truth_text(truth, out.name))
    return Written(tuple(files), runs, samples, truth)
