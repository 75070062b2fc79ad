"""LAN gateways with a simulated instrument behind them: VXI-11 and HiSLIP.

Each module owns one protocol as a server speaks it. None knows a command of an instrument, and
none opens a port: that is `sim.serve`'s part.
"""
