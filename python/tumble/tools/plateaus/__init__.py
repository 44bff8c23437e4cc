"""Calibration over temperature: several calibrations of one unit, each at its own temperature, become one.

Read in this order: `result`, `sessions` (calibrations become observations), `order` (powers that the data
bear), `fit` (generalised least squares), `constancy` (tests of the angles), `procedure`; then `calibration`,
the page and the command. Theory: docs/theory/plateaus.md.
"""
