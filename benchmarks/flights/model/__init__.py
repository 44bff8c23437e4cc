"""A redundant set by one model, in numpy: `shared/design/redundancy.md` in code that a reader can follow.

`window` averages readings, `error` holds what is known of a secondary, `clock` finds its delay, `test` compares
pairs, `hypotheses` names the unit, `output` fuses, `monitor` ties them. All run many flights of one length at once.
"""
