"""Plots in characters: scales, colours, dots and the widgets that show them.

Owns how data become cells of a terminal. It knows no session, no analysis and no screen.
"""
