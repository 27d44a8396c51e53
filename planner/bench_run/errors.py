"""What stops a run: the bench, or somebody."""

from __future__ import annotations

from planner.errors import StoppedEarly


class BenchFault(StoppedEarly):
    """The bench did not do what it was told (exit 4); what was finished is in the journal."""


class LineLost(BenchFault):
    """The connection to a device is down; it may come back."""


class Silent(BenchFault):
    """A device that is connected says nothing; after its mains were cut it may still be starting."""


class ClockGone(BenchFault):
    """The simulator whose time a run goes by has gone: no wait will ever end."""


class Interrupted(StoppedEarly):
    """Somebody stopped the run (exit 4); what was finished is in the journal."""
