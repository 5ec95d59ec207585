"""Transports: devices that a session reaches over a serial port, a network, or a folder.

Each needs its own optional library at most, and loads it only when it is used.
"""
