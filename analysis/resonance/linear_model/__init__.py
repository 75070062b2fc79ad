"""A linear model of a whole level: how it is chosen, fitted, believed and read."""
