"""Candidates and what they explain: their columns, scores and chance, and what a search believes."""
