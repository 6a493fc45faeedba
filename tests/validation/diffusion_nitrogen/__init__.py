"""Table 8 of Yang (2013)."""
