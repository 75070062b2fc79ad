"""The screen of a production line.

Owns what an operator at a line sees. What is done with a unit is `tui.line`'s.
"""
