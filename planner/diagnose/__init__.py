"""Dwell tables → what the declared error model lacks, what it costs in flight, and the spec that has it."""
