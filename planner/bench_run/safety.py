"""Leaving a bench safe: table ordered off and seen at zero rate, chamber set to room and seen to be.

Trying goes on until it is seen, or until somebody says to give up; what was not seen is never said to be.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from planner.bench_run.chamber_driver import ChamberDriver
from planner.bench_run.clock import Clock
from planner.bench_run.equipment import Say
from planner.bench_run.errors import ClockGone
from planner.bench_run.table import TableDriver
from planner.errors import PlannerError

ATTENTION = "ATTENTION"  # begins what somebody must look at: the bench may not be safe
AGAIN_S, REMIND_S = 5.0, 60.0  # how often it is tried again, and said again
SEEN_S = 10.0  # beyond the time to brake: how long rest is looked for before the order is given again


@dataclass(frozen=True)
class Left:
    """How a bench was left: what is known of table and chamber, in words.

    safe: whether all was seen; hopeless: whether looking again would tell nothing new
    """

    words: tuple[str, ...] = ()
    safe: bool = True
    hopeless: bool = False

    def __str__(self) -> str:
        return ", ".join(self.words) or "no bench was open"

    def __add__(self, other: Left) -> Left:
        safe = self.safe and other.safe
        hopeless = all(one.safe or one.hopeless for one in (self, other)) and not safe
        return Left((*self.words, *other.words), safe, hopeless)


def make_safe(
    table: TableDriver | None,
    chamber: ChamberDriver | None,
    clock: Clock,
    say: Say,
    give_up: Callable[[float], bool],
) -> Left:
    """Order both, look at both, the table first; again while something is not seen.

    give_up: (seconds tried) -> whether to stop trying
    """
    start, said_s = clock.now(), None
    while True:
        left = _table_left(table, clock) + _chamber_left(chamber)
        tried = clock.now() - start
        if not left.safe and (said_s is None or tried - said_s >= REMIND_S):
            said_s = tried
            say(f"{ATTENTION}: {left}")
        if left.safe or left.hopeless or give_up(tried):
            break
        try:
            clock.sleep(AGAIN_S)
        except ClockGone:
            break
    if left.safe and said_s is not None:
        say(f"now seen: {left}")
    return left


def _table_left(table: TableDriver | None, clock: Clock) -> Left:
    if table is None:
        return Left()
    try:
        table.order_off()
        restless = restless_in_time(table, clock)
        suspicion = table.suspicion()
    except (PlannerError, OSError) as error:
        return Left((f"table ordered off, NOT seen at zero rate: {error}",), safe=False)
    if restless:
        return Left((f"table ordered off, NOT seen at zero rate: {', '.join(restless)}",), safe=False)
    if suspicion:
        words = f"table reads zero rate, but look at it: {suspicion}"
        return Left((words,), safe=False, hopeless=True)
    return Left((f"table seen at zero rate ({angle_words(table.angles)})",))


def angle_words(angles: Mapping[int, float]) -> str:
    """`axis 1 at 90 deg, axis 2 at 0 deg`."""
    return ", ".join(f"axis {axis} at {round(angle, 3) + 0.0:g} deg" for axis, angle in angles.items())


def restless_in_time(table: TableDriver, clock: Clock) -> list[str]:
    """Axes that still turn when the time to brake has passed."""
    end = clock.now() + table.braking_s() + SEEN_S
    while (restless := table.restless()) and clock.now() < end:
        clock.sleep(1.0)
    return restless


def _chamber_left(chamber: ChamberDriver | None) -> Left:
    if chamber is None:
        return Left()
    try:
        chamber.order_room()
        wrong = chamber.not_at_room()
    except (PlannerError, OSError) as error:
        return Left((f"chamber ordered to room, NOT seen: {error}",), safe=False)
    if wrong:
        return Left((f"chamber ordered to room, NOT seen: {', '.join(wrong)}",), safe=False)
    return Left((f"chamber to room ({chamber.seen()})",))
