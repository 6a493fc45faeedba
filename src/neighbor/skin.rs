//! The skin that should cost least: a thick one makes every sweep longer, a thin one makes lists
//! short-lived. The estimate uses the scene's numbers only, never a clock, so it is reproducible.

/// What decides how fast particles move apart.
#[derive(Debug, Clone, Copy)]
pub struct SkinModel {
    /// Time step.
    pub dt: f64,
    /// Root mean square velocity of one component.
    pub speed: f64,
    /// Speed of directed motion, which adds to it.
    pub drift: f64,
    /// Friction time of a particle; infinite without friction.
    pub friction_time: f64,
    /// Number of particles.
    pub n: usize,
    /// D.
    pub dimension: usize,
    /// Cost of a rebuild in steps, over the share of its cost that a pair in the skin causes.
    pub rebuild: f64,
    /// Shortest edge of the box along which blocks are cut [h]; the first axis has long blocks.
    pub edge: f64,
}

impl SkinModel {
    /// Expected largest displacement after time t: Ornstein-Uhlenbeck motion and the largest of n
    /// normal vectors.
    fn reach(&self, t: f64) -> f64 {
        let tau = self.friction_time;
        let x = t / tau;
        let variance = if x < 1e-4 {
            (self.speed * t).powi(2)
        } else {
            2.0 * (self.speed * tau).powi(2) * (x + (-x).exp_m1())
        };
        let largest =
            (2.0 * (self.n as f64 + 1.0).ln()).sqrt() + 0.7 * (self.dimension as f64 - 1.0);
        variance.sqrt() * largest + self.drift * t
    }
}

impl SkinModel {
    /// Measured for Verlet. The splitting keeps an earlier estimate: with another margin its pairs would come
    /// in another order.
    pub fn rebuild_cost(shuffles: bool) -> f64 {
        if shuffles { 1.0 } else { 4.0 }
    }
}

/// The skin [h] with the least estimated cost per step.
pub fn automatic_skin(model: &SkinModel) -> f64 {
    let mut best = (f64::INFINITY, 0.1);
    for k in 1..=60 {
        let skin = 0.01 * f64::from(k);
        let (mut low, mut high) = (1.0, 2000.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if model.reach(middle * model.dt) > 0.5 * skin {
                high = middle;
            } else {
                low = middle;
            }
        }
        // Pairs in the skin cost less than pairs that interact, but not much less.
        let mut cost = (1.0 + skin).powi(model.dimension as i32) + model.rebuild / low;
        if model.edge < 4.0 * (1.0 + skin) {
            // Fewer than four blocks along an axis: no two of one colour, nothing to share out.
            cost *= 1.2;
        }
        if cost < best.0 {
            best = (cost, skin);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fast_particles_get_a_thick_skin_and_slow_ones_a_thin_one() {
        let model = |speed: f64| SkinModel {
            dt: 1.0,
            speed,
            drift: 0.0,
            friction_time: 2.0,
            n: 3375,
            dimension: 3,
            rebuild: 1.5,
            edge: 100.0,
        };
        let skins: Vec<f64> = [1e-6, 1e-4, 1e-3, 1e-2]
            .iter()
            .map(|&speed| automatic_skin(&model(speed)))
            .collect();
        assert!(skins.windows(2).all(|w| w[0] <= w[1]), "{skins:?}");
        assert!(skins[0] <= 0.02 && skins[3] > 0.1);
        let driven = SkinModel {
            drift: 1e-2,
            ..model(1e-6)
        };
        assert!(automatic_skin(&driven) > 2.0 * skins[0]);
        let snug = SkinModel {
            edge: 4.0 * (1.0 + 0.9 * skins[3]),
            ..model(1e-2)
        };
        assert!(4.0 * (1.0 + automatic_skin(&snug)) <= snug.edge);
    }
}
