"""What simulated instruments share: the bus, time, faults' damage, and the device under test.

Owns nothing of any one instrument. A simulated instrument is whatever satisfies
`sim.instrument.bus.Instrument`; servers, adapters and the loop-back know no other interface.
"""
