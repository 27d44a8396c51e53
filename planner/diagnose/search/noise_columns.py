"""Columns under which a channel's noise and its far rows are judged, before anything is believed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner import catalog
from planner.diagnose.channels.parameters import GRID
from planner.diagnose.hypotheses.candidates import Block, follows_any_drift
from planner.diagnose.noise.channel_noise import LEAST_RUNS
from planner.nouns.array import Array

MOST_SHARE = 0.4  # columns a row when the noise is judged
FEW_RUNS = 24  # power-ons, below which all that tells them apart leaves nothing to tell their spread by
BETWEEN_NODES = ("temperature",)  # finer tables than the declared one come after what is told at its nodes
FINE_ONES = ("time_on", "day", *BETWEEN_NODES)  # come coarse first, then fine
A_COLUMN = 8  # power-ons for each column between them when the noise is judged


def coarse(blocks: Sequence[Block], axis: int) -> list[Array]:
    """Columns that a row may follow and be no outlier: fine bins would follow a single row, and so do tables.

    What a table follows in several power-ons is no accident by `outliers` itself.
    """
    names: set[str] = set()
    kept = []
    for b in blocks:
        fine = b.narrow or (b.generic and b.name in names and b.name in FINE_ONES)
        if axis in b.columns and not fine and not _is_table(b):
            kept.append(b.columns[axis])
        if b.generic and axis in b.columns:
            names.add(b.name)
    return kept


def of_the_full_model(
    blocks: Sequence[Block], axis: int, rows: int, runs: int
) -> tuple[list[Array], list[Block]]:
    """Columns under which the noise is judged: every candidate, but few of those that tell power-ons apart.

    And the blocks that stay out: all, where those with an equation alone are too many for the rows, or
    power-ons are few. 112 rows under 80 columns knew their noise by three degrees of freedom, 12 power-ons
    under all that tells them apart their spread by two, beside which nothing is significant.

    Thirty power-ons under sixteen steps and as many days would leave nothing to tell run-to-run by, and where
    all columns together are too many for the rows those without a name stay out; then tables of many values
    too, under which 216 rows knew their noise by three degrees of freedom.
    """
    whole = mine = _thinned([b for b in blocks if axis in b.columns])
    finer = {id(b) for i, b in enumerate(whole) if b.name in BETWEEN_NODES and b.name in _names(whole[:i])}
    mine = [b for b in mine if not b.narrow]
    for goes in (lambda b: id(b) in finer, _is_generic, _is_table):
        if sum(b.columns[axis].shape[1] for b in mine) > rows * MOST_SHARE:
            mine = [b for b in mine if not goes(b)]
    named = sum(b.columns[axis].shape[1] for b in mine)
    if runs >= LEAST_RUNS and (runs < FEW_RUNS or named > rows * MOST_SHARE):
        return [], _coarse_of(whole)
    steps = [b for b in mine if _steps_between_runs(b)]
    most = max(1, runs // A_COLUMN)
    thin = steps[:: -(-len(steps) // most)] if steps else []
    single = [b for b in mine if not _steps_between_runs(b)]
    kept = [b for b in single if not (b.name == "day" and b.columns[axis].shape[1] > most)]
    out = [b for b in whole if not any(b is m for m in mine)]
    return [b.columns[axis] for b in (*kept, *thin)], _coarse_of(out)


def _coarse_of(blocks: Sequence[Block]) -> list[Block]:
    """The blocks without fine ones: beside few rows 25 columns cost more than what the 9 do not see."""
    return [
        b
        for i, b in enumerate(blocks)
        if b.narrow or b.name not in FINE_ONES or b.name not in _names(blocks[:i])
    ]


def _names(blocks: Sequence[Block]) -> set[str]:
    return {b.name for b in blocks if b.generic and not b.narrow}


def _is_generic(block: Block) -> bool:
    return block.generic


def _is_table(block: Block) -> bool:
    """Whether a block is a table of many values over what changes within a power-on."""
    return not block.generic and not block.reference and follows_any_drift(catalog.effects()[block.name])


def _steps_between_runs(block: Block) -> bool:
    """Whether a block is a step from one day to another: with others of its kind it tells every power-on."""
    effect = catalog.effects().get(block.name)
    return bool(
        not block.generic
        and effect is not None
        and "day" in effect.needs
        and any(p.stepped for p in effect.parameters)
    )


def _thinned(blocks: Sequence[Block]) -> list[Block]:
    """The blocks with no more than GRID points of an effect of several parameters: they span the others."""
    several: dict[str, list[Block]] = {}
    for b in blocks:
        if len(b.nonlinear) > 1 or b.reference:
            several.setdefault(b.name, []).append(b)
    gone = {id(b) for of_one in several.values() for b in _between(of_one)}
    return [b for b in blocks if id(b) not in gone]


def _between(blocks: Sequence[Block]) -> list[Block]:
    kept = set(np.linspace(0, len(blocks) - 1, min(len(blocks), GRID)).round().astype(int).tolist())
    return [b for i, b in enumerate(blocks) if i not in kept]
