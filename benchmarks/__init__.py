"""Benchmarks of isiw: each a command with its results beside it in `results`."""
