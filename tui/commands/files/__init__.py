"""Verbs that read or write files of responses and records.

Owns what these verbs say. They drive nothing.
"""
