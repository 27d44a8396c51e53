"""The flow of a diagnosis: dwell table → what the model lacks → error before and after → spec."""
