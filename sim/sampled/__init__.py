"""The simulated sampled bench: a converter with a servo behind it, on the usual wires."""
