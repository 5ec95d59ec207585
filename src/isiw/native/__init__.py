"""The compiled engine: the law of particles over arrays, and what ISIs are scored by.

Its C sources are in `source`; `isiw.native.engine` loads what was built of them, and calls it.
"""
