"""The page of a multi-pose calibration."""
