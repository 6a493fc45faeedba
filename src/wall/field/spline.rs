//! Tensor-product cubic B-splines on bricks: twice differentiable, so that value and gradient are
//! those of one and the same function. Coefficients come from nodal values by the local
//! quasi-interpolant c = f - f''/6 (second difference), exact for cubics: no system of equations
//! couples the bricks (de Boor, A Practical Guide to Splines, chapter XII).

use super::lattice::{HALO, Lattice, SPAN};

/// Value and slope (per cell) of the four B-splines that reach into a cell.
#[inline]
pub(super) fn basis(t: f64) -> ([f64; 4], [f64; 4]) {
    let s = 1.0 - t;
    let (t2, s2) = (t * t, s * s);
    (
        [
            s2 * s / 6.0,
            (4.0 - 6.0 * t2 + 3.0 * t2 * t) / 6.0,
            (4.0 - 6.0 * s2 + 3.0 * s2 * s) / 6.0,
            t2 * t / 6.0,
        ],
        [
            -0.5 * s2,
            0.5 * t * (3.0 * t - 4.0),
            0.5 * s * (4.0 - 3.0 * s),
            0.5 * t2,
        ],
    )
}

/// Value and gradient in a cell of a brick, of each component.
#[inline]
pub(super) fn evaluate<const N: usize>(
    lattice: &Lattice,
    coefficients: &[[f64; N]],
    cell: [usize; 3],
    fraction: [f64; 3],
) -> ([f64; N], [[f64; 3]; N]) {
    let (mut value, mut gradient) = ([0.0; N], [[0.0; 3]; N]);
    let axes = fraction.map(basis);
    let flat = lattice.dimension == 2;
    let layers = if flat { 1 } else { SPAN };
    for i in 0..4 {
        for j in 0..4 {
            let first = ((cell[0] + i) * SPAN + cell[1] + j) * layers;
            let (mut along, mut slope) = ([0.0; N], [0.0; N]);
            if flat {
                along = coefficients[first];
            } else {
                for k in 0..4 {
                    let c = &coefficients[first + cell[2] + k];
                    for n in 0..N {
                        along[n] += axes[2].0[k] * c[n];
                        slope[n] += axes[2].1[k] * c[n];
                    }
                }
            }
            let (x, dx) = (axes[0].0[i], axes[0].1[i]);
            let (y, dy) = (axes[1].0[j], axes[1].1[j]);
            for n in 0..N {
                value[n] += x * y * along[n];
                gradient[n][0] += dx * y * along[n];
                gradient[n][1] += x * dy * along[n];
                gradient[n][2] += x * y * slope[n];
            }
        }
    }
    for part in &mut gradient {
        for a in 0..3 {
            part[a] /= lattice.step[a];
        }
    }
    (value, gradient)
}

/// Coefficients of a brick from the nodal values of its halo.
pub(super) fn coefficients(lattice: &Lattice, halo: &[f64]) -> Vec<f64> {
    let flat = lattice.dimension == 2;
    let mut extent = [HALO, HALO, if flat { 1 } else { HALO }];
    let mut values = halo.to_vec();
    for axis in 0..lattice.dimension {
        let mut smaller = extent;
        smaller[axis] -= 2;
        let stride = [extent[1] * extent[2], extent[2], 1];
        let mut next = Vec::with_capacity(smaller.iter().product());
        for i in 0..smaller[0] {
            for j in 0..smaller[1] {
                for k in 0..smaller[2] {
                    let at = i * stride[0] + j * stride[1] + k;
                    let [a, b, c] = [0, 1, 2].map(|n| values[at + n * stride[axis]]);
                    next.push((8.0 * b - a - c) / 6.0);
                }
            }
        }
        (values, extent) = (next, smaller);
    }
    values
}
