"""The bench page: an operator calibrates in a browser. It knows no procedure by name.

`tumble bench` serves it. Runs are those of `tumble.tools.guided`; only this room imports NiceGUI.
"""
