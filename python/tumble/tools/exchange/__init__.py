"""Calibrations in the files of other programs: written for them, and read from them.

Read in this order: `parts` (what a calibration consists of, and what leaving one out costs), `target` (what a
format is), `registry`, one module for each program; then `procedure` and the commands.
"""
