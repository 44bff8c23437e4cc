"""Calibration certificates: one model, a PDF/A-3 and a Digital Calibration Certificate that agree."""
