"""The engine: exact, event-free stepping of piecewise-linear systems, many lanes at once.

Owns stepping and its machine code. It knows no servo and no instrument.
"""
