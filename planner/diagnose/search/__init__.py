"""One sensor from the prepared table to what was found: noise, candidates, steps forward and back."""
