"""What drivers of analysers share, and no instrument in particular.

Owns the conversation over a transport, the runner of safe-off recipes, and the record by which
`daq.drivers` knows a driver.
"""
