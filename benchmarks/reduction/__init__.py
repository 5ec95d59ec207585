"""The dissertation's reduction of trials, reproduced: what `benchmarks/trial_reduction.py` is made of."""
