"""1000 kills are in benchmarks/bench_export.py --kills 1000; here a dozen."""

from planner.catalog import exports
from planner.protocols import ExportOptions
from tests.export.kills import exports_with_kills
from tests.export.samples import turning


def test_kill_9_in_mid_export_leaves_whole_files_only(tmp_path):
    versions = []
    for rate in (100.0, -100.0):
        document, files = turning({"rate_1_dps": rate}), {}
        for form, dialect in (("json", None), ("csv", None), ("acutrol", "host"), ("chamber", "host")):
            files |= exports()[form].files(document, ExportOptions(dialect)).files
        versions.append({n: c if isinstance(c, bytes) else c.encode() for n, c in files.items()})
    within, looked = exports_with_kills(tmp_path, versions, kills=12, seed=1)
    assert within > 0  # some died in the midst of writing
    assert looked == 12 * len(versions[0])
