"""The page of a unit over time."""
