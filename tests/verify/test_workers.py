"""Who flies the chunks changes nothing: one process, several, a cluster, or one that loses a worker."""

from __future__ import annotations

import json
import os
import pickle
import signal
import time
from concurrent.futures.process import BrokenProcessPool
from dataclasses import fields

import numpy as np
import pytest
import yaml

import planner.verify.workers as workers
from planner.errors import InputError, StoppedEarly
from planner.verify.experiment import CHUNK, run_chunk
from planner.verify.monte_carlo import chunks_of, fly
from planner.verify.tally import total
from planner.verify.workers import here, locally, on_cluster, runner
from tests.verify.plans import flown, plan_of
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


def waiting_chunk(shared, number, size):
    """The chunk that is begun first comes back at once, the others when they may; says who did it."""
    e, folder = shared
    try:
        (folder / "begun").touch(exist_ok=False)
    except FileExistsError:
        while not (folder / "go").exists():
            time.sleep(0.01)
    return os.getpid(), run_chunk(e, number, size)


def kills_after_the_first(outcomes, folder):
    """SIGKILL for the worker that brought the first chunk, then go for the others; all chunks in the end."""
    done, killed = [], None
    for pid, tally in outcomes:
        if killed is None:
            assert pid != os.getpid()
            os.kill(pid, signal.SIGKILL)
            killed = pid
            (folder / "go").touch()
        done.append(tally)
    assert killed is not None
    return total(done)


def test_a_killed_worker_of_the_cluster_changes_nothing(alone, scheduler, tmp_path):
    """Its work, and its copy of what is shared, are made again elsewhere."""
    e, wanted = alone
    outcomes = on_cluster(scheduler.scheduler_address, waiting_chunk, (e, tmp_path), chunks_of(FLIGHTS))
    found = kills_after_the_first(outcomes, tmp_path)
    np.testing.assert_array_equal(found.lengths, wanted.tally.lengths)
    np.testing.assert_array_equal(found.squares, wanted.tally.squares)


@pytest.fixture(name="pools")
def _pools(monkeypatch):
    """The chunks that every pool of local workers was given."""
    given, pool = [], workers._pool

    def counted(n, function, shared, chunks):
        given.append([number for number, _ in chunks])
        yield from pool(n, function, shared, chunks)

    monkeypatch.setattr(workers, "_pool", counted)
    return given


def test_a_killed_local_worker_changes_nothing(alone, pools, tmp_path):
    e, wanted = alone
    found = kills_after_the_first(locally(2, waiting_chunk, (e, tmp_path), chunks_of(FLIGHTS)), tmp_path)
    assert len(pools) == 2
    assert set(pools[1]) < set(pools[0])  # what had come back is not flown again
    np.testing.assert_array_equal(found.lengths, wanted.tally.lengths)
    np.testing.assert_array_equal(found.squares, wanted.tally.squares)


def test_a_worker_killed_in_the_middle_of_verify_changes_nothing(run, pools, monkeypatch, tmp_path):
    """All workers at once, from the command's own progress, after the first chunk."""
    from joblib.externals.loky import reusable_executor

    from planner.verify import flown as rounds

    (tmp_path / "spec.yaml").write_bytes(yaml.safe_dump(flown(), sort_keys=False).encode())
    (tmp_path / "plan.json").write_text(json.dumps(plan_of("flown").document))
    chunks = ("--flights", 4 * CHUNK, "--workers", 2, "--through-files", 0)
    arguments = ("verify", "spec.yaml", "plan.json", *chunks, "--json", "-o")
    undisturbed = run(*arguments, "undisturbed")
    assert undisturbed.code in (0, 4), undisturbed.err  # kept, or not sure yet after so few flights
    assert len(pools) == 1
    killed = []

    def disturbed(e, flights, who, progress, before=None):
        def kills_once(message):
            if not killed:
                killed.extend(reusable_executor._executor._processes)
                for pid in killed:
                    os.kill(pid, signal.SIGKILL)

        return fly(e, flights, who, kills_once, before)

    monkeypatch.setattr(rounds, "fly", disturbed)
    found = run(*arguments, "disturbed")
    assert killed
    assert len(pools) == 3
    assert (found.code, found.out) == (undisturbed.code, undisturbed.out)
    for name in ("verify.json", "report.html"):
        assert (tmp_path / "disturbed" / name).read_bytes() == (tmp_path / "undisturbed" / name).read_bytes()


def test_workers_that_die_again_and_again_end_it(monkeypatch):
    """Five pools whose workers die, as those above did when they were killed."""
    given = []

    def deadly(n, function, shared, chunks):
        given.append([number for number, _ in chunks])
        raise BrokenProcessPool("killed")
        yield

    monkeypatch.setattr(workers, "_pool", deadly)
    with pytest.raises(StoppedEarly, match="workers died 5 times, of too little memory"):
        list(locally(2, waiting_chunk, None, [(0, 1), (1, 1)]))
    assert given == [[0, 1]] * 5


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
