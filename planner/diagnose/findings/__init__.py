"""What was found, as it is reported: sizes with intervals, suspects, limits, spreads, evidence."""
