"""From checked models to a verdict: consistent, explained, ambiguous or unexplained.

Owns the comparison of models and its words. It simulates nothing but what a check asks for.
"""
