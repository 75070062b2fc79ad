"""The first day with a real instrument, as a person goes through it.

Owns the questions to the person at the bench, and the folder with report and transcript. What is
checked is the drivers' matter; how it is told is that of `tui.commands.first_day`.
"""
