"""Calibrations held against each other: whether they say the same, within what is known of each.

Read in this order: `result`, `common` (what makes two calibrations comparable), `parameters`, `chi_square`,
`motion`, `history`, `procedure`; then the pages and the command. Theory: docs/theory/compare.md.
"""
