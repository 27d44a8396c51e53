"""Hypotheses about the bench: what a wrong reference would add to every channel judged by it."""
