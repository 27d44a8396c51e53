"""What a user gives where a file of a kind is asked for, in words, and which command makes one."""

from __future__ import annotations

CALIBRATION = "the calibration.json that `planner calibrate -o DIR` writes, or its folder"
COLUMN_MAP = "a column map; `planner look RECORDING -o DIR` writes one to start from"
DIAGNOSIS = "the diagnosis.json that `planner diagnose -o DIR` writes, or its folder"
DIALECT = "the name of a dialect, or the YAML or TOML file of one (`planner docs own_bench`)"
HISTORY = (
    "a history (CSV with unit, date, error, term, value, uncertainty), dwell tables or a calibration.json"
)
JOURNAL = "another --journal FILE"
PLAN = "the plan.json that `planner plan` writes, or its folder"
RECORDING = "a recording: text, Parquet, HDF5, MATLAB, .npy or the unit's packets"
REDUCTION_ACCOUNT = "the account that `planner reduce` writes beside its dwell table"
SETTINGS = "a YAML file of `key: value` lines, e.g. in_run: off"
TABLE = "a CSV with a header line and a row each record, as `planner reduce` makes of recordings"
