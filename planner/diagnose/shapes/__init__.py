"""Alternatives without a name: what a reading could vary with, in bins, few columns, between nodes."""
