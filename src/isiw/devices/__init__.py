"""Devices: they deliver a pair of stimuli and report its outcome.

A device of your own needs the five verbs of `protocol.Device`; `protocol.CallbackDevice` makes one from functions.
Every session wraps its device in `limited.LimitedDevice`.
"""
