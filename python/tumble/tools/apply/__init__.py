"""A log, corrected with a calibration."""
