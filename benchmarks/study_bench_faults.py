"""Campaigns with faults drawn at random on the second simulator, and kills spread over many of them.

    python benchmarks/study_bench_faults.py --campaigns 1000
    python benchmarks/study_bench_faults.py --kills 1000

Says how many campaigns held: each record once, or void and made again, made as the plan says by the true
state of the bench; the bench seen safe and safe in truth at every end, or ATTENTION. Exit 1 when one did not.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # the simulators are the tests' own

from tests.bench_run.campaigns import campaign
from tests.bench_run.kills import campaigns_with_kills
from tests.bench_run.rig import small_job


def campaigns(count: int, first: int, longest_s: float) -> int:
    job, bad, sessions, void, attention, made = small_job(), 0, 0, 0, 0, 0
    start = time.perf_counter()
    os.fsync = lambda handle: None  # type: ignore[assignment]  # what the disk does is not at stake
    for seed in range(first, first + count):
        if time.perf_counter() - start > longest_s:
            break
        made += 1
        with tempfile.TemporaryDirectory() as folder:
            outcome = campaign(job, Path(folder), seed)
        sessions, void, attention = (
            sessions + outcome.sessions,
            void + outcome.void,
            attention + outcome.attention,
        )
        if outcome.wrong:
            bad += 1
            print(f"seed {seed}: {'; '.join(outcome.wrong[:3])}")
    spent = time.perf_counter() - start
    print(
        f"{made} campaigns (seeds {first} … {first + made - 1}), {sessions} sessions, {void} records void "
        f"and made again, {attention} ends with ATTENTION; {bad} campaigns did not hold; {spent:.0f} s"
    )
    return 1 if bad else 0


def kills(count: int, seed: int) -> int:
    start = time.perf_counter()
    os.fsync = lambda handle: None  # type: ignore[assignment]  # what the disk does is not at stake
    with tempfile.TemporaryDirectory() as folder:
        tally = campaigns_with_kills(Path(folder), count, seed)
    spent = time.perf_counter() - start
    print(*tally.wrong, sep="\n")
    print(
        f"{tally.kills} kills over {tally.campaigns} campaigns, {tally.void} records void and made again, "
        f"{tally.attention} ends with ATTENTION; {len(tally.wrong)} faults; {spent:.0f} s"
    )
    return int(bool(tally.wrong))


def main() -> int:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--campaigns", type=int, default=0)
    arguments.add_argument("--kills", type=int, default=0)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--seconds", type=float, default=1e9, help="begin no campaign after so long")
    given = arguments.parse_args()
    code = campaigns(given.campaigns, given.seed, given.seconds) if given.campaigns else 0
    return max(code, kills(given.kills, given.seed) if given.kills else 0)


if __name__ == "__main__":
    sys.exit(main())
