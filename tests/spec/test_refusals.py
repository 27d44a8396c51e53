# ruff: noqa: E501  (one refusal a line: the table is read across)
"""Every refusal that concerns a spec: the place in the file, the path in the user's words, the remedy."""

from __future__ import annotations

import pytest

from tests.spec.example import EXAMPLE, changed, faults, loaded, place

CURVE = "{curve: {-60 degC: 5 mg, 20 degC: 0 mg, 60 degC: -3 mg}}"
RESIDUAL = "{1: 0.032 deg/s, 3: 0.0085 deg/s, 5: 0.0035 deg/s}"
SPREADS = "{-55 degC: 0.02 %, 20 degC: 0.01 %, 65 degC: 0.03 %}"
CANDIDATES = "candidates: [1, 3, 5, 7, 10, 12, 15, 20]"
CHAMBER = "    chamber: {range: [-65 degC, 85 degC], heating: 4 K/min, cooling: 2 K/min, soak: 30 min}\n"
STATIC = "static:     {bench: rate_table, calibrates: [gyro.bias, accelerometer.bias],"
FIXED = "fixed: {gyro_drift: {temperatures: 15, repeats: 15}}"
RATES = "motions: 30,"
SPIN = "motions: [{rate_1: 100 deg/s}, {rate_1: -700 deg/s}],"

# (old text, new text, where the fault stands in the new text, path, words of the message)
REFUSALS = {
    # missing and unknown keys
    "missing limit": (" limit: 10 m,", "", "{error: position", "requirement[0].limit", "missing"),
    "missing record": ("motions: 1, record: 300 s,", "", "gyro_drift: {bench", "tests.gyro_drift.record", "missing"),
    "missing name": ("name: small UAV, one minute without aiding\n", "", "planner: 1", "name", "missing"),
    "unknown key": ("  confidence:", "  confidense:", "confidense", "plan.confidense", "did you mean 'confidence'?"),
    "unknown top key": ("benches:", "benchs:", "benchs:", "benchs", "did you mean 'benches'?"),
    "a key without value": ("in_run: 0.001 deg/s", "in_run:", "in_run:", "unit.gyro.bias.in_run", "empty"),
    "unknown word": ("worst_case}", "worst}", "worst}", "requirement[0].rule", "worst_case"),
    "unknown error": ("error: position", "error: positon", "positon", "requirement[0].error", "'position'?"),
    "another format": ("planner: 1", "planner: 2", "2\nname", "planner", "planner: 1"),
    # units and dimensions
    "no unit": ("limit: 10 m", "limit: 10", "10, rule", "requirement[0].limit", "'10 m'"),
    "wrong dimension": ("limit: 10 m", "limit: 10 deg", "10 deg", "requirement[0].limit", "like m such as '10 m'"),
    "velocity in metres": (
        "error: position, limit: 10 m", "error: velocity, limit: 10 m", "10 m,", "requirement[0].limit", "m/s",
    ),
    "budget without unit": (
        "in_run: 0.001 deg/s", "in_run: 0.001", "0.001\n", "unit.gyro.bias.in_run", "'0.001 deg/s'",
    ),
    "budget of another dimension": (
        "in_run: 0.001 deg/s", "in_run: 0.001 g", "0.001 g", "unit.gyro.bias.in_run", "deg/s",
    ),
    "a bare share": ("systematic: 0.5 %\n", "systematic: 0.005\n", "0.005\n", "unit.gyro.scale_factor.systematic", "%"),
    "mass": ("in_run: 0.001 deg/s", "in_run: 3 kg", "3 kg", "unit.gyro.bias.in_run", "gravity"),
    "unknown unit": ("in_run: 0.001 deg/s", "in_run: 3 furlong", "3 furlong", "unit.gyro.bias.in_run", "unknown"),
    "decimal comma": ("in_run: 0.001 deg/s", "in_run: 0,001 deg/s", "0,001", "unit.gyro.bias.in_run", "point"),
    "temperature without unit": (
        "range: [-65 degC", "range: [-65", "-65,", "benches.rate_table.chamber.range[0]", "'-65 degC'",
    ),
    "temperature below absolute zero": (
        "range: [-65 degC", "range: [-300 degC", "-300", "benches.rate_table.chamber.range[0]", "possible",
    ),
    "time without unit": ("gap: 1 min", "gap: 60", "60}\nplan", "tests.rates.gap", "'60 s'"),
    "share above one": ("confidence: 95 %", "confidence: 195 %", "195 %", "plan.confidence", "100 %"),
    "share without unit": ("confidence: 95 %", "confidence: 0.95", "0.95\n", "plan.confidence", "%"),
    # nan, inf, huge, negative, zero
    "nan": ("in_run: 0.001 deg/s", "in_run: .nan", ".nan", "unit.gyro.bias.in_run", "finite"),
    "nan with unit": ("in_run: 0.001 deg/s", "in_run: nan deg/s", "nan deg/s", "unit.gyro.bias.in_run", "finite"),
    "inf": ("limit: 10 m", "limit: inf m", "inf m", "requirement[0].limit", "finite"),
    "overflow": ("limit: 10 m", "limit: 1e400 m", "1e400", "requirement[0].limit", "finite"),
    "huge": ("limit: 10 m", "limit: 1e300 m", "1e300", "requirement[0].limit", "too large"),
    "tiny": ("in_run: 0.001 deg/s", "in_run: 1e-300 deg/s", "1e-300", "unit.gyro.bias.in_run", "too small"),
    "a century": ("service_life: 500 h", "service_life: 1e9 h", "1e9 h", "unit.service_life", "century"),
    "negative limit": ("limit: 10 m", "limit: -10 m", "-10 m", "requirement[0].limit", "greater than zero"),
    "zero limit": ("limit: 10 m", "limit: 0 m", "0 m,", "requirement[0].limit", "greater than zero"),
    "negative budget": ("in_run: 0.001 deg/s", "in_run: -1 deg/s", "-1 deg/s", "unit.gyro.bias.in_run", "negative"),
    "negative residual": ("5: 0.0035 deg/s", "5: -0.1 deg/s", "-0.1", "unit.gyro.bias.temperature_residual[5]", "negative"),
    "no spread": ("      run_to_run: 0.002 deg/s\n", "", "gyro.bias]", "tests.gyro_drift.calibrates[0]", "'0 deg/s' where it has none"),
    "negative spread": ("run_to_run: 0.002 deg/s", "run_to_run: -0.002 deg/s", "-0.002 deg/s\n", "unit.gyro.bias.run_to_run", "zero or more"),
    "negative spread in a table": (
        "20 degC: 0.01 %", "20 degC: -1 %", "-1 %,", "unit.gyro.scale_factor.run_to_run[20 degC]", "zero or more",
    ),
    "negative rate of a chamber": ("heating: 4 K", "heating: -4 K", "-4 K", "benches.rate_table.chamber.heating", "greater"),
    "zero record": ("motions: 1, record: 300 s", "motions: 1, record: 0 s", "0 s, gap: 15 min}\n  static", "tests.gyro_drift.record", "greater"),
    "negative install": ("    install: 30 min", "    install: -1 min", "-1 min", "benches.rate_table.install", "less than 0"),
    "count that is no count": ("units: 4", "units: 4.5", "4.5", "benches.rate_table.units", "whole number"),
    "no unit of a count": ("units: 4", "units: 0", "0\n    install", "benches.rate_table.units", "less than 1"),
    # empty and contradictory tables
    "empty budget": ("{systematic: 0.5 %, run_to_run: 20 ppm}", "{}", "scale_factor: {}", "unit.accelerometer.scale_factor", "empty"),
    "empty residual": (RESIDUAL, "{}", "{}", "unit.gyro.bias.temperature_residual", "at least 1"),
    "empty spread": (SPREADS, "{}", "{}", "unit.gyro.scale_factor.run_to_run", "at least 1"),
    "empty curve": (CURVE, "{curve: {}}", "{}}", "unit.accelerometer.bias.temperature_residual.curve", "at least 2"),
    "a curve of one point": (
        CURVE, "{curve: {0 degC: 1 mg}}", "{0 degC", "unit.accelerometer.bias.temperature_residual.curve", "at least 2",
    ),
    "a curve outside the range of use": (
        CURVE, "{curve: {61 degC: 1 mg, 70 degC: 2 mg}}", "curve: {61", "unit.accelerometer.bias.temperature_residual.curve",
        "plan.temperatures.range",
    ),
    "residual that grows": (
        "3: 0.0085 deg/s", "3: 0.0335 deg/s", "0.0335", "unit.gyro.bias.temperature_residual[3]", "cannot grow",
    ),
    "one temperature in two words": (
        "{-55 degC: 0.02 %", "{-55 degC: 0.02 %, 218.15 K: 0.03 %", "218.15 K", "unit.gyro.scale_factor.run_to_run[218.15 K]",
        "twice",
    ),
    "number of points that is none": ("{1: 0.032", "{one: 0.032", "one: 0", "unit.gyro.bias.temperature_residual.one", "whole"),
    "no tests": (EXAMPLE[EXAMPLE.index("tests:"):EXAMPLE.index("plan:")], "tests: {}\n", "{}\nplan", "tests", "at least 1"),
    "no effects": (EXAMPLE[EXAMPLE.index("effects:"):EXAMPLE.index("benches:")], "effects: []\n", "[]\n", "effects", "at least 1"),
    # longer forms of a budget
    "in-run that forgets at once": (
        "in_run: 0.001 deg/s", "in_run: {value: 0.001 deg/s, correlation_time: 0 s}", "0 s}", "unit.gyro.bias.in_run.correlation_time", "greater",
    ),
    "in-run of another dimension": ("in_run: 0.001 deg/s", "in_run: {value: 1 g}", "1 g}", "unit.gyro.bias.in_run.value", "deg/s"),
    "in-run key": (
        "in_run: 0.001 deg/s", "in_run: {value: 1 deg/s, corelation_time: 9 s}", "corelation", "unit.gyro.bias.in_run.corelation_time", "'correlation_time'?",
    ),
    "in-run as a list": ("in_run: 0.001 deg/s", "in_run: [0.001 deg/s]", "[0.001", "unit.gyro.bias.in_run", "correlation_time: 600 s}"),
    "correlation without a spread": (
        "run_to_run: 1 mg", "run_to_run: {temperature_correlation: 40 K}", "run_to_run: {temperature_c", "unit.accelerometer.bias.run_to_run.value", "missing",
    ),
    "correlation over no distance": (
        "run_to_run: 1 mg", "run_to_run: {value: 1 mg, temperature_correlation: 0 K}", "0 K}", "unit.accelerometer.bias.run_to_run.temperature_correlation", "greater",
    ),
    "correlation as a temperature": (
        "run_to_run: 1 mg", "run_to_run: {value: 1 mg, temperature_correlation: 40 degC}", "40 degC", "unit.accelerometer.bias.run_to_run.temperature_correlation", "difference in K",
    ),
    "negative spread in the longer form": (
        "run_to_run: 1 mg", "run_to_run: {value: {0 degC: -1 milli-g}, temperature_correlation: 4 K}", "-1 milli-g", "unit.accelerometer.bias.run_to_run.value[0 degC]", "zero or more",
    ),
    "a spread as a list": ("run_to_run: 1 mg", "run_to_run: [1 mg]", "[1 mg]", "unit.accelerometer.bias.run_to_run", "temperature_correlation: 40 K}"),
    "unknown figure": (
        RESIDUAL, "{1: 0.03 deg/s, figure: sigmma}", "sigmma", "unit.gyro.bias.temperature_residual.figure", "'sigma'?",
    ),
    "misspelt figure": (RESIDUAL, "{1: 0.03 deg/s, figur: sigma}", "figur:", "unit.gyro.bias.temperature_residual.figur", "'figure'?"),
    "estimated from one power-on": (
        "run_to_run: 1 mg", "run_to_run: {value: 1 mg, power_ons: 1}", "1}", "unit.accelerometer.bias.run_to_run.power_ons", "less than 2",
    ),
    "estimated from 0 power-ons": (
        "run_to_run: 1 mg", "run_to_run: {value: 1 mg, power_ons: 0 }", "0 }", "unit.accelerometer.bias.run_to_run.power_ons", "a whole number, not less than 2",
    ),
    "estimated from -3 power-ons": (
        "run_to_run: 1 mg", "run_to_run: {value: 1 mg, power_ons: -3}", "-3}\n", "unit.accelerometer.bias.run_to_run.power_ons", "a whole number, not less than 2",
    ),
    "estimated from 1.5 power-ons": (
        "run_to_run: 1 mg", "run_to_run: {value: 1 mg, power_ons: 1.5}", "1.5}\n", "unit.accelerometer.bias.run_to_run.power_ons", "a whole number, not less than 2",
    ),
    "estimated from twelve power-ons": (
        "run_to_run: 1 mg", "run_to_run: {value: 1 mg, power_ons: twelve}", "twelve}\n", "unit.accelerometer.bias.run_to_run.power_ons", "a whole number, not less than 2",
    ),
    "power-ons without a spread": ("run_to_run: 1 mg", "run_to_run: {power_ons: 12}", "run_to_run: {p", "unit.accelerometer.bias.run_to_run.value", "missing"),
    "power-ons misspelt": (
        "run_to_run: 1 mg", "run_to_run: {value: 1 mg, poweron: 9}", "poweron", "unit.accelerometer.bias.run_to_run.poweron", "'power_ons'?",
    ),
    "unknown family": (RESIDUAL, "{1: 0.03 deg/s, curve: kinck}", "kinck", "unit.gyro.bias.temperature_residual.curve", "'kink'?"),
    "a family of no table": (RESIDUAL, "{curve: kink}", "{curve: kink", "unit.gyro.bias.temperature_residual", "{1: …, 3: …, curve: …}"),
    "misspelt curve": (RESIDUAL, "{1: 0.03 deg/s, curv: kink}", "curv:", "unit.gyro.bias.temperature_residual.curv", "'curve'?"),
    "two units' curves": (
        CURVE, "{curve: [{0 degC: 1 mg, 9 degC: 2 mg}, {0 degC: 1 mg, 9 degC: 3 mg}]}", "[{0 degC", "unit.accelerometer.bias.temperature_residual.curve",
        "2 units tell no mean and spread; give 3 or more",
    ),
    "no unit's curve": (CURVE, "{curve: []}", "[]}", "unit.accelerometer.bias.temperature_residual.curve", "no unit"),
    "a unit of one temperature": (
        CURVE, "{curve: [{0 degC: 1 mg, 9 degC: 2 mg}, {1 degC: 1 mg, 8 degC: 3 mg}, {5 degC: 7 mg}]}", "{5 degC",
        "unit.accelerometer.bias.temperature_residual.curve[2]", "at least 2",
    ),
    "a unit in another unit": (
        CURVE, "{curve: [{0 degC: 1 mg, 9 degC: 2 mg}, {1 degC: 1 mg, 8 degC: 3 deg/h}, {5 degC: 7 mg, 6 degC: 1 mg}]}", "3 deg/h",
        "unit.accelerometer.bias.temperature_residual.curve[1][8 degC]", "one like g",
    ),
    "a unit beyond the range": (
        CURVE, "{curve: [{0 degC: 1 mg, 9 degC: 2 mg}, {61 degC: 1 mg, 80 degC: 3 mg}, {5 degC: 7 mg, 6 degC: 1 mg}]}", "{61 degC",
        "unit.accelerometer.bias.temperature_residual.curve[1]", "plan.temperatures.range",
    ),
    "a unit's temperature in two words": (
        CURVE, "{curve: [{0 degC: 1 mg, 9 degC: 2 mg}, {1 degC: 1 mg, 8 degC: 3 mg}, {0 degC: 7 mg, 273.15 K: 1 mg, 9 degC: 0 mg}]}", "273.15 K",
        "unit.accelerometer.bias.temperature_residual.curve[2][273.15 K]", "twice",
    ),
    "a curve of one temperature in two words": (
        CURVE, "{curve: {0 degC: 1 mg, 273.15 K: 2 mg}}", "{0 degC", "unit.accelerometer.bias.temperature_residual.curve", "at least 2",
    ),
    "a figure of several curves": (
        CURVE, "{curve: [{0 degC: 1 mg, 9 degC: 2 mg}], figure: sigma}", "{curve: [", "unit.accelerometer.bias.temperature_residual", "for a table",
    ),
    # where flights start
    "unknown temperature": ("worst_case}", "rss, temperature: wurst}", "wurst", "requirement[0].temperature", "'worst'?"),
    "temperatures in a list": ("worst_case}", "rss, temperature: [20 degC]}", "[20 degC]}", "requirement[0].temperature", "distribution: {"),
    "distribution misspelt": (
        "worst_case}", "rss, temperature: {distributon: {20 degC: 1}}}", "distributon", "requirement[0].temperature.distributon", "'distribution'?",
    ),
    "no weights": ("worst_case}", "rss, temperature: {distribution: {}}}", "{}}", "requirement[0].temperature.distribution", "at least 1"),
    "a negative weight": (
        "worst_case}", "rss, temperature: {distribution: {20 degC: -0.5}}}", "-0.5", "requirement[0].temperature.distribution[20 degC]", "less than 0",
    ),
    "only zero weights": (
        "worst_case}", "rss, temperature: {distribution: {20 degC: 0, 30 degC: 0.0}}}", "{20 degC: 0", "requirement[0].temperature.distribution", "all weights are zero",
    ),
    "a weight that is text": (
        "worst_case}", "rss, temperature: {distribution: {20 degC: much}}}", "much", "requirement[0].temperature.distribution[20 degC]", "not a number",
    ),
    "a start in two words": (
        "worst_case}", "rss, temperature: {distribution: {20 degC: 1, 293.15 K: 1}}}", "293.15 K", "requirement[0].temperature.distribution[293.15 K]", "twice",
    ),
    # how to plan
    "unknown method": ("confidence: 95 %", "method: informaton", "informaton", "plan.method", "'information'?"),
    "unknown estimator": ("confidence: 95 %", "temperature_estimator: line", "line\n", "plan.temperature_estimator", "'lines'?"),
    "redundancy of two": ("confidence: 95 %", "redundancy: 2", "2\n  quantile", "plan.redundancy", "more than 1"),
    "no step": (CANDIDATES, "step: 0 K", "0 K", "plan.temperatures.step", "greater than 0"),
    "a step as a temperature": (CANDIDATES, "step: 5 degC", "5 degC}", "plan.temperatures.step", "K"),
    "too fine a step": (CANDIDATES, "step: 0.1 K", "0.1 K", "plan.temperatures.step", "1200 steps of the range, more than 240; write 0.5 K"),
    "a figure of no table": (RESIDUAL, "{figure: sigma}", "{figure", "unit.gyro.bias.temperature_residual", "at least 1"),
    "a figure of a curve": (
        CURVE, "{curve: {0 degC: 1 mg, 9 degC: 2 mg}, figure: sigma}", "{curve: {0", "unit.accelerometer.bias.temperature_residual", "for a table",
    ),
    "a residual of no form": (RESIDUAL, "[0.03 deg/s]", "[0.03 deg/s]", "unit.gyro.bias.temperature_residual", "{curve: ["),
    # accuracy and alignment
    "accuracy without unit": ("    axes: 2", "    axes: 2\n    accuracy: {rate: 20}", "20}\n", "benches.rate_table.accuracy.rate", "'20 ppm'"),
    "accuracy of another dimension": ("    axes: 2", "    axes: 2\n    accuracy: {rate: 2 deg/s}", "2 deg/s}", "benches.rate_table.accuracy.rate", "ppm"),
    "accuracy key": ("    axes: 2", "    axes: 2\n    accuracy: {levl: 1 deg}", "levl", "benches.rate_table.accuracy.levl", "'level'?"),
    "negative accuracy": ("    axes: 2", "    axes: 2\n    accuracy: {level: -1 deg}", "-1 deg", "benches.rate_table.accuracy.level", "less than 0"),
    "no reference": ("    axes: 2", "    axes: 2\n    accuracy: {mounting: 6 deg}", "6 deg", "benches.rate_table.accuracy.mounting", "no reference"),
    "flown before": (FIXED, FIXED + "\nflown_after: -1 d", "-1 d", "flown_after", "less than 0"),
    "no alignment": (FIXED, FIXED + "\ninitial_alignment: {}", "initial_alignment", "initial_alignment", "perfect"),
    "alignment twice": (
        FIXED, FIXED + "\ninitial_alignment: {self_aligned: true, roll_pitch: 1 deg}", "1 deg}", "initial_alignment.roll_pitch", "leave roll_pitch out",
    ),
    "alignment that is none": (FIXED, FIXED + "\ninitial_alignment: {heading: 90 deg}", "90 deg", "initial_alignment.heading", "30 deg"),
    "alignment key": (FIXED, FIXED + "\ninitial_alignment: {headng: 1 deg}", "headng", "initial_alignment.headng", "'heading'?"),
    # effects and errors
    "unknown effect of a budget": ("  gyro:\n    bias:", "  gyro:\n    bais:", "bais:", "unit.gyro.bais", "did you mean 'bias'?"),
    "effect of the other sensor": (
        "    scale_factor: {sys", "    g_sensitivity: {run_to_run: 1 deg/s/g}\n    scale_factor: {sys", "g_sensitivity",
        "unit.accelerometer.g_sensitivity", "only on: gyro",
    ),
    "unknown declared effect": ("[bias, bias_temperature", "[bias, bias_temperatur", "bias_temperatur,", "effects[1]", "'bias_temperature'?"),
    "effect declared twice": (" misalignment]", " misalignment, bias]", "bias]\n", "effects[5]", "twice"),
    "unknown calibrated error": ("calibrates: [gyro.bias],", "calibrates: [gyro.bais],", "gyro.bais", "tests.gyro_drift.calibrates[0]", "'gyro.bias'?"),
    "calibrated without budget": (
        "calibrates: [gyro.bias],", "calibrates: [gyro.misalignment],", "gyro.misalignment", "tests.gyro_drift.calibrates[0]",
        "unit.gyro.misalignment",
    ),
    "calibrated without spread": (
        "      run_to_run: 1 mg\n", "", "accelerometer.bias]", "tests.static.calibrates[1]", "unit.accelerometer.bias.run_to_run",
    ),
    "calibrated but not declared": (
        "scale_factor, scale_factor_temp", "scale_factor_temp", "gyro.scale_factor,", "tests.rates.calibrates", "does not declare scale_factor",
    ),
    # benches and tests
    "unknown bench": ("rates:      {bench: rate_table", "rates:      {bench: rate_tabel", "rate_tabel", "tests.rates.bench", "'rate_table'?"),
    "unknown kind": ("    axes: 2", "    axes: 2\n    kind: rate_tabel", "rate_tabel", "benches.rate_table.kind", "'rate_table'?"),
    "chamber upside down": ("[-65 degC, 85 degC]", "[85 degC, -65 degC]", "[85", "benches.rate_table.chamber.range", "coldest"),
    "calibrates nothing, nothing fixed": (
        "calibrates: gyro.scale_factor, ", "", "rates:      {", "tests.rates", "temperatures and repeats",
    ),
    "no chamber for temperatures": (CHAMBER, "", "static:     {", "tests.static", "temperatures: room"),
    "temperature outside the chamber": (
        "motions: 30,", "temperatures: [-70 degC, 20 degC],", "-70 degC", "tests.rates.temperatures[0]", "-65 .. 85",
    ),
    "temperature twice": ("motions: 30,", "temperatures: [20 degC, 293.15 K],", "[20 degC,", "tests.rates.temperatures", "twice"),
    "range outside the chamber": (
        "{range: [-60 degC, 60 degC]", "{range: [-70 degC, 60 degC]", "[-70 degC", "plan.temperatures.range", "-65 .. 85",
    ),
    "motion faster than the table": (RATES, SPIN, "-700 deg/s", "tests.rates.motions[1].rate_1", "limits.rate"),
    "empty motion": (RATES, "motions: [{}],", "{}]", "tests.rates.motions[0]", "position_1"),
    # plan
    "range upside down": ("{range: [-60 degC, 60 degC]", "{range: [60 degC, -60 degC]", "[60 degC, -", "plan.temperatures.range", "coldest"),
    "candidate twice": (CANDIDATES, "candidates: [1, 3, 3]", "3]}", "plan.temperatures.candidates[2]", "twice"),
    "no candidate left": (CANDIDATES, "candidates: [7, 10]", "[7, 10]", "plan.temperatures.candidates", "1, 3, 5"),
    "9000 candidates": (
        CANDIDATES,
        f"candidates: [{', '.join(map(str, range(1, 9001)))}]",
        "[1, 2",
        "plan.temperatures.candidates",
        "9000 numbers to choose from",
    ),
    "no candidates": (CANDIDATES, "candidates: []", "[]}", "plan.temperatures.candidates", "at least 1"),
    "least above most": ("least: 2, most: 60", "least: 61, most: 60", "61", "plan.repeats.least", "more than most"),
    "student with one": ("least: 2", "least: 1", "1, most", "plan.repeats.least", "normal"),
    "student with one fixed": (FIXED, "fixed: {gyro_drift: {temperatures: 5, repeats: 1}}", "1}}", "plan.fixed.gyro_drift.repeats", "normal"),
    "fixed of no test": ("fixed: {gyro_drift", "fixed: {gyro_drif", "gyro_drif:", "plan.fixed.gyro_drif", "'gyro_drift'?"),
    "repeats for other temperatures": (
        FIXED, "fixed: {gyro_drift: {temperatures: 3, repeats: [2, 4]}}", "[2, 4]", "plan.fixed.gyro_drift.repeats", "2 repeats for 3",
    ),
    "repeats for no temperatures": (
        FIXED, "fixed: {gyro_drift: {repeats: [2, 4]}}", "[2, 4]", "plan.fixed.gyro_drift.repeats", "temperatures",
    ),
    "more parents than individuals": (FIXED, "genetic: {individuals: 16}", "genetic: {ind", "plan.genetic.best", "32 of 16"),
    "no place for children": (
        FIXED, "genetic: {individuals: 32, best: 32}", "32}", "plan.genetic.best", "fewer",
    ),
    "nothing to minimise": (FIXED, "minimise: {time: 0, power_on: 0}", "{time", "plan.minimise", "zero"),
    "yes is a word": (CANDIDATES, CANDIDATES + ", interpolate: yes", "yes}", "plan.temperatures.interpolate", "true nor false"),
    # trajectory and sensitivities
    "unknown trajectory": ("small_uav_1", "small_uav_7", "small_uav_7", "trajectory", "did you mean 'small_uav_"),
    "unknown setting of a trajectory": (
        "small_uav_1", "{name: level, duratio: 60 s}", "duratio", "trajectory.duratio", "'duration'?",
    ),
    "wrong unit of a trajectory's setting": (
        "small_uav_1", "{name: level, duration: 60 m}", "60 m}", "trajectory.duration", "like s",
    ),
    "trajectory without name": ("small_uav_1", "{duration: 60 s}", "{duration", "trajectory", "name"),
    "no such flight file": ("small_uav_1", "{file: nowhere.csv}", "nowhere.csv", "trajectory.file", "no file"),
    "a number as trajectory": ("trajectory: small_uav_1", "trajectory: 5", "5\nsens", "trajectory", "flight.csv"),
    "unknown source": ("simulated", "simulatd", "simulatd", "sensitivities", "'simulated'"),
    "wrong unit of a coefficient": (
        "simulated", "{given: {gyro.bias: 578.5 m/g}}", "578.5 m/g", "sensitivities.given.gyro.bias", "'578.5 m/(deg/s)'",
    ),
    "unknown error with a coefficient": (
        "simulated", "{given: {gyro.bais: 578.5 m/(deg/s)}}", "gyro.bais", "sensitivities.given.gyro.bais", "'gyro.bias'?",
    ),
    "calibrated error without coefficient": (
        "simulated", "{given: {gyro.bias: 578.5 m/(deg/s)}}", "accelerometer.bias]", "tests.static.calibrates[1]", "coefficient",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSALS)
def test_a_refusal_says_where_and_what_to_do(case: str) -> None:
    old, new, needle, path, words = REFUSALS[case]
    text = changed((old, new))
    found = {fault.path: fault for fault in faults(text)}
    assert path in found, sorted(found)
    fault = found[path]
    assert words in fault.message, fault.message
    assert (fault.line, fault.column) == place(text, needle)
    assert str(fault).startswith(f"campaign.yaml:{fault.line}:{fault.column}  {path}: ")


def test_an_error_calibrated_twice_by_one_test() -> None:
    text = changed((STATIC, STATIC.replace("accelerometer.bias", "gyro.bias")))
    (fault,) = faults(text)
    assert fault.path == "tests.static.calibrates[1]"
    assert fault.line == place(text, "  static:")[0]
    assert "twice" in fault.message


def test_a_bench_that_cannot_show_the_error() -> None:
    text = changed(
        ("    axes: 2\n", "    axes: 2\n    kind: levelled_plate\n"), ("    limits: {rate: 600 deg/s}\n", "")
    )
    (fault,) = faults(text)
    assert fault.path == "tests.rates.calibrates"
    assert "levelled_plate cannot observe gyro.scale_factor" in fault.message


def test_a_motion_of_an_axis_that_the_bench_has_not() -> None:
    text = changed(("    axes: 2\n", "    axes: 1\n"), (RATES, "motions: [{rate_2: 100 deg/s}],"))
    (fault,) = faults(text)
    assert (fault.path, fault.line) == ("tests.rates.motions[0].rate_2", place(text, "rate_2")[0])


def test_a_motion_that_this_kind_of_bench_does_not_do() -> None:
    text = changed((RATES, "motions: [{acceleration: 5 g}],"))
    (fault,) = faults(text)
    assert (fault.path, fault.column) == ("tests.rates.motions[0].acceleration", place(text, "5 g}")[1])


def test_a_load_beyond_the_centrifuge() -> None:
    spin = "  spin: {bench: centrifuge, record: 20 s, temperatures: room, repeats: 1, motions: [{acceleration: 120 g}]}\n"
    text = changed(("plan:\n", spin + "plan:\n"))
    (fault,) = faults(text)
    assert (fault.path, (fault.line, fault.column)) == (
        "tests.spin.motions[0].acceleration",
        place(text, "120 g"),
    )
    assert loaded(text.replace("120 g", "100 g"))  # the limit itself is within


def test_a_test_at_room_temperature_needs_no_chamber() -> None:
    assert loaded(
        changed(
            (
                "{bench: rate_table, calibrates: gyro.scale_factor,",
                "{bench: centrifuge, calibrates: gyro.scale_factor, temperatures: room,",
            )
        )
    )


def test_temperatures_said_twice_and_differently() -> None:
    text = changed(("calibrates: [gyro.bias], motions: 1,", "calibrates: [gyro.bias], temperatures: 5,"))
    (fault,) = faults(text)
    assert (fault.path, fault.line) == (
        "plan.fixed.gyro_drift.temperatures",
        place(text, "temperatures: 15")[0],
    )
