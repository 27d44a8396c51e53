"""A table's orders and questions in its dialect, as text; nothing here waits or listens."""

from __future__ import annotations

from collections.abc import Sequence

from planner.control.dialect import Question, TableDialect, filled
from planner.control.orders import AxisOrder
from planner.control.words import figure
from planner.nouns.bench import BenchFacts


class TableWords:
    """What is said to one table of so many axes."""

    def __init__(self, dialect: TableDialect, axes: int) -> None:
        self._dialect, self._orders = dialect, dialect.orders
        self._axes = range(1, axes + 1)

    def prepare(self) -> list[str]:
        """Interlocks and what else comes first."""
        return self._each(self._orders.prepare)

    def limits(self, bench: BenchFacts, fastest_dps: float) -> list[str]:
        """The bench's limits for both modes of every axis.

        fastest_dps: the fastest rate of the campaign, the limit when turning where the bench has none
        """
        words, acceleration = self._orders.limits, bench.angular_acceleration_dps2
        given = (
            (
                "rate",
                (words.position_rate, bench.rate_dps),
                (words.turning_rate, bench.rate_dps or fastest_dps),
            ),
            (
                "acceleration",
                (words.position_acceleration, acceleration),
                (words.turning_acceleration, acceleration),
            ),
        )
        return [
            filled(template, axis=axis, value=self._figure(what, value))
            for what, *modes in given
            for axis in self._axes
            for template, value in modes
            if template and value
        ]

    def stop_all(self) -> list[str]:
        """Every axis to zero rate."""
        return list(self._orders.stop_all) or self._each(self._orders.stop)

    def motion(self, orders: Sequence[AxisOrder], stops: Sequence[int] = ()) -> list[str]:
        """Axes that turn without an order are stopped, the others get their mode and demand."""
        found = [filled(word, axis=axis) for axis in stops for word in self._orders.stop]
        for order in orders:
            value = self._figure(order.mode, order.value)
            told = self._orders.rate if order.mode == "rate" else self._orders.position
            found += [filled(word, axis=order.axis, value=value) for word in told]
        return found

    def question(self, question: Question, axis: int) -> str:
        """A question about one axis."""
        return filled(question.ask, axis=axis)

    def _each(self, words: Sequence[str]) -> list[str]:
        """Words with an axis in them for every axis, the others once."""
        return [
            filled(word, axis=axis)
            for word in words
            for axis in (self._axes if "{axis}" in word else range(1, 2))
        ]

    def _figure(self, what: str, value: float) -> str:
        sent = self._dialect.units.sent(what, value)  # type: ignore[arg-type]  # one of its three words
        return figure(sent, self._dialect.decimals)
