"""The dissertation's own methods (4.3): three regressions, a particle filter, and the incremental sweep."""
