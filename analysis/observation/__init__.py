"""A measured response in the form in which simulations are compared with it.

Owns what a response holds, what its errors mean, and whether it can be one of the unit. It fits
nothing.
"""
