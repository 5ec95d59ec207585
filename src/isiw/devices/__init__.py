"""Devices: what delivers a pair of stimuli and reports what came of it."""
