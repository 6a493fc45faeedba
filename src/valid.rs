//! Numbers are parsed once, at the edge: what passes here needs no further check.

use crate::error::{Error, Result};

/// `value` if it is finite and > 0.
pub fn positive(name: &str, value: f64) -> Result<f64> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(Error::Invalid(format!(
            "`{name}` must be finite and > 0, got {value}"
        )))
    }
}

/// `value` if it is finite and >= 0.
pub fn non_negative(name: &str, value: f64) -> Result<f64> {
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        Err(Error::Invalid(format!(
            "`{name}` must be finite and >= 0, got {value}"
        )))
    }
}

/// `value` if it is finite.
pub fn finite(name: &str, value: f64) -> Result<f64> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Error::Invalid(format!(
            "`{name}` must be finite, got {value}"
        )))
    }
}
