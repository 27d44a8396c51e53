"""Parquet recordings, one row group after the other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from planner.errors import InputError
from planner.protocols import RawBlock
from planner.readers._arrays import BLOCK_ROWS, as_column


class ParquetReader:
    """Columns of a Parquet file; an empty cell is NaN."""

    name = "parquet"
    suffixes = (".parquet", ".pq")

    def recognises(self, path: Path, head: bytes) -> bool:
        """By the magic number PAR1."""
        return head.startswith(b"PAR1")

    def names(self, path: Path, skip_lines: int = 0) -> tuple[str, ...]:
        """The file's columns. Raises InputError for a file that is not whole."""
        import pyarrow.parquet as pq
        from pyarrow import ArrowException

        try:
            return tuple(pq.ParquetFile(path).schema_arrow.names)
        except (ArrowException, OSError, UnicodeDecodeError) as error:
            raise InputError(f"{path} is not a whole Parquet file: {error}") from error

    def blocks(
        self, path: Path, wanted: Sequence[str], texts: Sequence[str] = (), skip_lines: int = 0
    ) -> Iterator[RawBlock]:
        """The wanted columns in batches. Raises InputError for a damaged file."""
        import pyarrow.parquet as pq
        from pyarrow import ArrowException

        start = 0
        try:
            for batch in pq.ParquetFile(path).iter_batches(BLOCK_ROWS, columns=list(wanted)):
                columns = {
                    n: as_column(path, n, batch.column(n).to_numpy(zero_copy_only=False), n in texts)
                    for n in wanted
                }
                yield RawBlock(columns, np.arange(start, start + batch.num_rows), {})
                start += batch.num_rows
        except (ArrowException, OSError, UnicodeDecodeError) as error:
            raise InputError(f"{path} is not a whole Parquet file: {error}") from error


READER = ParquetReader()
