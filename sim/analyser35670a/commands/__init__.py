"""SCPI of the simulated 35670A: its command tree, and what each command does.

Owns the language. It computes no reading.
"""
