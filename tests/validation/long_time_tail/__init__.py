"""The tail of the velocity autocorrelation."""
