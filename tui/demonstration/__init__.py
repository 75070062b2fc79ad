"""The demonstration: a bench with something hidden in its unit, and how it is told.

What is measured and computed is what every other verb does; only the hiding,
the guessing and the reveal are of its own.
"""
