//! x^n for a fixed n, without a call into the platform's mathematical library: the same bits on
//! every machine, and cheap enough to be asked for every pair.

/// Intervals per power of two.
const NODES: usize = 128;
/// Powers of two around 1 that are tabulated.
const BINADES: usize = 64;
const MANTISSA: u64 = (1 << 52) - 1;
const ONE: u64 = 1023 << 52;

/// x^n = 2^(e n) m^n (1 + r)^n, with m the middle of an interval and a series in r, |r| <= 1/256.
#[derive(Debug, Clone, PartialEq)]
pub struct Power {
    exponent: f64,
    /// 1/m and m^n.
    nodes: [[f64; 2]; NODES],
    /// 2^(e n), e from -32.
    binades: [f64; BINADES],
    /// n, n (n - 1)/2, ...: binomial coefficients.
    series: [f64; 5],
}

impl Power {
    /// For the exponent n.
    pub fn new(exponent: f64) -> Self {
        let mut nodes = [[0.0; 2]; NODES];
        for (k, node) in nodes.iter_mut().enumerate() {
            let inverse = 1.0 / (1.0 + (k as f64 + 0.5) / NODES as f64);
            *node = [inverse, inverse.powf(-exponent)];
        }
        let mut binades = [0.0; BINADES];
        for (k, value) in binades.iter_mut().enumerate() {
            *value = 2.0_f64.powi(k as i32 - BINADES as i32 / 2).powf(exponent);
        }
        let mut series = [0.0; 5];
        let mut binomial = 1.0;
        for (k, value) in series.iter_mut().enumerate() {
            binomial *= (exponent - k as f64) / (k as f64 + 1.0);
            *value = binomial;
        }
        Self {
            exponent,
            nodes,
            binades,
            series,
        }
    }

    /// n.
    pub fn exponent(&self) -> f64 {
        self.exponent
    }

    /// x^n for x > 0.
    #[inline(always)]
    pub fn of(&self, x: f64) -> f64 {
        let bits = x.to_bits();
        let binade = (bits >> 52).wrapping_sub(1023 - BINADES as u64 / 2) as usize;
        if binade >= BINADES {
            return x.powf(self.exponent);
        }
        let [inverse, power] = self.nodes[(bits >> 45) as usize % NODES];
        let r = f64::from_bits(bits & MANTISSA | ONE) * inverse - 1.0;
        let [a, b, c, d, e] = self.series;
        let r2 = r * r;
        let rest = r * (a + r * b + r2 * ((c + r * d) + r2 * e));
        let scale = power * self.binades[binade];
        scale + scale * rest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_agree_with_the_platform() {
        for exponent in [0.0, 0.7, 1.0, -0.5, 1.76, 3.0] {
            let power = Power::new(exponent);
            for k in 0..100_000 {
                let x = (1.0 + 1e-4 * f64::from(k)) * 2.0_f64.powi(k % 9 - 4);
                let exact = x.powf(exponent);
                let error = (power.of(x) / exact - 1.0).abs();
                assert!(error < 1e-15, "{x}^{exponent}: {error}");
            }
            // Far from 1, and at the limits of what is tabulated.
            for x in [
                1e-300,
                2.0_f64.powi(-33),
                2.0_f64.powi(-32),
                1e9,
                2.0_f64.powi(32),
                1e20,
            ] {
                let exact = x.powf(exponent);
                assert!((power.of(x) - exact).abs() <= 1e-15 * exact);
            }
        }
        assert!(Power::new(0.7).of(-1.0).is_nan() && Power::new(0.7).of(f64::NAN).is_nan());
    }
}
