"""Guided runs as plain data: an order goes to a procedure, views of it and an outcome come back.

A procedure that can be guided has `guided=True` in its row and `guided_run.py` in its folder, with a
`RUN_KIND`. Pages and other programs need to know no more of it.
"""
