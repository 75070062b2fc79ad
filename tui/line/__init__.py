"""A production line: serial, sweep, judgement, result, next unit.

Owns the parts of the verb ``line``. It decides no verdict and keeps no response.
"""
