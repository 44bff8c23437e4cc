"""The kit that the pages of all procedures share: numbers, tables, figures, templates.

It sees results only, never logs.
"""
