"""The calibration file: what it holds, how it is read and written, and how it corrects readings."""
