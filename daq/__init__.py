"""The bench: frequency responses, sweep plans, instruments, sessions and files.

The lowest of the four floors. It knows nothing of physics, judgement or
screens: a simulated analyser is met through a transport, as a real one is.
"""
