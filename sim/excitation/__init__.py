"""Servos that a multisine, a chirp or noise drives, and what an estimator reads of them."""
