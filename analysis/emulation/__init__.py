"""What any machine would show, between those that were simulated, and its likelihood.

Owns local regression over runs and the fit of parameters on it. It chooses no model.
"""
