"""The nouns of measured data: one averaged record of one unit at one condition is one row of a dwell table.

SI and radians inside, temperatures in degrees Celsius; the file's units are those of its column names
(interfaces, section 4). Arrays that the data do not have are None, never filled with guesses.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, in_records


@dataclass(frozen=True)
class DwellTable:
    """n averaged records.

    unit, step, bench: (n,) text; run: (n,) number of the power-on; day: (n,) days since the first calibration
    time_on: (n,) s since power-on, middle of the record; duration: (n,) s
    temperature_degc: (n,); temperature_rate: (n,) K/s
    ref_rate: (n, 3) true inertial rate in body axes, rad/s, the Earth's included
    ref_acc: (n, 3) true specific force in body axes, m/s^2
    gyro: (n, 3) rad/s; acc: (n, 3) m/s^2; gyro_std, acc_std: within the record; n_samples: (n,)
    kind: (n,) `rest` or `motion`, a piece of a hand turn between rests whose gyro is its mean rate;
        None where every row is a record of its own
    source: the file; notes: what was found odd while reading or reducing, each a sentence
    absent: names of the columns that the file did not have; those that are never None here stand at a neutral
        value (run 1, day 0, time_on 0, 20 degC, rate 0), and effects that need them cannot be tested
    """

    unit: NDArray[np.str_]
    run: NDArray[np.int64]
    day: Array
    time_on: Array
    duration: Array
    temperature_degc: Array
    temperature_rate: Array
    ref_rate: Array | None
    ref_acc: Array | None
    gyro: Array | None
    acc: Array | None
    step: NDArray[np.str_] | None = None
    bench: NDArray[np.str_] | None = None
    gyro_std: Array | None = None
    acc_std: Array | None = None
    n_samples: NDArray[np.int64] | None = None
    kind: NDArray[np.str_] | None = None
    source: str = ""
    notes: tuple[str, ...] = ()
    absent: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.run)

    def conditions(self) -> Conditions:
        """The conditions of every row for the effects; references that are missing count as zero."""
        return self._conditions

    @cached_property
    def _conditions(self) -> Conditions:
        """The same object every time: what was asked of it is kept with it (`asked_once`)."""
        zero = np.zeros((len(self), 3))
        means = Conditions(
            rate=zero if self.ref_rate is None else self.ref_rate,
            specific_force=zero if self.ref_acc is None else self.ref_acc,
            temperature_degc=self.temperature_degc,
            temperature_rate=self.temperature_rate,
            time_on=self.time_on,
            day=self.day,
        )
        return in_records(means, self.duration)
