"""Signals other than a stepped sine: what they are, how files say it, and the plan of one."""
