"""Devices that reach a lab's hardware through other software or over a line: each module is one way of doing so.

None of them times an ISI. They tell the hardware which ISI to keep, and read back what it did. An optional library is
loaded where it is used.
"""
