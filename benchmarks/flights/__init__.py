"""Simulated and recorded flights of redundant sets, replayed through `tumble.redundancy`."""
