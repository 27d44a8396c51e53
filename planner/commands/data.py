"""The commands for measured data, no arithmetic: simulate, calibrate, apply."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from planner.commands.options import AsJson, DataTable, Seed, SpecFile, SpecOption
from planner.commands.output import progress_line, say

Hidden = Annotated[
    list[str] | None,
    typer.Option(metavar="EFFECT=VALUE", help="An undeclared effect; may be given several times."),
]
Case = Annotated[str, typer.Option(metavar="random|worst", help="Sizes within the budget, or all of it.")]
Signs = Annotated[str, typer.Option(metavar="random|plus", help="Signs of the errors.")]
ThermometerError = Annotated[
    float, typer.Option(min=0.0, max=50.0, metavar="KELVIN", help="One sigma of the unit's thermometer.")
]
Spikes = Annotated[
    float, typer.Option(min=0.0, max=1.0, metavar="SHARE", help="Of readings that are 40 sigma off.")
]
SettingsFile = Annotated[
    Path | None, typer.Option(metavar="FILE.yaml", help="Terms of the error model, as for --set.")
]
Assigned = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="white_gyro, white_accelerometer (of a 1 s record), in_run_time, temperature_jitter, "
        "spike_size; run_to_run, in_run, storage, temperature_residual, references: on|off.",
    ),
]
MethodName = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        help="declared_effects (the spec's), or one of those below.",
    ),
]
Prior = Annotated[
    Path | None,
    typer.Option(metavar="CALIBRATION", help="Old calibration.json that these few records renew."),
]
Turn = Annotated[
    float | None,
    typer.Option(
        metavar="DEG",
        help="By which a cube was turned, e.g. 1440 for four turns [as it reads, while sure].",
    ),
]
Robust = Annotated[str, typer.Option(metavar="no|huber|bisquare", help="Resist outliers.")]
Nodes = Annotated[
    int | None,
    typer.Option(
        min=2,
        max=1000,
        metavar="N",
        help="Of smooth tables, evenly over the temperatures [every 5 K and four times between visits, "
        "33 at most].",
    ),
]
Curves = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        help="Temperature curves: measured (tables: cosines), cosines, kink, cubic, matern.",
    ),
]
Latitude = Annotated[float, typer.Option(min=-90.0, max=90.0, metavar="DEG", help="Of the bench.")]
LatitudeIfKnown = Annotated[
    float | None, typer.Option(min=-90.0, max=90.0, metavar="DEG", help="Of the bench.")
]


SignalForm = Annotated[
    str | None,
    typer.Option("--signals", metavar="FORM", help="Samples instead of records: parquet, or packets."),
]
SignalRate = Annotated[float, typer.Option("--rate", metavar="HZ", help="Of the samples.")]
OfFlight = Annotated[bool, typer.Option("--flight", help="Samples of the spec's flight, not of the bench.")]
NoiseAccount = Annotated[
    Path | None,
    typer.Option(metavar="ACCOUNT", help="DATA.account.json of `reduce`: its noise goes into random.json."),
]


_DEFAULTS = {"case": "random", "signs": "random", "temperature_error": "0.0 K", "spikes": 0.0}


def simulate(
    spec: SpecFile,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DATA", help="Dwell table to write.")],
    plan: Annotated[
        Path | None, typer.Option(metavar="PLAN", help="plan.json or its folder [the spec's tests].")
    ] = None,
    hidden: Hidden = None,
    seed: Seed = 1,
    case: Case = "random",
    signs: Signs = "random",
    temperature_error: ThermometerError = 0.0,
    spikes: Spikes = 0.0,
    settings: SettingsFile = None,
    assign: Assigned = None,
    curves: Curves = "measured",
    latitude: Latitude = 45.0,
    signals: SignalForm = None,
    rate: SignalRate = 1000.0,
    flight: OfFlight = False,
    as_json: AsJson = False,
) -> None:
    """Simulate the bench campaign of a plan, with any undeclared effects; truth beside the data.

    --hidden takes EFFECT=VALUE and the effect's parameters: "warm_up=0.01 deg/s,time_constant=600 s".
    --signals parquet|packets writes what the unit says sample by sample, a file a power-on, into the folder
    DATA; --set then also takes coloured_gyro, coloured_accelerometer, coloured_time, spikes_of_samples
    (share), bursts_per_hour, thermometer_dies (s since power-on). `planner reduce` reads it.

    Example: planner simulate spec.yaml --plan plans/spec --hidden g_sensitivity=0.01deg/s/g -o data.csv
    """
    from planner.api import simulating
    from planner.export.truth import truth_path

    shown = {"case": case, "signs": signs, "temperature_error": f"{temperature_error} K", "spikes": spikes}
    asked: dict[str, Any] = {"plan": plan, "hidden": hidden or (), "seed": seed, "curves": curves}
    asked |= {"latitude_deg": latitude, "settings": _settings(settings, shown, assign or [])}
    if signals is not None:
        with progress_line() as progress:
            recorded = simulating.simulate_signals(
                spec, out, form=signals, rate_hz=rate, flight=flight, progress=progress, **asked
            )
        say(recorded, as_json)
        return
    found = simulating.simulate(spec, **asked)
    say(found, as_json, out, extra={"written": [str(out), str(truth_path(out))]})


def _settings(file: Path | None, shown: Mapping[str, object], assigned: list[str]) -> dict[str, object]:
    """Settings of a file, then options that are not left as they are, then --set."""
    from planner.pipelines.data import simulation_settings
    from planner.simulate.settings import pairs

    chosen = {key: value for key, value in shown.items() if value != _DEFAULTS[key]}
    return {**({} if file is None else simulation_settings(file)), **chosen, **pairs(assigned)}


def calibrate(
    data: DataTable,
    spec: SpecOption,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder [calibrations/<data name>/].")
    ] = None,
    method: MethodName = "declared_effects",
    prior: Prior = None,
    robust: Robust = "no",
    latitude: LatitudeIfKnown = None,
    nodes: Nodes = None,
    turn: Turn = None,
    noise: NoiseAccount = None,
    as_json: AsJson = False,
) -> None:
    """Fit the declared error model: coefficients with uncertainties, before and after, files for firmware.

    Methods and what each needs: six_position_gyro, six_position_accelerometer (rests with every axis up and
    down); scale_factor_rotations (turns both ways); nonlinearity, …_table, …_polynomial (three, eight,
    several rates or loads); centrifuge (three loads, several mountings); load_tables (eight loads to 100 g,
    six faces); bias_and_warm_up, drift_table, drift_table_over_temperature (rests from power-on on);
    temperature_and_rate_tables, …_over_time_on (ramps at every temperature); temperature_tables,
    …_with_rate, …_with_rate_and_time_on (two temperatures; ramps; from power-on); triad_least_squares (four
    rests, ref_acc); cube (six faces, turns by 90 deg, no references), cube_accelerometers, cube_gyros;
    free_orientations, free_orientations_symmetric, ellipsoid (nine rests, edges too, no references);
    rests_and_turns (the same with turns between: gyros by the Poisson equation); sins_outputs (DATA is a
    navigation log: time_s, roll_deg, pitch_deg, heading_deg, v_north_mps, v_east_mps, v_down_mps, with
    record, table_rate_x_dps …, table_acc_x_g …, lat_deg or --latitude). By their sources' words: A is
    triad_least_squares, B2 … B6 the tasks of B (B1 is `reduce`).

    With `plan: {temperature_estimator: smooth}` tables are the posterior mean of each curve, --nodes of it.

    Example: planner calibrate data.csv --spec spec.yaml -o calibrations/data
    """
    from planner.api import data as api

    with progress_line() as progress:
        found = api.calibrate(
            data,
            spec,
            method=method,
            prior=prior,
            robust=robust,
            latitude_deg=latitude,
            nodes=nodes,
            turn_deg=turn,
            noise=noise,
            progress=progress,
        )
    say(found, as_json, out or Path("calibrations") / data.stem, spec)


def apply(
    calibration: Annotated[
        Path,
        typer.Argument(metavar="CALIBRATION", help="calibration.json or its folder.", show_default=False),
    ],
    raw: Annotated[Path, typer.Argument(metavar="RAW", help="Recording or dwell table.", show_default=False)],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="OUT", help="Corrected CSV to write.")],
    columns: Annotated[
        Path | None, typer.Option(metavar="MAP.yaml", help="Which column of a recording is what.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Correct a recording, or a dwell table, with a calibration.

    Example: planner apply calibrations/data recording.csv -o corrected.csv
    """
    from planner.api import data

    say(data.apply(calibration, raw, out, columns=columns), as_json)
