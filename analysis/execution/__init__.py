"""Where simulations run: on this machine's cores, or on a cluster.

Owns executors, progress and the number of cores of linear algebra. It knows no physics.
"""
