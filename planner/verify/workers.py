"""Who runs the chunks: this process, local workers (joblib), or a dask.distributed cluster.

Whoever it is, a chunk's outcome is the same; here they only come back in some order. A worker that is killed
in the middle costs the time of its chunks and nothing else: they are worked again.
"""

from __future__ import annotations

import os
import pickle
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import cache
from typing import Any

from planner.errors import InputError, StoppedEarly

LIVES = 5  # so often may workers die
WATCHED_S = 0.5  # between looks at the parent

Chunked = Callable[[Any, int, int], Any]
"""A function of what all chunks share, a chunk's number and its size -> the chunk's outcome."""
Run = Callable[[Chunked, Any, Sequence[tuple[int, int]]], Iterator[Any]]


def runner(workers: int, cluster: str | None) -> Run:
    """How to run chunks: `cluster` is the address of a scheduler, else `workers` local processes."""
    if cluster is not None:
        return lambda function, shared, chunks: on_cluster(cluster, function, shared, chunks)
    if workers == 1:
        return here
    return lambda function, shared, chunks: locally(workers, function, shared, chunks)


def here(function: Chunked, shared: Any, chunks: Sequence[tuple[int, int]]) -> Iterator[Any]:
    """One after the other in this process."""
    for number, size in chunks:
        yield function(shared, number, size)


@dataclass(frozen=True)
class _Numbered:
    """The function's outcome with the chunk's number, which tells what is left when a worker has died.

    parent: the process that asked; when it is gone, the worker ends
    """

    function: Chunked
    parent: int

    def __call__(self, shared: Any, number: int, size: int) -> tuple[int, Any]:
        _end_with(self.parent)
        return number, self.function(shared, number, size)


@cache
def _end_with(parent: int) -> None:
    """End this process when its parent is gone: a killed `sweep` left workers that planned for minutes."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WATCHED_S)
        os._exit(1)

    if os.getppid() == parent:  # joblib may also run a chunk in the process that asked
        threading.Thread(target=watch, daemon=True).start()


def locally(workers: int, function: Chunked, shared: Any, chunks: Sequence[tuple[int, int]]) -> Iterator[Any]:
    """On processes of this machine; -1 takes all its cores. Every chunk comes back once.

    Raises StoppedEarly when workers die again and again.
    """
    left = dict(chunks)
    for _ in range(LIVES):
        try:
            for number, outcome in _pool(
                workers, _Numbered(function, os.getpid()), shared, list(left.items())
            ):
                del left[number]
                yield outcome
            return
        except BrokenProcessPool:  # all that were at work are gone with the one that was killed
            continue
    raise _died(f"workers died {LIVES} times")


def _pool(workers: int, function: Chunked, shared: Any, chunks: Sequence[tuple[int, int]]) -> Iterator[Any]:
    from joblib import Parallel, delayed

    parallel = Parallel(
        n_jobs=workers, return_as="generator_unordered", batch_size=1, pre_dispatch="2*n_jobs"
    )
    yield from parallel(delayed(function)(shared, number, size) for number, size in chunks)


def _died(what: str) -> StoppedEarly:
    return StoppedEarly(f"{what}, of too little memory? Give fewer --workers")


def on_cluster(
    address: str, function: Chunked, shared: Any, chunks: Sequence[tuple[int, int]], timeout: float = 10.0
) -> Iterator[Any]:
    """On a dask.distributed scheduler. What is shared is a task of its own, so that a lost worker's copy is
    made again. Raises InputError when the package is not there or nobody answers."""
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        raise InputError("--cluster needs dask.distributed: pip install 'planner[cluster]'") from error
    try:
        client = Client(address, timeout=timeout)  # type: ignore[no-untyped-call]  # distributed has no types
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"no scheduler answers at {address}: {error}") from error
    with client:
        common = client.submit(pickle.loads, pickle.dumps(shared), pure=False)
        futures = [
            client.submit(function, common, number, size, pure=False, retries=3) for number, size in chunks
        ]
        for future in as_completed(futures):  # type: ignore[no-untyped-call]  # distributed has no types
            yield future.result()
            future.release()
