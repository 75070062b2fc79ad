"""Records of input and output over time, as data loggers write them."""
