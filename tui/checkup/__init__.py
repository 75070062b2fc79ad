"""What `doctor` looks at: the software, the ways to an instrument, the surroundings, a self-test.

Each module owns the checks of one of these. A check looks and says; it changes
nothing, and one that goes wrong says so in place of ending the others.
"""
