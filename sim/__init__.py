"""Physics: drivetrain elements, the engine that steps them, effects, and the simulated analyser.

The second floor. It knows how a geared servo moves and nothing about judging
a measurement.
"""
