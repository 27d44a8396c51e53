"""A hundred thousand damaged recordings and dwell tables: how many are read, refused, or an internal error.

    python -m benchmarks.study_mutants [--count 100000] [--seed 1] [--only mat dwells.csv]

Prints a table by format and exits 1 when anything but a refusal in words came of one; that file is kept.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from tests.readers.mutants import MAPS, attempt, good_files, guess, mutated

TEXTS = ("csv", "tsv", "txt", "log", "dwells.csv")


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--count", type=int, default=100_000)
    arguments.add_argument("--seed", type=int, default=1)
    kinds = [*MAPS, "dwells.csv"]
    arguments.add_argument("--only", nargs="+", choices=kinds, default=kinds, help="of these; shares stay")
    given = arguments.parse_args()
    # text is where strangers' hands are: nine tenths of the damage
    share = {kind: 0.17 if kind in TEXTS else 0.03 for kind in kinds}
    broken = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        good = good_files(folder)
        for kind in given.only:
            start, counts = time.perf_counter(), Counter[str]()
            rng = np.random.default_rng([given.seed, kinds.index(kind)])
            path = folder / f"mutant.{kind}"
            for number in range(round(share[kind] * given.count)):
                path.write_bytes(mutated(good[kind], rng))
                try:
                    counts[attempt(path, kind)] += 1
                    if kind in TEXTS and kind != "dwells.csv" and number % 10 == 0:
                        counts[f"guess {guess(path)}"] += 1
                except Exception as error:  # whatever it is, it is what this study looks for
                    counts["internal error"] += 1
                    kept = Path(tempfile.gettempdir()) / f"mutant_{given.seed}_{number}.{kind}"
                    kept.write_bytes(path.read_bytes())
                    print(f"{kept}: {type(error).__name__}: {error}", file=sys.stderr)
            broken += counts["internal error"]
            print(f"{kind:<12}{dict(counts)}  {time.perf_counter() - start:.1f} s", flush=True)
    print(f"{broken} internal errors")
    return int(broken > 0)


if __name__ == "__main__":
    sys.exit(main())
