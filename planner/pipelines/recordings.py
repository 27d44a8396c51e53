"""The flow of raw recordings: files → rests and motions → dwell table with an account of every sample."""
