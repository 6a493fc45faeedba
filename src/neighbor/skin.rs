//! Margin and skin that should cost least. Lists hold all pairs within support and margin, and sweeps work
//! on those within support and skin, which are found among them now and then: a thick skin makes every sweep
//! longer, a thin one has to be found often; a wide margin makes that take longer, a narrow one has the
//! lists built often. The estimate uses the scene's numbers only, never a clock, so it is reproducible.

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
    /// Does a sweep go through the pairs in shuffled order?
    pub shuffles: bool,
    /// Shortest edge of the box along which blocks are cut [h]; the first axis has long blocks.
    pub edge: f64,
}

impl SkinModel {
    /// Expected largest of n normal vectors, over the root mean square of their components.
    fn largest(&self) -> f64 {
        (2.0 * (self.n as f64 + 1.0).ln()).sqrt() + 0.7 * (self.dimension as f64 - 1.0)
    }

    /// Expected largest displacement after time t: Ornstein-Uhlenbeck motion.
    fn reach(&self, t: f64) -> f64 {
        let tau = self.friction_time;
        let x = t / tau;
        let variance = if x < 1e-4 {
            (self.speed * t).powi(2)
        } else {
            2.0 * (self.speed * tau).powi(2) * (x + (-x).exp_m1())
        };
        variance.sqrt() * self.largest() + self.drift * t
    }

    /// Steps from one renewal of the grid to the next.
    fn lifetime(&self, margin: f64) -> f64 {
        let (mut low, mut high) = (1.0, 2000.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.reach(middle * self.dt) > 0.5 * margin {
                high = middle;
            } else {
                low = middle;
            }
        }
        low
    }

    /// Cost of sweeps over the pairs within a width, over those of the pairs within the support.
    fn pairs(&self, width: f64) -> f64 {
        (1.0 + width).powi(self.dimension as i32)
    }

    /// The skin that costs least for a margin, and what it costs.
    fn best_skin(&self, margin: f64) -> (f64, f64) {
        // What is done to know how far particles have gone counts the fastest ones of each step.
        let step = (self.speed * self.largest() + self.drift) * self.dt;
        let mut best = (margin, self.pairs(margin));
        if step <= 0.0 {
            return best;
        }
        for k in 1..SKINS {
            let skin = margin * f64::from(k) / f64::from(SKINS);
            let lifetime = 1.0 + 0.5 * skin / step;
            let cost = self.pairs(skin) + PRUNE * self.pairs(margin) / lifetime;
            if cost < best.1 {
                best = (skin, cost);
            }
        }
        best
    }
}

/// What it takes to build the lists, in steps. Measured.
const REBUILD: f64 = 1.0;
/// And to find which pairs of a list without margin are within the skin. Measured.
const PRUNE: f64 = 0.2;
/// Skins that are tried for a margin.
const SKINS: u32 = 40;

/// Margin and skin [h] with the least estimated cost per step.
pub fn margin_and_skin(model: &SkinModel) -> (f64, f64) {
    let (mut margin, mut least) = (0.1, f64::INFINITY);
    for k in 1..=60 {
        let width = 0.01 * f64::from(k);
        // The splitting goes through all pairs of the list: it needs their order.
        let pairs = if model.shuffles {
            model.pairs(width)
        } else {
            model.best_skin(width).1
        };
        let mut cost = pairs + REBUILD / model.lifetime(width);
        if model.edge < 4.0 * (1.0 + width) {
            // Fewer than four blocks along an axis: no two of one colour, nothing to share out.
            cost *= 1.2;
        }
        if cost < least {
            (margin, least) = (width, cost);
        }
    }
    (margin, model.best_skin(margin).0)
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
            shuffles: false,
            edge: 100.0,
        };
        let widths: Vec<(f64, f64)> = [1e-6, 1e-4, 1e-3, 1e-2]
            .iter()
            .map(|&speed| margin_and_skin(&model(speed)))
            .collect();
        assert!(widths.windows(2).all(|w| w[0].0 <= w[1].0), "{widths:?}");
        assert!(
            widths[..3].windows(2).all(|w| w[0].1 <= w[1].1),
            "{widths:?}"
        );
        assert!(widths.iter().all(|w| 0.0 < w.1 && w.1 <= w.0));
        assert!(widths[0].0 <= 0.02 && widths[3].0 > 0.1);
        let driven = SkinModel {
            drift: 1e-2,
            ..model(1e-6)
        };
        assert!(margin_and_skin(&driven).0 > 2.0 * widths[0].0);
        let snug = SkinModel {
            edge: 4.0 * (1.0 + 0.9 * widths[3].0),
            ..model(1e-2)
        };
        assert!(4.0 * (1.0 + margin_and_skin(&snug).0) <= snug.edge);
        let still = SkinModel {
            speed: 0.0,
            ..model(0.0)
        };
        let (margin, skin) = margin_and_skin(&still);
        assert_eq!(margin, skin);
        // Where all pairs of the list are worked on anyway a margin costs more.
        let shuffled = SkinModel {
            shuffles: true,
            ..model(1e-3)
        };
        let (margin, skin) = margin_and_skin(&shuffled);
        assert!(margin < widths[2].0 && skin < margin);
    }
}
