"""Judgement: resonances, damping, backlash, discrepancies, reports.

The third floor. It turns frequency responses into statements with error bars
and draws nothing on a terminal.
"""
