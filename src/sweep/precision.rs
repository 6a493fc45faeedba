//! In which precision pairs are worked off. State and sums are in double precision always.

use rayon::prelude::*;

use super::clusters::{self, Packed};
use super::rows::MOST;
use super::wide::{Turning, Vector, Wide};
use crate::domain::PeriodicBox;
use crate::kernel::Kernel;
use crate::neighbor::{Grid, PairList};
use crate::real::{ROUNDER, Real};
use crate::state::Particles;

/// What sweeps read of particles in another form; empty where nobody wants it.
#[derive(Debug, Default, Clone)]
pub struct Copies {
    /// Positions axis by axis, and room behind them: what the search for pairs reads.
    columns: [Vec<f32>; 3],
    /// Positions in single precision.
    pub(crate) place: Vec<[f32; 4]>,
    /// Positions and velocities.
    pub(crate) twice: Vec<Twice<f32>>,
    /// Are they those that came with the pressures, for the forces that follow?
    pub(crate) twice_is_present: bool,
    /// The same by cluster.
    pub(crate) packed: Packed,
    /// Words of the particles in a sweep that draws the noise of pairs from them.
    pub(crate) words: Vec<u32>,
}

impl Copies {
    /// Positions axis by axis, as turns of the box; a vector may be read from each.
    pub(crate) fn columns(&mut self, position: &[[f64; 4]], cell: &PeriodicBox) -> &[Vec<f32>; 3] {
        let turns = Turns::of(cell);
        let columns = self.columns.par_iter_mut().enumerate();
        columns.for_each(|(a, column)| {
            column.clear();
            column.reserve_exact(position.len() + MOST);
            column.extend(position.iter().map(|x| turns.of_axis(a, x[a])));
            column.resize(position.len() + MOST, 0.0);
        });
        &self.columns
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let columns = self.columns.iter().map(Vec::capacity).sum::<usize>();
        4 * (columns + self.words.capacity())
            + 16 * self.place.capacity()
            + self.packed.bytes()
            + 32 * self.twice.capacity()
    }
}

/// What lanes want of the position and of the velocity of a particle, side by side in half a cache line:
/// one load instead of two.
#[derive(Debug, Default, Clone, Copy)]
#[repr(C, align(32))]
pub struct Twice<R>(pub(super) [[R; 4]; 2]);

/// Positions and velocities as lanes want them, in one way or the other.
pub struct States<'a, R> {
    /// Each in an array of its own.
    pub place: &'a [[R; 4]],
    /// Velocities.
    pub motion: &'a [[R; 4]],
    /// Side by side.
    pub twice: &'a [Twice<R>],
}

impl<R: Real> States<'_, R> {
    /// The first of those that lie side by side.
    #[inline(always)]
    pub(super) fn first(&self) -> *const [[R; 4]; 2] {
        const { assert!(size_of::<Twice<R>>() == size_of::<[[R; 4]; 2]>()) };
        self.twice.as_ptr().cast()
    }
}

/// Positions as fractions of the box in units of 2^-32, less whole turns.
#[derive(Clone, Copy)]
pub(super) struct Turns {
    scale: [f64; 3],
}

impl Turns {
    pub(super) fn of(cell: &PeriodicBox) -> Self {
        Self {
            scale: cell.inverse.map(|inverse| inverse * TURN),
        }
    }

    /// The same of a record, and what else it carries.
    #[inline(always)]
    pub(super) fn of_record(&self, &[x, y, z, s]: &[f64; 4]) -> [f32; 4] {
        [
            self.of_axis(0, x),
            self.of_axis(1, y),
            self.of_axis(2, z),
            s as f32,
        ]
    }

    /// The same, and the record of its velocity.
    #[inline(always)]
    pub(super) fn with_velocity(&self, position: &[f64; 4], velocity: &[f64; 4]) -> Twice<f32> {
        Twice([self.of_record(position), velocity.map(|v| v as f32)])
    }

    /// Bits of an integer: the lowest ones of a sum with a large number.
    #[inline(always)]
    pub(super) fn of_axis(&self, axis: usize, x: f64) -> f32 {
        f32::from_bits((x * self.scale[axis] + ROUNDER).to_bits() as u32)
    }
}

/// The precision of what happens between two particles.
pub trait Precision: Copy + Send + Sync + 'static {
    /// Name in the registry.
    const NAME: &'static str;
    /// The number in a lane.
    type Real: Real;
    /// Registers of them.
    type Vector<W: Wide>: Vector<Number = Self::Real>;
    /// Length of an axis as `separation` wants it.
    fn edge(edge: f64) -> Self::Real;
    /// Distance along an axis from `second` to the nearest image of `first`.
    fn separation<W: Wide>(
        first: Self::Vector<W>,
        second: Self::Vector<W>,
        edge: Self::Vector<W>,
        inverse: Self::Vector<W>,
        rounder: Self::Vector<W>,
    ) -> Self::Vector<W>;
    /// Eight numbers in a row, in double precision.
    ///
    /// # Safety
    /// There are as many.
    unsafe fn eight<W: Wide>(from: *const Self::Real) -> W;
    /// Positions as the lanes want them, with what else their records carry.
    fn places<'a>(
        position: &'a [[f64; 4]],
        cell: &PeriodicBox,
        copy: &'a mut Vec<[f32; 4]>,
    ) -> &'a [[Self::Real; 4]];
    /// Positions and velocities as lanes want them; they may be `present` in the copy.
    fn states<'a>(
        state: [&'a [[f64; 4]]; 2],
        cell: &PeriodicBox,
        copy: &'a mut Vec<Twice<f32>>,
        present: bool,
    ) -> States<'a, Self::Real>;
    /// Do `states` lie side by side?
    const TOGETHER: bool;
    /// Finds the number densities four by four particles, where that is possible.
    fn densities_of_clusters<K: Kernel, const D: usize>(
        _: &mut Particles,
        _: &Grid,
        _: &mut PairList,
        _: &PeriodicBox,
    ) -> bool {
        false
    }
}

/// Double precision throughout.
#[derive(Debug, Clone, Copy)]
pub struct Double;

/// Pairs in single precision. Positions are fractions of the box in units of 2^-32, whose difference
/// is the way to the nearest image by itself, and is right to 2^-32 of the box.
#[derive(Debug, Clone, Copy)]
pub struct Mixed;

impl Precision for Double {
    const NAME: &'static str = "double";
    type Real = f64;
    type Vector<W: Wide> = W;
    #[inline(always)]
    fn edge(edge: f64) -> f64 {
        edge
    }
    #[inline(always)]
    fn separation<W: Wide>(first: W, second: W, edge: W, inverse: W, rounder: W) -> W {
        let r = first.minus(second);
        let turns = rounder.plus_product(r, inverse).minus(rounder);
        r.less_product(edge, turns)
    }
    #[inline(always)]
    unsafe fn eight<W: Wide>(from: *const f64) -> W {
        // SAFETY: promised by the caller.
        unsafe { W::load(from) }
    }
    fn places<'a>(
        position: &'a [[f64; 4]],
        _: &PeriodicBox,
        _: &'a mut Vec<[f32; 4]>,
    ) -> &'a [[f64; 4]] {
        position
    }
    fn states<'a>(
        [place, motion]: [&'a [[f64; 4]]; 2],
        _: &PeriodicBox,
        _: &'a mut Vec<Twice<f32>>,
        _: bool,
    ) -> States<'a, f64> {
        let twice = &[];
        States {
            place,
            motion,
            twice,
        }
    }
    const TOGETHER: bool = false;
}

impl Precision for Mixed {
    const NAME: &'static str = "mixed";
    type Real = f32;
    type Vector<W: Wide> = W::Single;
    #[inline(always)]
    fn edge(edge: f64) -> f32 {
        (edge / TURN) as f32
    }
    #[inline(always)]
    fn separation<W: Wide>(
        first: W::Single,
        second: W::Single,
        edge: W::Single,
        _: W::Single,
        _: W::Single,
    ) -> W::Single {
        first.turned_from(second).times(edge)
    }
    #[inline(always)]
    unsafe fn eight<W: Wide>(from: *const f32) -> W {
        // SAFETY: promised by the caller.
        unsafe { W::widened(from) }
    }
    fn places<'a>(
        position: &'a [[f64; 4]],
        cell: &PeriodicBox,
        copy: &'a mut Vec<[f32; 4]>,
    ) -> &'a [[f32; 4]] {
        let turns = Turns::of(cell);
        copy.resize(position.len(), [0.0; 4]);
        let pairs = copy.par_iter_mut().zip(position).with_min_len(2048);
        pairs.for_each(|(to, from)| *to = turns.of_record(from));
        copy
    }
    fn states<'a>(
        [position, velocity]: [&'a [[f64; 4]]; 2],
        cell: &PeriodicBox,
        copy: &'a mut Vec<Twice<f32>>,
        present: bool,
    ) -> States<'a, f32> {
        if !present {
            let turns = Turns::of(cell);
            copy.resize(position.len(), Twice::default());
            let all = copy.par_iter_mut().zip(position).zip(velocity);
            all.with_min_len(2048)
                .for_each(|((to, x), v)| *to = turns.with_velocity(x, v));
        }
        let (place, motion) = (&[], &[]);
        States {
            place,
            motion,
            twice: copy,
        }
    }
    const TOGETHER: bool = true;
    fn densities_of_clusters<K: Kernel, const D: usize>(
        particles: &mut Particles,
        grid: &Grid,
        list: &mut PairList,
        cell: &PeriodicBox,
    ) -> bool {
        let possible = D == 3 && list.cutoff <= 1.0 + CLUSTERED;
        if possible {
            clusters::densities::<K>(particles, grid, list, cell);
        }
        possible
    }
}

/// Up to this margin [h] clusters are not too far from each other.
const CLUSTERED: f64 = 0.15;

/// 2^32.
const TURN: f64 = 4_294_967_296.0;
