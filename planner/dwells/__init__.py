"""Dwell tables: their files, columns, checks and rows, and the references that they lack."""
