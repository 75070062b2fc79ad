"""Swept sine without an analyser: a sampled bench, one output and two inputs of a converter.

The source goes to the amplifier and, by a loop-back cable, to input 1; the unit's output goes to
input 2. Both inputs are sampled together, so that whatever the converter delays or filters is in
both and cancels in their ratio.
"""
