"""A turntable session from beginning to end: simulated, calibrated, and compared with its truth."""
