"""The noise of channels before anything is believed: its variances, its whitening, rows far off under it."""
