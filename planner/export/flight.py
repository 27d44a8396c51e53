"""A flight as a CSV file to put one's own numbers in."""

from __future__ import annotations

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.physics.attitude import rph_from_dcm
from planner.trajectories._table import COLUMNS, OPTIONAL

SECONDS_APART = 0.2
_DECIMALS = (2, 8, 8, 3, 4, 4, 4, 4, 4, 4, 2)
_TOP = """\
# A flight for planner: a row a moment, 1 to 1000 rows a second, a header, commas between the columns.
# time_s: seconds, rising evenly; no gap longer than five rows or 2 s
# lat_deg, lon_deg: degrees north and east, WGS-84; alt_m: metres above the ellipsoid
# v_north_mps, v_east_mps, v_down_mps: m/s over ground. All three may be left out: derived from the positions
# roll_deg, pitch_deg, heading_deg: right wing down, nose up, nose east of north. All three may be left out:
#   nose along the path, roll of a coordinated turn; not for what hovers
# temp_degc: of the unit; may be left out (then the spec's trajectory.temperature)
# In the spec: `trajectory: {file: THIS FILE}`; `planner check SPEC` says what is wrong and what was derived.
"""


def flight_template() -> str:
    """A turn of a minute with every column, which flies as it stands."""
    family = catalog.trajectories()["turn"]
    flight: Trajectory = family.build(family.parameters())
    rows = flight_rows(flight, SECONDS_APART)
    lines = (",".join(f"{x:.{n}f}" for x, n in zip(row, _DECIMALS, strict=True)) for row in rows.tolist())
    return "\n".join([_TOP + ",".join(COLUMNS + OPTIONAL), *lines, ""])


def flight_rows(flight: Trajectory, apart_s: float) -> Array:
    """(m, 11) the columns of a flight file, every so many seconds."""
    every = max(1, round(apart_s / float(flight.time_s[1] - flight.time_s[0])))
    roll, pitch, heading = (np.degrees(angle) for angle in rph_from_dcm(flight.attitude))
    place = (np.degrees(flight.latitude), np.degrees(flight.longitude), flight.altitude)
    columns = (
        flight.time_s,
        *place,
        *flight.velocity.T,
        roll,
        pitch,
        heading % 360.0,
        flight.temperature_degc,
    )
    return np.column_stack(columns)[::every]
