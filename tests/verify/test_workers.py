"""Who flies the chunks changes nothing: one process, several, a cluster, a cluster that loses a worker."""

from __future__ import annotations

import os
import pickle
import signal
import time
from dataclasses import fields

import numpy as np
import pytest

from planner.errors import InputError
from planner.verify.experiment import CHUNK, run_chunk
from planner.verify.monte_carlo import chunks_of, fly
from planner.verify.tally import total
from planner.verify.workers import here, on_cluster, runner
from tests.verify.test_monte_carlo import prepared_experiment

FLIGHTS = 350


@pytest.fixture(scope="module", name="alone")
def _alone():
    e = prepared_experiment("flown")
    return e, fly(e, FLIGHTS, here, lambda message: None)


def same(a, b):
    for field in fields(a.tally):
        np.testing.assert_array_equal(getattr(a.tally, field.name), getattr(b.tally, field.name), field.name)


@pytest.fixture(scope="module", name="scheduler")
def _scheduler():
    """A real scheduler with two worker processes."""
    distributed = pytest.importorskip("distributed", reason="the cluster extra is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        yield cluster


def test_chunks_hold_all_flights_whatever_their_number():
    assert [n for _, n in chunks_of(FLIGHTS)] == [CHUNK, CHUNK, CHUNK, 50]
    assert chunks_of(CHUNK) == [(0, CHUNK)]


def test_local_workers_find_the_same_to_the_last_bit(alone):
    e, wanted = alone
    same(fly(e, FLIGHTS, runner(2, None), lambda message: None), wanted)


def test_the_order_in_which_chunks_come_back_changes_nothing(alone):
    e, wanted = alone

    def backwards(function, shared, chunks):
        yield from here(function, shared, list(reversed(chunks)))

    same(fly(e, FLIGHTS, backwards, lambda message: None), wanted)


def test_a_cluster_finds_the_same_to_the_last_bit(alone, scheduler):
    e, wanted = alone
    same(fly(e, FLIGHTS, runner(1, scheduler.scheduler_address), lambda message: None), wanted)


def slow_chunk(shared, number, size):
    """A chunk that leaves time to kill its worker; says who did it."""
    time.sleep(0.3)
    return os.getpid(), run_chunk(shared, number, size)


def test_a_killed_worker_changes_nothing(alone, scheduler):
    """SIGKILL after the first chunk: its work, and its copy of what is shared, are made again elsewhere."""
    e, wanted = alone
    done, killed = [], None
    for pid, tally in on_cluster(scheduler.scheduler_address, slow_chunk, e, chunks_of(FLIGHTS)):
        if killed is None:
            os.kill(pid, signal.SIGKILL)
            killed = pid
        done.append(tally)
    assert killed is not None
    assert killed != os.getpid()
    found = total(done)
    np.testing.assert_array_equal(found.lengths, wanted.tally.lengths)
    np.testing.assert_array_equal(found.squares, wanted.tally.squares)


def test_nobody_at_the_address_is_said_plainly():
    with pytest.raises(InputError, match="no scheduler answers at tcp://127"):
        next(on_cluster("tcp://127.0.0.1:9", run_chunk, None, [(0, 1)], timeout=0.5))


def test_stopping_keeps_what_is_done(alone):
    e, wanted = alone

    def stopped(function, shared, chunks):
        for i, chunk in enumerate(chunks):
            if i == 2:
                raise KeyboardInterrupt
            yield function(shared, *chunk)

    found = fly(e, FLIGHTS, stopped, lambda message: None)
    assert found.stopped
    assert found.tally.flights == 2 * CHUNK
    np.testing.assert_array_equal(found.tally.lengths, wanted.tally.lengths[:, : 2 * CHUNK])


def test_stopping_before_the_first_chunk_says_nothing(alone):
    def stopped(function, shared, chunks):
        raise KeyboardInterrupt
        yield

    assert fly(alone[0], FLIGHTS, stopped, lambda message: None) is None


def test_what_travels_to_a_worker_is_small(alone):
    """A minute at 50 Hz; ten megabytes would be slow over a network."""
    assert len(pickle.dumps(alone[0])) < 3e6
