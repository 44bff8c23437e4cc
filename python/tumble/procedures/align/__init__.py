"""Rotation, time offset and lever arm between units that moved together.

Read in this order: `samples`, `outputs` (what the core found), `procedure`, `result`; then `messages`,
`report/`, `summary`, `command`.
"""
