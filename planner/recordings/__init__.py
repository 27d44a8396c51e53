"""Raw recordings → dwell tables: rests, motions, spikes, temperature, and an account of every sample."""
