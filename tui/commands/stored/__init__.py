"""Verbs on what a history or a record holds already: list, show, correct, report.

Owns nothing itself; one module a verb. None of them measures.
"""
