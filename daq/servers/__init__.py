"""Histories on a database server, which several benches share.

Owns addresses, layout, connections and their faults. The queries are those of `daq.store`, and
nothing here knows a record of the program.
"""
