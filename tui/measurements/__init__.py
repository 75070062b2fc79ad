"""Stored measurements as people meet them: rows, reports, answers that are kept.

Owns what verbs and screens share about a history. It drives no instrument.
"""
