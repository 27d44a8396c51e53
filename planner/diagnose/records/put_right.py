"""A unit's table, searched: without power-ons that are off, and with references put right that were wrong.

What is wrong with a bench, and what a search makes of that, are told apart by one more search, of the table
as it would be without the fault.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.prepared import Prepared, prepared
from planner.diagnose.findings.fixture_of_both import denied_by_the_other
from planner.diagnose.findings.lagging_thermometer import NAME as LAGS
from planner.diagnose.findings.lagging_thermometer import (
    ahead,
    lag_of,
    lags_more,
    on_several_ramps,
    suspect_of,
    suspects_it,
    with_lag,
)
from planner.diagnose.findings.suspects import suspects
from planner.diagnose.records.not_soaked import NotSoaked, not_soaked
from planner.diagnose.records.off_power_on import off_power_on
from planner.diagnose.records.other_from_run_on import other_from_run_on
from planner.diagnose.records.run_of_another_temperature import of_another_temperature
from planner.diagnose.records.scale_of_power_ons import gravity_of_power_ons, table_rate_of_power_ons
from planner.diagnose.records.stepped_run import stepped_run
from planner.diagnose.records.thermometer_of_power_ons import (
    sized_again,
    thermometer_of_power_ons,
)
from planner.diagnose.search.sensor import SensorFound, diagnose_sensor
from planner.dwells.table_rows import rows_of
from planner.nouns.diagnosis import ReferenceSuspect, Refused, RowLeftOut
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import channel_name
from planner.protocols import SENSORS
from planner.spec.model import Spec
from planner.spec.references import BenchAccuracy

OF_ONE_CHANNEL = "curves over temperature that lag alike say no more than one of them by itself"


@dataclass(frozen=True)
class Judged:
    """What is found of a table, with the references that were put right in it; barred: not asked again."""

    table: DwellTable
    data: Prepared
    found: list[SensorFound]
    suspects: tuple[ReferenceSuspect, ...] = ()
    barred: tuple[Refused, ...] = ()


@dataclass(frozen=True)
class Search:
    """How every table of a unit is searched; seed: of the sign flips."""

    spec: Spec
    seed: int
    progress: Callable[[str], None]

    @property
    def benches(self) -> list[BenchAccuracy]:
        """How well the spec says that references are known."""
        return [b.accuracy for b in self.spec.benches.values()]

    def judged(
        self,
        table: DwellTable,
        suspects: tuple[ReferenceSuspect, ...] = (),
        barred: tuple[Refused, ...] = (),
    ) -> Judged:
        """A table in which these suspects are put right, searched."""
        data = prepared(table, self.spec.unit)
        found = self.of(data, barred)
        denied = denied_by_the_other(found)
        if denied:
            barred = (*barred, *denied)
            own = {c for r in denied for c in r.channels}
            found = self.of(data, barred, [s for s in found if own.isdisjoint(channels_searched(s))])
        return Judged(table, data, found, suspects, barred)

    def of(
        self, data: Prepared, refused: Sequence[Refused] = (), stays: Sequence[SensorFound] = ()
    ) -> list[SensorFound]:
        """Every sensor that can be judged, searched.

        refused: what is not asked again on its channels; stays: what was found where nothing new is refused
        """
        found = []
        known = {s.sensor: s for s in stays}
        for sensor in SENSORS:
            if sensor in known:
                found.append(known[sensor])
            elif sensor in data.sensors:
                self.progress(f"{data.table.unit[0]}: searching the {sensor}s")
                mine = {channel_name(sensor, a): a for a in range(3)}
                fallen = {(r.effect, mine[c]) for r in refused for c in r.channels if c in mine}
                effects = tuple(self.spec.effects)
                found.append(diagnose_sensor(data, sensor, effects, self.seed, self.benches, fallen))
        return found


@dataclass(frozen=True)
class Stays:
    """Rows of a table that are judged, and what is found of them. kept: (n,); off: rows of what is off

    suspects: a power-on that was at another temperature; mended: the same rows with a reference of one put
    right, or the thermometer of some, where that was looked at and is what is wrong
    """

    kept: NDArray[np.bool_]
    judged: Judged
    off: tuple[RowLeftOut, ...] = ()
    suspects: tuple[ReferenceSuspect, ...] = ()
    mended: Judged | None = None


def put_right(stays: Stays, search: Search) -> Judged:
    """What is found of the rows that stay with the thermometer put right, or another reference."""
    judged = stays.judged
    if not judged.suspects:
        judged = _with_temperatures_put_right(judged, search)
    if judged.suspects:  # what a lag leaves of its ramps goes with their power-ons
        return judged
    if stays.mended is not None and judged is stays.judged:
        return stays.mended
    return _with_reference_put_right(judged, search)


def _with_reference_put_right(judged: Judged, search: Search) -> Judged:
    """A reference that became another one; the table with that one, and what is found of it."""
    seen = judged.found, judged.data, search.benches
    anew = other_from_run_on(*seen) or table_rate_of_power_ons(*seen) or gravity_of_power_ons(*seen)
    if anew is None:
        return judged
    return search.judged(anew.right(judged.table), (anew.suspect,), judged.barred)


def _with_temperatures_put_right(judged: Judged, search: Search) -> Judged:
    """The thermometer, where it lags, and what is found of the temperatures that the unit had.

    A lag that a search suspected, and that one channel alone has on several ramps, is barred.
    """
    found, data = judged.found, judged.data
    lag, asked, several = lag_of(found, data), suspects_it(found), on_several_ramps(data)
    if several and not (lag is not None and lag.of_several):
        if not asked:
            return judged
        alone = tuple(Refused(LAGS, channels_searched(s), OF_ONE_CHANNEL) for s in found)
        return replace(judged, found=search.of(data, alone), barred=alone)
    if lag is None:
        return judged
    said = [with_lag(s, lag) for s in suspects(found) if s.hypothesis == LAGS] if asked else [suspect_of(lag)]
    return search.judged(ahead(judged.table, lag.value), tuple(said))


def channels_searched(s: SensorFound) -> tuple[str, ...]:
    """The names of the channels that were searched."""
    return tuple(c.name for c in s.channels)


def without_off(table: DwellTable, kept: NDArray[np.bool_], search: Search) -> Stays:
    """The rows but those of a power-on that is off or stepped, of those kept (n,), and what is found of them.

    A power-on that was at another temperature is a suspect too.
    """
    judged = search.judged(rows_of(table, kept))
    found, data = judged.found, judged.data
    soaks = not_soaked(found, data)
    if soaks is not None:
        return _of_the_chamber(soaks, table, kept, search)
    other = of_another_temperature(found, data)
    if other is not None and lags_more(found, data, other.strength):
        return Stays(kept, judged)
    mended = _of_the_thermometer(judged, search, 0.0 if other is None else other.strength)
    if mended is not None:
        return Stays(kept, judged, mended=mended)
    one = off_power_on(found, data) if other is None else None
    step = stepped_run(found, data) if one is None and other is None else None
    mended = _of_the_bench(judged, search) if one is not None or step is not None else None
    if mended is not None:
        return Stays(kept, judged, mended=mended)
    if other is not None:
        off = other.rows(data.full)
        kept = kept & (table.run != other.run)
    elif one is not None:
        off = one.rows(data.full)
        kept = kept & ~np.isin(table.run, one.runs)
    elif step is not None:
        off = step.left_out(data.table)
        kept = kept & ~step.of(table, data.table)
    else:
        return Stays(kept, judged)
    said = () if other is None else (other.suspect,)
    return Stays(kept, search.judged(rows_of(table, kept)), tuple(off), said)


def _of_the_chamber(soaks: NotSoaked, table: DwellTable, kept: NDArray[np.bool_], search: Search) -> Stays:
    """The rows at the temperatures of a unit that was not soaked, but those of what is off then."""
    table, said = soaks.right(table), (soaks.suspect,)
    judged = search.judged(rows_of(table, kept), said)
    one = off_power_on(judged.found, judged.data)
    if one is None:
        return Stays(kept, judged)
    off = tuple(one.rows(judged.data.full))
    kept = kept & ~np.isin(table.run, one.runs)
    return Stays(kept, search.judged(rows_of(table, kept), said), off)


def _of_the_bench(judged: Judged, search: Search) -> Judged | None:
    """The rows with a reference of some power-ons put right, where none is then off, or stepped, or None.

    Of a unit that was mounted anew, the one power-on of turns before it is as far off as any that is off.
    """
    bench = other_from_run_on(judged.found, judged.data, search.benches)
    if bench is None:
        return None
    mended = search.judged(bench.right(judged.table), (bench.suspect,))
    return mended if _nothing_is_off(mended) else None


def _of_the_thermometer(judged: Judged, search: Search, strength: float) -> Judged | None:
    """The rows at the temperatures that one thermometer would have read, where none is then off, or None.

    strength: of what else explains it. Asked once more where the first answer left some. Three power-ons that
    stood crooked were 5 K of a day's thermometer, and one of them was off with it and without.
    """
    first = thermometer_of_power_ons(judged.found, judged.data, search.benches)
    if first is None or first.strength <= strength:
        return None
    mended = search.judged(first.right(judged.table), (first.suspect,))
    again = sized_again(first, mended.found, mended.data)
    if abs(again.value - first.value) > again.half:
        mended = search.judged(again.right(judged.table))
    mended = replace(mended, suspects=(again.suspect,))
    return mended if _nothing_is_off(mended) else None


def _nothing_is_off(judged: Judged) -> bool:
    """Whether no power-on is off as a whole, or stepped."""
    found, data = judged.found, judged.data
    return off_power_on(found, data) is None and stepped_run(found, data) is None
