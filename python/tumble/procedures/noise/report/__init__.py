"""The page of a noise measurement."""
