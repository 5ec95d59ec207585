"""Settings of the named strategies: a module with their parts, and one with the usual settings of each family."""
