"""Acquisition functions: from a posterior and candidate ISIs to scores."""
