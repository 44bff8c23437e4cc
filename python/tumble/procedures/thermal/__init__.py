"""Bias and scale over temperature, from logs of a unit at rest that warms and cools.

Read in this order: `procedure` (logs become drifts), `result`; then `messages`, `report/`, `summary`,
`command`.
"""
