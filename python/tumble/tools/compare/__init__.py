"""Comparison of calibrations: a test of their agreement within their uncertainties.

Read in this order: `result`, `common` (what makes two calibrations comparable), `parameters`, `chi_square`,
`motion`, `history`, `procedure`; then the pages and the command. Theory: docs/theory/compare.md.
"""
