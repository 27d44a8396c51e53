"""Bench campaigns in simulation: steps and budgets in, dwell tables out."""
