"""Small widgets of the bench screen: plots, the banner of source and session, the trail of steps.

A widget draws what it is given; none of them knows a session or an instrument.
"""
