"""Text for a terminal: lines and tables of 80 columns, plots, progress, quoting.

Owns how things look as text, and where it is written. It computes nothing.
"""
