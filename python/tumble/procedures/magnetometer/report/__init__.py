"""The page of a calibrated magnetometer."""
