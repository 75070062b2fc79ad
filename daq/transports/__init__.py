"""Ways to reach an instrument, all behind one small interface and opened by URL.

`base` says what a transport is; `visa`, `prologix` and `transcript` are the
kinds there are; `address` and `open` turn a URL into one. A transport moves
messages and knows nothing of what they mean.
"""

__all__ = ["base", "open", "transcript"]
"""The modules whose names others may rely on; docs/api.md lists them."""
