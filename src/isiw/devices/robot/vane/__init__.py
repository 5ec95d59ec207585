"""The rotational vane actuator, simulated: compressed air through 7.5 m of line turns the wrist after the tap.

`actuator` says what it is made of, `rotation` solves its equations for many at once, `plane` compares sizes, `strokes`
draws rotations that differ as real ones do, and `tapper` turns the wrist after the tap.
"""
