"""A session on a turntable: one reference and its targets."""
