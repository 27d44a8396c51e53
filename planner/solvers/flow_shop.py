"""In which order jobs go through machines that all of them pass in one and the same order.

A permutation flow shop: completion C(i, m) = max(C(i−1, m), C(i, m−1)) + times(i, m) for the i-th job of the
sequence on machine m. The makespan is C of the last job on the last machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Every set of jobs is looked at: 2¹⁴ sets with a few dozen fronts each are some seconds.
MOST_JOBS = 14


@dataclass(frozen=True)
class Sequencing:
    """A sequence of jobs and when its last one is done."""

    sequence: tuple[int, ...]
    makespan: float


def completion_times(times: Array, sequence: Sequence[int]) -> Array:
    """(jobs, machines) when the jobs, in the order of the sequence, leave each machine; times by number."""
    done = np.zeros((len(sequence), times.shape[1]))
    free = np.zeros(times.shape[1])
    for i, job in enumerate(sequence):
        now = 0.0
        for m, seconds in enumerate(times[job]):
            now = free[m] = max(now, free[m]) + seconds
        done[i] = free
    return done


def shortest_sequence(times: Array) -> Sequencing:
    """The permutation of least makespan, exactly, for times (jobs, machines) >= 0.

    Equal jobs need no search and one or two machines follow Johnson's rule, for any number of jobs; else
    dynamic programming over sets of jobs. Raises ValueError for more than MOST_JOBS different jobs on more
    than two machines.
    """
    jobs, machines = times.shape
    if jobs == 0 or machines == 0:
        sequence: tuple[int, ...] = tuple(range(jobs))
    elif bool(np.all(times == times[0])):
        sequence = tuple(range(jobs))
    elif machines <= 2:
        sequence = johnson(times[:, 0], times[:, -1])
    else:
        sequence = _over_sets(times)
    done = completion_times(times, sequence)
    return Sequencing(sequence, float(done[-1, -1]) if done.size else 0.0)


def johnson(first: Array, second: Array) -> tuple[int, ...]:
    """Johnson's rule (Naval Res. Logist. Q. 1, 1954): optimal for two machines.

    First the jobs that are shorter on the first machine, by rising time there; then the others by falling
    time on the second.
    """
    early = sorted((a, j) for j, (a, b) in enumerate(zip(first, second, strict=True)) if a < b)
    late = sorted((-b, j) for j, (a, b) in enumerate(zip(first, second, strict=True)) if a >= b)
    return tuple(j for _, j in chain(early, late))


@dataclass(frozen=True)
class _Front:
    """Sequences of one set of jobs of which none leaves every machine earlier: free (s, machines)."""

    free: Array
    sequences: tuple[tuple[int, ...], ...]


def _over_sets(times: Array) -> tuple[int, ...]:
    """What comes after a set of jobs depends on its sequence only through when each machine is free."""
    jobs = len(times)
    if jobs > MOST_JOBS:
        raise ValueError(f"{jobs} different jobs on {times.shape[1]} machines; exact up to {MOST_JOBS}")
    fronts = {0: _Front(np.zeros((1, times.shape[1])), ((),))}
    for _ in range(jobs):
        grown: dict[int, list[_Front]] = {}
        for done, front in fronts.items():
            for job in range(jobs):
                if not done >> job & 1:
                    grown.setdefault(done | 1 << job, []).append(_with_job(front, job, times[job]))
        fronts = {done: _nondominated(several) for done, several in grown.items()}
    (last,) = fronts.values()
    return last.sequences[int(np.argmin(last.free[:, -1]))]


def _with_job(front: _Front, job: int, seconds: Array) -> _Front:
    free, now = front.free.copy(), np.zeros(len(front.free))
    for m, duration in enumerate(seconds):
        now = free[:, m] = np.maximum(now, free[:, m]) + duration
    return _Front(free, tuple((*sequence, job) for sequence in front.sequences))


def _nondominated(fronts: Sequence[_Front]) -> _Front:
    free = np.concatenate([front.free for front in fronts])
    sequences = [sequence for front in fronts for sequence in front.sequences]
    free, first = np.unique(
        free, axis=0, return_index=True
    )  # sorted: a row is dominated by earlier ones only
    kept: list[int] = []
    for i, row in enumerate(free):
        if not kept or not np.any(np.all(free[kept] <= row, axis=1)):
            kept.append(i)
    return _Front(free[kept], tuple(sequences[int(first[i])] for i in kept))
