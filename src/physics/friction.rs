//! Friction between two particles, and the noise that belongs to it. This file is the only place
//! where either is formed, so no integrator can break the balance between them.
//!
//! Deterministic part (a, b from the viscosities, g = F / (d_i d_j), e along r_ij):
//!     f_i = -g (a u + b e (e.u)),   u = v_i - v_j,
//!     a = eta (1 + 2/D) - zeta,     b = (D + 2)(zeta + eta (1 - 2/D)).
//! Noise has covariance 2 kB T g (a I + b e e^T) per unit time. In "central" form a = 0.

use nalgebra::SMatrix;

use crate::real::{Arithmetic, Plain, Real, expm1_negative};

/// Which terms of the friction exist; chosen by type, so absent ones leave no code behind.
pub trait FrictionForm: Copy + Send + Sync + 'static {
    /// Name in the registry.
    const NAME: &'static str;
    /// Is there friction at all?
    const ON: bool;
    /// Does it act along the line of centres only (and so keep angular momentum)?
    const CENTRAL: bool;
}

/// No friction: pure Hamiltonian dynamics.
#[derive(Debug, Clone, Copy)]
pub struct Frictionless;
/// Components along and across the line of centres.
#[derive(Debug, Clone, Copy)]
pub struct General;
/// Along the line of centres only.
#[derive(Debug, Clone, Copy)]
pub struct Central;

impl FrictionForm for Frictionless {
    const NAME: &'static str = "none";
    const ON: bool = false;
    const CENTRAL: bool = false;
}
impl FrictionForm for General {
    const NAME: &'static str = "general";
    const ON: bool = true;
    const CENTRAL: bool = false;
}
impl FrictionForm for Central {
    const NAME: &'static str = "central";
    const ON: bool = true;
    const CENTRAL: bool = true;
}

/// Coefficients of a fluid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairFriction {
    /// a: across the line of centres.
    pub across: f64,
    /// b: along it, on top of a.
    pub along: f64,
    /// kB T.
    pub thermal_energy: f64,
}

/// What the force of an explicit step needs; fixed during a run.
#[derive(Debug, Clone, Copy)]
pub struct Kick {
    drag_across: f64,
    drag_along: f64,
    noise_across: f64,
    noise_along: f64,
    strength: f64,
}

/// What an exact velocity exchange over a time needs; fixed during a run. Unit particle mass.
#[derive(Debug, Clone, Copy)]
pub struct Exchange {
    rate_across: f64,
    rate_along: f64,
    rate_excess: f64,
    variance: f64,
}

/// Directions of the link to an image. The friction of a direct pair, a I + b e e^T, becomes
/// a I + b Ebar, Ebar = e_n e_n^T + e_t e_t^T with the parts of e across and along the wall (at
/// corners: in and out of the space of the normals): the mean of both ends of the link, without
/// which the friction matrix would not be symmetric.
#[derive(Debug, Clone, Copy, Default)]
pub struct LinkAxes {
    /// Unit vector of e_n; 0 where there is none.
    pub normal: [f64; 3],
    /// |e_n|^2.
    pub normal2: f64,
    /// Unit vector of e_t, at right angles to `normal`; 0 where there is none.
    pub tangent: [f64; 3],
    /// |e_t|^2.
    pub tangent2: f64,
}

impl LinkAxes {
    /// base x + n (n.x) (first - base) + t (t.x) (second - base).
    #[inline(always)]
    pub(super) fn apply(&self, base: f64, first: f64, second: f64, x: [f64; 3]) -> [f64; 3] {
        let along_n = (first - base) * dot(self.normal, x);
        let along_t = (second - base) * dot(self.tangent, x);
        std::array::from_fn(|a| base * x[a] + along_n * self.normal[a] + along_t * self.tangent[a])
    }
}

impl PairFriction {
    /// Forces for a step `dt`.
    pub fn kick(&self, dt: f64) -> Kick {
        let strength = (2.0 * self.thermal_energy / dt).sqrt();
        let root_across = self.across.sqrt();
        Kick {
            drag_across: self.across,
            drag_along: self.along,
            noise_across: strength * root_across,
            noise_along: strength * ((self.across + self.along).sqrt() - root_across),
            strength,
        }
    }

    /// Exact exchange over the time `t`; the reduced mass of a pair is 1/2.
    pub fn exchange(&self, t: f64) -> Exchange {
        Exchange {
            rate_across: 2.0 * self.across * t,
            rate_along: 2.0 * (self.across + self.along) * t,
            rate_excess: 2.0 * self.along * t,
            variance: 2.0 * self.thermal_energy,
        }
    }

    /// Friction matrix G of a pair with weight g and unit vector e, as a matrix: for tests.
    pub fn matrix<const D: usize>(&self, g: f64, e: [f64; D]) -> SMatrix<f64, D, D> {
        let e = SMatrix::<f64, D, 1>::from(e);
        (SMatrix::<f64, D, D>::identity() * self.across + e * e.transpose() * self.along) * g
    }
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    dot_with::<Plain, f64>(a, b)
}

#[inline(always)]
fn dot_with<A: Arithmetic, R: Real>(a: [R; 3], b: [R; 3]) -> R {
    A::fused(a[2], b[2], A::fused(a[1], b[1], a[0] * b[0]))
}

impl Kick {
    /// Drag and noise on i from one pair, and `push` r: `inverse_r` = 1/r, r = r_ij, u = v_ij, xi the
    /// pair's variates with the sign of their order (the central form uses `xi[0]`, without a
    /// sign); `root_g` = sqrt(g) counts with noise only.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    pub fn force<F: FrictionForm, A: Arithmetic, R: Real>(
        &self,
        push: R,
        g: R,
        root_g: R,
        inverse_r: R,
        r: [R; 3],
        u: [R; 3],
        xi: [R; 3],
        noise: bool,
    ) -> [R; 3] {
        let inverse_r2 = inverse_r * inverse_r;
        // Along e, less a factor of r^2.
        let drag = R::of(-self.drag_along) * g * dot_with::<A, R>(r, u);
        if F::CENTRAL {
            let mut along = A::fused(drag, inverse_r2, push);
            if noise {
                along = A::fused(R::of(self.noise_along) * root_g * inverse_r, xi[0], along);
            }
            return r.map(|x| along * x);
        }
        let across = R::of(-self.drag_across) * g;
        if !noise {
            let along = A::fused(drag, inverse_r2, push);
            return std::array::from_fn(|a| A::fused(along, r[a], across * u[a]));
        }
        let kick = R::of(self.noise_along) * root_g;
        let along = A::fused(kick, dot_with::<A, R>(r, xi), drag);
        let along = A::fused(along, inverse_r2, push);
        let kick_across = R::of(self.noise_across) * root_g;
        std::array::from_fn(|a| A::fused(along, r[a], A::fused(across, u[a], kick_across * xi[a])))
    }
}

impl Kick {
    /// The same from 1/r^2, where a pair more or less does not count.
    pub fn single_force<F: FrictionForm>(
        &self,
        g: f64,
        inverse_r2: f64,
        r: [f64; 3],
        u: [f64; 3],
        xi: [f64; 3],
        noise: bool,
    ) -> [f64; 3] {
        self.force::<F, Plain, f64>(0.0, g, g.sqrt(), inverse_r2.sqrt(), r, u, xi, noise)
    }

    /// Drag and noise on i from one link: -g (a I + b Ebar) u and its noise; u and the sign of xi as
    /// the parity of the image wants them. `own` for the image of the particle itself, whose friction
    /// with v - v_w is that of two links.
    #[inline]
    pub fn link_force<F: FrictionForm>(
        &self,
        g: f64,
        axes: &LinkAxes,
        u: [f64; 3],
        xi: Option<[f64; 3]>,
        own: bool,
    ) -> [f64; 3] {
        let across = if F::CENTRAL { 0.0 } else { self.drag_across };
        let first = across + self.drag_along * axes.normal2;
        let second = across + self.drag_along * axes.tangent2;
        let g = if own { 2.0 * g } else { g };
        let mut force = axes.apply(across, first, second, u).map(|x| -g * x);
        if let Some(xi) = xi {
            let root = |x: f64| x.max(0.0).sqrt();
            let noise = axes.apply(root(across), root(first), root(second), xi);
            let strength = self.strength * g.sqrt();
            for a in 0..3 {
                force[a] += strength * noise[a];
            }
        }
        force
    }
}

/// Friction of a particle with a wall as a whole: g (a I + b [across (I - n n^T) + along n n^T]).
#[derive(Debug, Clone, Copy)]
pub struct WallGrip {
    /// g.
    pub weight: f64,
    /// Unit normal n.
    pub normal: [f64; 3],
    /// Share of b in all directions along the wall.
    pub across: f64,
    /// Share of b along the normal.
    pub along: f64,
}

impl WallGrip {
    /// first x + (second - first) n (n.x)
    #[inline]
    fn apply(&self, first: f64, second: f64, x: [f64; 3]) -> [f64; 3] {
        let along = (second - first) * dot(self.normal, x);
        std::array::from_fn(|a| first * x[a] + along * self.normal[a])
    }
}

impl Kick {
    /// Drag and noise on a particle from a wall as a whole; u = v - v_w.
    pub fn wall_force(
        &self,
        grip: &WallGrip,
        u: [f64; 3],
        xi: Option<[f64; 3]>,
        central: bool,
    ) -> [f64; 3] {
        let across = if central { 0.0 } else { self.drag_across };
        let rates =
            [grip.across, grip.along].map(|share| (across + self.drag_along * share).max(0.0));
        let mut force = grip.apply(rates[0], rates[1], u).map(|x| -grip.weight * x);
        if let Some(xi) = xi {
            let noise = grip.apply(rates[0].sqrt(), rates[1].sqrt(), xi);
            let strength = self.strength * grip.weight.sqrt();
            for a in 0..3 {
                force[a] += strength * noise[a];
            }
        }
        force
    }
}

impl Exchange {
    /// Exact change of u = v - v_w by the friction with a wall as a whole.
    pub fn wall_change(
        &self,
        grip: &WallGrip,
        u: [f64; 3],
        xi: Option<[f64; 3]>,
        central: bool,
    ) -> [f64; 3] {
        // Rates are those of a pair, of which each end has half.
        let across = if central { 0.0 } else { self.rate_across };
        let decay = [grip.across, grip.along].map(|share| {
            let rate = 0.5 * grip.weight * (across + self.rate_excess * share);
            expm1_negative(rate.max(0.0))
        });
        let mut change = grip.apply(decay[0], decay[1], u);
        if let Some(xi) = xi {
            let [first, second] = decay.map(|m| (-m * (2.0 + m) * 0.5 * self.variance).sqrt());
            let noise = grip.apply(first, second, xi);
            for a in 0..3 {
                change[a] += noise[a];
            }
        }
        change
    }

    /// Exact change of the velocity of a particle by its friction with something that does not feel
    /// it: u and r as for a pair.
    pub fn one_sided<F: FrictionForm>(
        &self,
        g: f64,
        inverse_r2: f64,
        r: [f64; 3],
        u: [f64; 3],
        xi: [f64; 3],
        noise: bool,
    ) -> [f64; 3] {
        // Half the rate of a pair, whose u decays from both ends; and half its variance.
        let decays = self.decays::<F, Plain, f64>(0.5 * g);
        let terms = self.terms::<F, Plain, f64>(decays, inverse_r2.sqrt(), r, xi, noise);
        let along = terms.half_along * dot(r, u);
        let root = std::f64::consts::SQRT_2;
        std::array::from_fn(|a| {
            let kick = if F::CENTRAL {
                terms.noise[0] * r[a]
            } else {
                terms.noise[a]
            };
            2.0 * (terms.half_across * u[a] + along * r[a]) + root * kick
        })
    }
}

/// The exact change of the relative velocity u of one link: decay and noise.
#[derive(Debug, Clone, Copy)]
pub struct LinkTerms<'a> {
    axes: &'a LinkAxes,
    decay: [f64; 3],
    noise: [f64; 3],
}

impl LinkTerms<'_> {
    /// du, where u = v_i + v_j - 2 v_w (v_i - v_j for images that move with +v_j) is shared equally
    /// by i and j; for an own image u = v_i - v_w.
    #[inline]
    pub fn change(&self, u: [f64; 3]) -> [f64; 3] {
        let [base, first, second] = self.decay;
        let decay = self.axes.apply(base, first, second, u);
        [0, 1, 2].map(|a| decay[a] + self.noise[a])
    }
}

impl Exchange {
    /// Exact solution of the Ornstein-Uhlenbeck process of one link.
    #[inline]
    pub fn link_terms<'a, F: FrictionForm>(
        &self,
        g: f64,
        axes: &'a LinkAxes,
        xi: Option<[f64; 3]>,
        own: bool,
    ) -> LinkTerms<'a> {
        let across = if F::CENTRAL { 0.0 } else { self.rate_across };
        let decay = [
            across,
            across + self.rate_excess * axes.normal2,
            across + self.rate_excess * axes.tangent2,
        ]
        .map(|rate| expm1_negative((rate * g).max(0.0)));
        let mut noise = [0.0; 3];
        if let Some(xi) = xi {
            // u of an own image is one velocity, not the sum of two.
            let variance = if own {
                0.5 * self.variance
            } else {
                self.variance
            };
            let [base, first, second] = decay.map(|m| (-m * (2.0 + m) * variance).sqrt());
            noise = axes.apply(base, first, second, xi);
        }
        LinkTerms { axes, decay, noise }
    }
}

/// The change of v_i (and minus that of v_j) in one exchange, dv = half_across u + half_along r
/// (r.u) + noise: everything that does not depend on the velocities.
#[derive(Debug, Clone, Copy)]
pub struct ExchangeTerms<R> {
    /// Factor of u.
    pub half_across: R,
    /// Factor of r (r.u).
    pub half_along: R,
    /// The random part; the central form uses the first component, times r.
    pub noise: [R; 3],
}

impl Exchange {
    /// What u loses of itself across and along the line of centres: E - 1 with E = exp(-rate t).
    #[inline(always)]
    pub fn decays<F: FrictionForm, A: Arithmetic, R: Real>(&self, g: R) -> [R; 2] {
        let along = (R::of(self.rate_along) * g).expm1_negative::<A>();
        if F::CENTRAL {
            return [R::ZERO, along];
        }
        let across = (R::of(self.rate_across) * g).expm1_negative::<A>();
        [across, along]
    }

    /// Exact solution of the pair's Ornstein-Uhlenbeck process (Shardlow 2003 split it off; the
    /// exact form is in Serrano et al., J. Phys. A 39 (2006) 1523), from [`Self::decays`].
    #[inline(always)]
    pub fn terms<F: FrictionForm, A: Arithmetic, R: Real>(
        &self,
        [across, along]: [R; 2],
        inverse_r: R,
        r: [R; 3],
        xi: [R; 3],
        noise: bool,
    ) -> ExchangeTerms<R> {
        let half = R::of(0.5);
        let inverse_r2 = inverse_r * inverse_r;
        // 1 - E^2 with E = 1 + m: no cancellation where the step is short.
        let spread = |m: R| (-m * (R::of(2.0) + m) * R::of(self.variance)).sqrt();
        if F::CENTRAL {
            let kick = if noise {
                half * spread(along) * inverse_r * xi[0]
            } else {
                R::ZERO
            };
            return ExchangeTerms {
                half_across: R::ZERO,
                half_along: half * along * inverse_r2,
                noise: [kick, R::ZERO, R::ZERO],
            };
        }
        let mut kick = [R::ZERO; 3];
        if noise {
            let spread_across = half * spread(across);
            let excess =
                (half * spread(along) - spread_across) * inverse_r2 * dot_with::<A, R>(r, xi);
            kick = std::array::from_fn(|a| A::fused(spread_across, xi[a], excess * r[a]));
        }
        ExchangeTerms {
            half_across: half * across,
            half_along: half * (along - across) * inverse_r2,
            noise: kick,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix3, Vector3};

    fn unit(index: usize) -> [f64; 3] {
        std::array::from_fn(|a| if a == index { 1.0 } else { 0.0 })
    }

    fn separation(dimension: usize) -> ([f64; 3], f64) {
        let r = [0.3, -0.5, if dimension == 3 { 0.2 } else { 0.0 }];
        (r, 1.0 / dot(r, r))
    }

    fn columns<F: FrictionForm>(
        friction: &PairFriction,
        dt: f64,
        dimension: usize,
    ) -> Matrix3<f64> {
        let (r, inverse_r2) = separation(dimension);
        let mut operator = Matrix3::zeros();
        let count = if F::CENTRAL { 1 } else { dimension };
        for k in 0..count {
            let f =
                friction
                    .kick(dt)
                    .single_force::<F>(0.7, inverse_r2, r, [0.0; 3], unit(k), true);
            operator.set_column(k, &Vector3::from(f));
        }
        operator
    }

    /// B B^T dt = 2 kB T Gamma, without sampling.
    #[test]
    fn noise_balances_drag_exactly() {
        for (dimension, eta, zeta) in [(2, 1.3, 0.0), (2, 1.3, 0.9), (3, 2.1, 0.0), (3, 2.1, 3.5)] {
            let d = dimension as f64;
            let friction = PairFriction {
                across: eta * (1.0 + 2.0 / d) - zeta,
                along: (d + 2.0) * (zeta + eta * (1.0 - 2.0 / d)),
                thermal_energy: 0.6,
            };
            let dt = 0.013;
            let b = columns::<General>(&friction, dt, dimension);
            let covariance = b * b.transpose() * dt;
            let (r, inverse_r2) = separation(dimension);
            let e = r.map(|x| x * inverse_r2.sqrt());
            if dimension == 3 {
                let gamma = friction.matrix::<3>(0.7, e) * 1.2;
                assert!((covariance - gamma).abs().max() < 1e-13 * gamma.abs().max());
            } else {
                let gamma = friction.matrix::<2>(0.7, [e[0], e[1]]) * 1.2;
                let plane: Matrix2<f64> = covariance.fixed_view::<2, 2>(0, 0).into();
                assert!((plane - gamma).abs().max() < 1e-13 * gamma.abs().max());
            }
        }
        let central = PairFriction {
            across: 0.0,
            along: 10.0,
            thermal_energy: 0.6,
        };
        let b = columns::<Central>(&central, 0.02, 3);
        let (r, inverse_r2) = separation(3);
        let gamma = central.matrix::<3>(0.7, r.map(|x| x * inverse_r2.sqrt())) * 1.2;
        assert!((b * b.transpose() * 0.02 - gamma).abs().max() < 1e-13 * gamma.abs().max());
    }

    /// An exchange keeps the Maxwell distribution at any step: M M^T s2 + N N^T = s2, and for short
    /// times it is the explicit force.
    #[test]
    fn exchange_keeps_the_maxwell_distribution() {
        let friction = PairFriction {
            across: 1.4,
            along: 2.2,
            thermal_energy: 0.6,
        };
        let (r, inverse_r2) = separation(3);
        let s2 = 2.0 * friction.thermal_energy;
        for t in [1e-9, 1e-3, 0.5, 30.0] {
            let exchange = friction.exchange(t);
            let mut decay = Matrix3::identity();
            let mut noise = Matrix3::zeros();
            for k in 0..3 {
                let decays = exchange.decays::<General, Plain, f64>(0.7);
                let inverse_r = inverse_r2.sqrt();
                let terms =
                    exchange.terms::<General, Plain, f64>(decays, inverse_r, r, unit(k), true);
                let ru = dot(r, unit(k));
                for a in 0..3 {
                    decay[(a, k)] +=
                        2.0 * (terms.half_across * unit(k)[a] + terms.half_along * ru * r[a]);
                    noise[(a, k)] = 2.0 * terms.noise[a];
                }
            }
            let balance = decay * decay.transpose() * s2 + noise * noise.transpose();
            let excess: Matrix3<f64> = balance - Matrix3::identity() * s2;
            assert!(excess.abs().max() < 1e-13);
            if t < 1e-6 {
                let gamma = friction.matrix::<3>(0.7, r.map(|x| x * inverse_r2.sqrt()));
                let rate = (Matrix3::identity() - decay) / (2.0 * t);
                assert!((rate - gamma).abs().max() < 1e-6);
            }
        }
    }

    /// The links' noise balances their drag, own images included, and the exact process keeps the
    /// Maxwell distribution of u: of variance 2 for a link, 1 for an own image.
    #[test]
    fn links_to_images_are_in_balance() {
        let friction = PairFriction {
            across: 1.4,
            along: 2.2,
            thermal_energy: 0.6,
        };
        let axes = LinkAxes {
            normal: [0.6, 0.0, 0.8],
            normal2: 0.3,
            tangent: [0.0, 1.0, 0.0],
            tangent2: 0.7,
        };
        let (g, dt) = (0.7, 0.013);
        for own in [false, true] {
            let (mut noise, mut drag) = (Matrix3::zeros(), Matrix3::zeros());
            for k in 0..3 {
                let kick = friction.kick(dt);
                let f = kick.link_force::<General>(g, &axes, [0.0; 3], Some(unit(k)), own);
                noise.set_column(k, &Vector3::from(f));
                let f = kick.link_force::<General>(g, &axes, unit(k), None, own);
                drag.set_column(k, &Vector3::from(f));
            }
            let covariance = noise * noise.transpose() * dt;
            assert!((covariance + drag * 1.2).abs().max() < 1e-14);
            assert!((drag - drag.transpose()).abs().max() < 1e-15);
            let s2 = if own { 0.6 } else { 1.2 };
            for t in [1e-9, 1e-3, 0.5, 30.0] {
                let exchange = friction.exchange(t);
                let (mut decay, mut kicks) = (Matrix3::identity(), Matrix3::zeros());
                for k in 0..3 {
                    let terms = exchange.link_terms::<General>(g, &axes, None, own);
                    for (a, x) in terms.change(unit(k)).into_iter().enumerate() {
                        decay[(a, k)] += x;
                    }
                    let terms = exchange.link_terms::<General>(g, &axes, Some(unit(k)), own);
                    kicks.set_column(k, &Vector3::from(terms.change([0.0; 3])));
                }
                let excess: Matrix3<f64> = decay * decay.transpose() * s2
                    + kicks * kicks.transpose()
                    - Matrix3::identity() * s2;
                assert!(excess.abs().max() < 1e-14);
                if t < 1e-6 {
                    // du/dt = 2 f for a link (both ends move), f for an own image (f counts twice).
                    let rate = (decay - Matrix3::identity()) / t;
                    let force = drag * if own { 1.0 } else { 2.0 };
                    assert!((rate - force).abs().max() < 1e-6);
                }
            }
        }
        let zero = LinkAxes::default();
        let f = friction
            .kick(dt)
            .link_force::<Central>(g, &zero, [1.0; 3], Some([1.0; 3]), true);
        assert_eq!(f, [0.0; 3]);
    }

    /// Friction with a wall as a whole, and with something that does not feel it: noise balances drag,
    /// and the exact change keeps the Maxwell distribution and is the force where steps are short.
    #[test]
    fn friction_with_walls_is_in_balance() {
        let friction = PairFriction {
            across: 1.4,
            along: 2.2,
            thermal_energy: 0.6,
        };
        let grip = WallGrip {
            weight: 0.7,
            normal: [0.6, 0.0, 0.8],
            across: 0.3,
            along: 0.55,
        };
        let (r, inverse_r2) = separation(3);
        let dt = 0.013;
        let kick = friction.kick(dt);
        let force = |whole: bool, u: [f64; 3], xi: [f64; 3]| {
            if whole {
                kick.wall_force(&grip, u, Some(xi), false)
            } else {
                kick.single_force::<General>(0.7, inverse_r2, r, u, xi, true)
            }
        };
        let change = |whole: bool, t: f64, u: [f64; 3], xi: [f64; 3]| {
            let exchange = friction.exchange(t);
            if whole {
                exchange.wall_change(&grip, u, Some(xi), false)
            } else {
                exchange.one_sided::<General>(0.7, inverse_r2, r, u, xi, true)
            }
        };
        let matrix = |column: &dyn Fn(usize) -> [f64; 3]| {
            Matrix3::from_columns(&[0, 1, 2].map(|k| Vector3::from(column(k))))
        };
        let none = [0.0; 3];
        for whole in [false, true] {
            let drag = matrix(&|k| force(whole, unit(k), none));
            let noise = matrix(&|k| force(whole, none, unit(k)));
            let excess: Matrix3<f64> = noise * noise.transpose() * dt + drag * 1.2;
            assert!(excess.abs().max() < 1e-14);
            for t in [1e-9, 1e-3, 0.5, 30.0] {
                let decay = Matrix3::identity() + matrix(&|k| change(whole, t, unit(k), none));
                let kicks = matrix(&|k| change(whole, t, none, unit(k)));
                let excess: Matrix3<f64> = decay * decay.transpose() * 0.6
                    + kicks * kicks.transpose()
                    - Matrix3::identity() * 0.6;
                assert!(excess.abs().max() < 1e-14);
                if t < 1e-6 {
                    let rate: Matrix3<f64> = (decay - Matrix3::identity()) / t;
                    assert!((rate - drag).abs().max() < 1e-6);
                }
            }
        }
        // Central friction is the part along e alone.
        let f = kick.wall_force(&grip, [1.0, 0.0, 0.0], None, true);
        let f_n = 0.7 * 2.2 * 0.55 * 0.36 + 0.7 * 2.2 * 0.3 * 0.64;
        assert!((f[0] + f_n).abs() < 1e-14);
    }
}
