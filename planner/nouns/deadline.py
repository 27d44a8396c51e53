"""By when a plan must have its answer, and what was cut short for it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from time import monotonic

# Shares of the time after which a stage gives way to those that come after it.
SEARCH, BOUND, GENETIC, BESIDE = 0.45, 0.65, 0.75, 0.9


@dataclass(frozen=True)
class Deadline:
    """seconds: from the beginning of the plan; cut: the stages that were cut short, in words.

    stop: whether somebody wants the best so far now; say: told how short the best is, and the bound
    """

    seconds: float = math.inf
    began: float = field(default_factory=monotonic)
    cut: list[str] = field(default_factory=list)
    stop: Callable[[], bool] = lambda: False
    say: Callable[[str], None] | None = None

    def at(self, share: float) -> float:
        """The moment (of the monotonic clock) at which so much of the time is over."""
        return -math.inf if self.stop() else self.began + share * self.seconds

    def over(self, share: float, stage: str) -> bool:
        """Whether a stage must stop; then it is noted as cut short."""
        late = monotonic() > self.at(share)
        if late:
            self.note(stage)
        return late

    def note(self, stage: str) -> None:
        """A stage was cut short."""
        if stage not in self.cut:
            self.cut.append(stage)

    def stops(self, share: float, stage: str) -> Callable[[], bool]:
        """`over` for a stage that asks again and again."""
        return lambda: self.over(share, stage)

    def report(self, best: float, bound: Callable[[], float] | None = None) -> None:
        """How long the shortest campaign so far is, and how much shorter one could be; costs in seconds."""
        if self.say is None:
            return
        words = f"the shortest so far: {best / 3600:.2f} h"
        if bound is not None and best > 0:
            least = min(bound(), best)
            words += f", none below {least / 3600:.2f} h, gap {100 * (best - least) / best:.1f} %"
        self.say(words)

    def report_bounded(self, best: float, bound: float) -> None:
        """As `report`, with the bound at hand."""
        self.report(best, lambda: bound)

    @property
    def left(self) -> float:
        """Seconds that are left, never less than a tenth."""
        return 0.1 if self.stop() else max(self.began + self.seconds - monotonic(), 0.1)


def never() -> bool:
    """For who has all the time."""
    return False
