"""Frequency responses from records over time: stepped sine, sweep, periodic signals, noise."""
