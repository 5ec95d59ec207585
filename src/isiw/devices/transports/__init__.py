"""Devices that reach a lab's hardware through other software: each module is one way of passing requests and answers.

None of them times an ISI. They tell the hardware which ISI to keep, and read back what it did.
"""
