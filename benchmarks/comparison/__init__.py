"""The comparison of strategies, acquisition functions and families of models on the same people: parts of `compare`."""
