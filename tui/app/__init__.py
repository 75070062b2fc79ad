"""The bench screen: a terminal application that takes an operator from a unit to a report.

`application` holds the steps together, each step is a screen in a file of its
own, `desk` is what the operator has chosen so far and `run_view` what a session
has told. Nothing here measures or computes: sessions and analyses do.
"""
