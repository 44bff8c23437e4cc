"""The page of calibrations that were held against each other."""
