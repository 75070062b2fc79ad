"""Dialogs that screens open over themselves.

Owns questions to a person. It starts no measurement.
"""
