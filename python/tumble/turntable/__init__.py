"""Targets on a turntable, calibrated against a co-mounted reference.

Read in this order: `poses`, `matching` (which rest shows which pose), `reference`, `target` and `triads`
(what each unit yields), `procedure` (all of it), `result`; then `limits`, `messages`, `report/`, `summary`,
`command`.
"""
