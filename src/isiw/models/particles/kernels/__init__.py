"""Compiled loops over particles: what `noise`, `shapes`, `moves` and `predictions` say in torch, for one processor."""
