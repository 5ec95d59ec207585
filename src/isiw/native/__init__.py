"""The compiled engine: the law of particles over arrays, and what ISIs are scored by.

Its C sources are in `source`; `isiw.native.library` loads what was built of them, and `isiw.native.law` and
`isiw.native.engine` call it.
"""
