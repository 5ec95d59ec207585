"""The dissertation's methods [Kim2020, 4.3]: three regressions, a particle filter, and the incremental sweep."""
