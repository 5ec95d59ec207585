"""The rotational vane actuator, simulated: compressed air through 7.5 m of line turns the wrist after the tap.

`rotation` has its parts and solves their equations for many at once, and `tapper` turns the wrist after the tap.
"""
