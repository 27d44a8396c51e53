"""Hypotheses about the bench's references: what a wrong one would add to every channel that is judged by it.

    y = (1 + κ) M (u + δu) + b,   δu what the reference does not say

An effect of the bench acts on all channels of a sensor with the same few coefficients, in directions that the
records themselves give (`bench_directions`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner import catalog
from planner.diagnose.channels.channel import Channel
from planner.diagnose.references import tilt_in_turns
from planner.diagnose.references.bench_directions import (
    at_rest,
    horizontal,
    loaded,
    through_the_unit,
)
from planner.diagnose.references.bench_of_rows import ON_BENCH, named_benches, on_bench, rows_by_bench
from planner.diagnose.references.bending_mounts import (
    at_several_temperatures,
    bends_with_temperature,
    gives_way_to_load,
)
from planner.diagnose.references.earth_in_turns import TERMS as EARTH_IN_TURNS
from planner.diagnose.references.earth_in_turns import as_at_rest, known_at_rest, left_out_of_turns
from planner.diagnose.references.fixture_faces import leaning_faces, resting_on_faces
from planner.diagnose.references.rate_of_arm import off_at_each_load, set_loads
from planner.diagnose.references.rate_of_each_level import off_at_each_level, set_rates
from planner.diagnose.references.rate_of_table import of_every_gyro, off_by_a_share, set_ways
from planner.diagnose.references.table_axis import beside_an_arm, off_the_axis
from planner.diagnose.references.tumbles import TERMS, forgotten_rate, without_north
from planner.effects._bench_frame import turning
from planner.measurement import evaluate, sensed
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import Sensor
from planner.physics.earth import EARTH_RATE_RADPS
from planner.protocols import Condition, Effect, Group, Parameter
from planner.spec.references import BenchAccuracy
from planner.units import STANDARD_GRAVITY_MPS2

LAGS_S = (60.0, 150.0, 300.0, 600.0)  # a minute to ten, each about twice the one before
MOST_SCALE = 0.05  # by which gravity or a table's rate may be off: beside a scale factor of -2, 2 would fit
MOST_TILT = float(np.radians(3.0))  # of a base: turns of which an arm feels a g were one of 70 deg
ONE_SCALE = 0.005  # 7 % of it: what a drive, gravity or a bend is off by is the same on each channel
ON_THE_ARM, IN_TURNS, TURNING = 0.0, 1.0, 2.0  # where a unit may be mounted another way: in both
BY_BENCH = frozenset(  # what has places of one bench among several
    {"base_tilt", "azimuth", "mounting", "local_gravity_by_bench", "table_rate_by_bench"}
)

Columns = Callable[[Channel, DwellTable, float], Array]


@dataclass(frozen=True)
class Reference:
    """A hypothesis about a reference; what a search asks of an effect it can ask of one of these.

    terms: its coefficients, shared by the channels, "" of one that nobody asks for; none: one for each column
    or_else: other ones that tell its size, where no record has those
    columns: (channel, table, place) -> (n, k)
    places: table -> where it may act, one block each (a threshold, a bench, a lag)
    bounds: table -> the least and the most of each coefficient (k,), SI, by what the rest of it says
    unlike: share of what the channels have in common by which they may differ; what they see of a rate that
        is off is the same of each, of a geometry only so far as it is known
    stated: what a bench's accuracy says of one coefficient, one sigma, SI; 0: nothing
    by_channel: whether each coefficient is seen by a channel of its own, and several have to see some
    narrow: whether the noise is not judged under it unasked: dear where few records carry loads
    said: the name in reports, where it is not `name`; check: what to look at
    alias: the sensor's error that no data tell it from where it acts on all records; alias_at: that where it
        acts at some places; record: the record that would tell
    """

    name: str
    sensors: tuple[Sensor, ...]
    unit: str
    terms: tuple[str, ...]
    columns: Columns
    check: str
    or_else: tuple[tuple[str, ...], ...] = ()
    stated: Callable[[BenchAccuracy], float] = lambda accuracy: 0.0
    places: Callable[[DwellTable], Sequence[float]] = lambda table: (0.0,)
    bounds: Callable[[DwellTable], tuple[Array, Array]] | None = None
    unlike: float = 0.5
    alias: str = ""
    alias_at: Callable[[float], str] = lambda place: ""
    record: str = ""
    by_channel: bool = False
    narrow: bool = False
    said: str = ""
    misfit: float = 0.05
    group: Group = "bias"
    parameters: tuple[Parameter, ...] = ()
    needs: frozenset[Condition] = field(default_factory=frozenset)
    variable: Condition | None = None
    temperature_of: str | None = None
    tabled: bool = False
    bench_only: bool = True
    largest: Mapping[Sensor, float] | None = None


def hypothesis(name: str) -> Effect | Reference:
    """An effect of the library, or a hypothesis about a reference, by its name."""
    return REFERENCES[name] if name in REFERENCES else catalog.effects()[name]


# ---------------------------------------------------------------- the hypotheses


def _base_tilt(c: Channel, table: DwellTable, place: float) -> Array:
    """At rest the tilt leans gravity; of a turn, what it does not average out (`tilt_in_turns`)."""
    conditions = c.model.conditions
    here = on_bench(table, place)[:, None]
    still = at_rest(conditions)[:, None]
    parts = place == tilt_in_turns.PARTS or (place >= ON_BENCH and _parted(table, tilt_in_turns.LARGE))
    turned = tilt_in_turns.tilted_turns(conditions, table.duration, parts)
    each = [still * v for v in horizontal(conditions)] + turned
    return through_the_unit(c, [STANDARD_GRAVITY_MPS2 * here * v for v in each])


def _hardly_seen(table: DwellTable) -> tuple[Array, Array]:
    """Bounds of the coefficients: a base that leans by more is seen to lean."""
    many = len(tilt_in_turns.AT_REST)
    return np.full(many, -MOST_TILT), np.full(many, MOST_TILT)


def _bases(table: DwellTable) -> Sequence[float]:
    """All rests, those and parts of turns, or what is on one of several benches."""
    parts = (tilt_in_turns.PARTS,) if _parted(table, tilt_in_turns.LEAST) else ()
    return (0.0, *parts, *(ON_BENCH + k for k in range(len(rows_by_bench(table)))))


def _parted(table: DwellTable, least: float) -> bool:
    return tilt_in_turns.parts_of_turns(table.conditions(), table.duration, least)


def _local_gravity(c: Channel, table: DwellTable, place: float) -> Array:
    here = ~loaded(c.model.conditions)
    return through_the_unit(c, [c.model.conditions.specific_force * here[:, None]])


def _gravity_on_bench(c: Channel, table: DwellTable, place: float) -> Array:
    """Beside that of the other benches, which the accelerometers' scale factors have."""
    here = ~loaded(c.model.conditions) & on_bench(table, place)
    return through_the_unit(c, [c.model.conditions.specific_force * here[:, None]])


def _rate_on_bench(c: Channel, table: DwellTable, place: float) -> Array:
    """Of one table among several, beside the gyros' scale factors on the others."""
    here = turning(c.model.conditions) & ~loaded(c.model.conditions) & on_bench(table, place)
    return through_the_unit(c, [c.model.conditions.rate * here[:, None]])


def _azimuth(c: Channel, table: DwellTable, place: float) -> Array:
    conditions = c.model.conditions
    north, east = horizontal(conditions)
    still = (at_rest(conditions) & on_bench(table, place))[:, None]
    size = np.abs(np.sum(north * conditions.rate, axis=1, keepdims=True)) * still
    return through_the_unit(c, [size * north, size * east])


def _mounting(c: Channel, table: DwellTable, place: float) -> Array:
    """Turned by three angles in one place: on the centrifuge, in all turns of the table, in both, on a bench.

    All but the first only accelerometers tell, by gravity and load: a gyro's misalignments are from turns.
    """
    conditions = c.model.conditions
    arm, turns = loaded(conditions), turning(conditions)
    apart = {ON_THE_ARM: arm, IN_TURNS: ~arm & turns, TURNING: turns}
    here = apart[place] if place in apart else on_bench(table, place)
    if place != ON_THE_ARM and c.sensor == "gyro":
        here = np.zeros_like(here)
    u = sensed(c.sensor, conditions) * here[:, None]
    return through_the_unit(c, [np.cross(np.broadcast_to(e, u.shape), u) for e in np.eye(3)])


def _mountings(table: DwellTable) -> Sequence[float]:
    conditions = table.conditions()
    arm = loaded(conditions)
    turns, rests = ~arm & turning(conditions), at_rest(conditions)
    on_the_arm = (ON_THE_ARM,) if arm.any() and not arm.all() else ()
    in_turns = (IN_TURNS, *((TURNING,) if on_the_arm else ())) if turns.any() and rests.any() else ()
    return (*on_the_arm, *in_turns, *_bases(table)[1:])


def _thermometer(c: Channel, table: DwellTable, place: float) -> Array:
    """What the declared curves make of a temperature that is `place` seconds ahead of the reading."""
    ahead = c.model.conditions.temperature_degc + table.temperature_rate * place
    model = replace(c.model, conditions=replace(c.model.conditions, temperature_degc=ahead))
    return np.asarray((evaluate(model, c.theta).predicted - c.predicted)[:, None])


def _lags(table: DwellTable) -> Sequence[float]:
    return (
        [s * t for t in LAGS_S for s in (-1.0, 1.0)] if np.any(np.abs(table.temperature_rate) > 1e-3) else ()
    )


REFERENCES: Mapping[str, Reference] = {
    r.name: r
    for r in (
        Reference(
            "base_tilt",
            ("accelerometer",),
            "deg",
            tilt_in_turns.AT_REST,
            _base_tilt,
            "level the table's base, or measure its tilt with a level and enter it in the reference",
            or_else=tilt_in_turns.IN_TURNS,
            stated=lambda accuracy: accuracy.level,
            places=_bases,
            bounds=_hardly_seen,
        ),
        Reference(
            "local_gravity",
            ("accelerometer",),
            "1",
            ("scale",),
            _local_gravity,
            "compare the local g of the reference with the site's surveyed value",
            alias="scale_factor",
            unlike=ONE_SCALE,
            largest={"accelerometer": MOST_SCALE},
            record="a centrifuge record, whose load does not rest on the local gravity",
        ),
        Reference(
            "local_gravity_by_bench",
            ("accelerometer",),
            "1",
            ("scale",),
            _gravity_on_bench,
            "compare the local g of the reference with the surveyed values of both sites",
            places=named_benches,
            said="local_gravity",
            unlike=ONE_SCALE,
            largest={"accelerometer": MOST_SCALE},
        ),
        Reference(
            "table_rate",
            ("gyro",),
            "1",
            ("scale",),
            off_by_a_share,
            "time whole turns of the table against a clock at the rates in question, either way",
            stated=lambda accuracy: accuracy.rate,
            places=set_ways,
            alias="scale_factor",
            alias_at=of_every_gyro,
            unlike=ONE_SCALE,
            largest={"gyro": MOST_SCALE},
            record="whole turns timed against a clock",
        ),
        Reference(
            "table_rate_by_bench",
            ("gyro",),
            "1",
            ("scale",),
            _rate_on_bench,
            "time whole turns of both tables against one clock, either way",
            stated=lambda accuracy: accuracy.rate,
            places=named_benches,
            said="table_rate",
            unlike=ONE_SCALE,
            largest={"gyro": MOST_SCALE},
        ),
        Reference(
            "table_rate_by_level",
            ("gyro",),
            "1",
            (),
            off_at_each_level,
            "time whole turns of the table against a clock at every rate that was set, either way",
            stated=lambda accuracy: accuracy.rate,
            places=set_rates,
            said="table_rate",
            unlike=ONE_SCALE,
            largest={"gyro": MOST_SCALE},
        ),
        Reference(
            "arm_rate_by_level",
            ("gyro", "accelerometer"),
            "1",
            (),
            off_at_each_load,
            "compare the centrifuge's rate with a counter of whole turns at every level that was set",
            stated=lambda accuracy: accuracy.rate,
            places=set_loads,
            narrow=True,
            said="table_rate",
            largest={"gyro": MOST_SCALE, "accelerometer": MOST_SCALE},
        ),
        Reference(
            "earth_rate_of_turns",
            ("gyro",),
            "deg/h",
            EARTH_IN_TURNS,
            left_out_of_turns,
            "enter the Earth's rate into ref_rate of the turns too, as it is in that of the rests",
            places=known_at_rest,
            bounds=as_at_rest,
            said="earth_rate",
        ),
        Reference(
            "azimuth",
            ("gyro",),
            "1",
            ("north", "east"),
            _azimuth,
            "determine the fixture's north again, by a theodolite or a north-seeking unit",
            places=_bases,
        ),
        Reference(
            "earth_rate_of_tumbles",
            ("gyro",),
            "deg/h",
            TERMS,
            forgotten_rate,
            "enter the Earth's rate into ref_rate of the records at rest, along up and along north",
            places=without_north,
            said="earth_rate",
            largest={"gyro": 2.0 * EARTH_RATE_RADPS},
        ),
        Reference(
            "mounting",
            ("gyro", "accelerometer"),
            "deg",
            ("x", "y", "z"),
            _mounting,
            "mount the unit on that bench again, against its datum faces, and repeat one record",
            stated=lambda accuracy: float(np.sqrt(2.0)) * accuracy.mounting,  # of two installations
            places=_mountings,
            alias="misalignment",
            record="the same record after mounting the unit anew",
        ),
        Reference(
            "mounting_by_temperature",
            ("gyro", "accelerometer"),
            "deg",
            ("x", "y", "z"),
            bends_with_temperature,
            "it turns the unit by so much in 50 K: measure the fixture's angles in the cold and in the heat",
            places=at_several_temperatures,
            unlike=ONE_SCALE,
            alias="misalignment_temperature",
            record="the same record on another fixture, or with a mirror on the unit's own case",
            said="mounting",
        ),
        Reference(
            "mounting_by_load",
            ("gyro", "accelerometer"),
            "deg",
            ("x", "y", "z"),
            gives_way_to_load,
            "it turns the unit by so much under 10 g: measure how far the fixture or its mounts give way",
            unlike=ONE_SCALE,
            record="the same load with the fixture clamped stiffer, or a mirror on the unit's own case",
            said="mounting",
        ),
        Reference(
            "mounting_of_faces",
            ("accelerometer",),
            "deg",
            (),
            leaning_faces,
            "measure the angles of the fixture's faces, or of its stops, and enter them in the reference",
            stated=lambda accuracy: accuracy.mounting,
            places=resting_on_faces,
            said="mounting",
            by_channel=True,
        ),
        Reference(
            "lever_arm_on_the_table",
            ("accelerometer",),
            "m",
            ("x", "y", "z"),
            off_the_axis,
            "measure how far the accelerometers are from the table's axis and enter it in the reference",
            places=beside_an_arm,
            said="lever_arm",
        ),
        Reference(
            "thermometer_lag",
            ("gyro", "accelerometer"),
            "s",
            ("lag",),
            _thermometer,
            "compare the thermometer with one at the sensors' own place during a ramp",
            places=_lags,
            misfit=0.35,  # the declared curves were fitted to the readings that lag
        ),
    )
}
"""Hypotheses that are columns, by name; those about labels and units of rows are `records`' own."""
