"""What an update of the spec asks: sizes, spreads, tests and what they cost."""
