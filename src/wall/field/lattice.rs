//! The regular grid under a field wall: where its nodes lie, and which bricks of it are kept.

use crate::domain::PeriodicBox;

/// Cells along each edge of a brick.
pub(super) const BRICK: usize = 8;
/// B-spline coefficients along each edge of a brick: a cubic spline reaches one node further back
/// and two further on.
pub(super) const SPAN: usize = BRICK + 3;
/// Nodal values along each edge from which those coefficients follow.
pub(super) const HALO: usize = SPAN + 2;
/// Room beyond the walls of an axis that is not periodic, in supports: images of images reach no
/// further than a support.
const BEYOND: f64 = 1.25;

/// Index of a node; along periodic axes modulo the number of cells.
pub(super) type Node = [i64; 3];

/// A grid of cells; in two dimensions it has one layer.
#[derive(Debug, Clone)]
pub(super) struct Lattice {
    pub dimension: usize,
    pub cells: [usize; 3],
    pub origin: [f64; 3],
    pub step: [f64; 3],
    pub periodic: [bool; 3],
    pub bricks: [usize; 3],
}

/// Where a position is: brick, cell within the brick, and fraction of the cell.
pub(super) struct Place {
    pub brick: usize,
    pub cell: [usize; 3],
    pub fraction: [f64; 3],
}

impl Lattice {
    /// Cells of about `spacing` [h], whole bricks of them along each axis.
    pub fn new(cell: &PeriodicBox, dimension: usize, spacing: f64) -> Self {
        let (mut cells, mut origin, mut step) = ([1; 3], [0.0; 3], [1.0; 3]);
        let mut bricks = [1; 3];
        for a in 0..dimension {
            let (start, length) = if cell.periodic[a] {
                (0.0, cell.edges[a])
            } else {
                (-BEYOND, cell.limits[a] + 2.0 * BEYOND)
            };
            bricks[a] = (length / (spacing * BRICK as f64) - 1e-9).ceil().max(1.0) as usize;
            cells[a] = bricks[a] * BRICK;
            (origin[a], step[a]) = (start, length / cells[a] as f64);
        }
        Self {
            dimension,
            cells,
            origin,
            step,
            periodic: cell.periodic,
            bricks,
        }
    }

    /// Positions along the third axis have no cells in two dimensions.
    fn extent(&self, axis: usize, count: usize) -> usize {
        if axis < self.dimension { count } else { 1 }
    }

    pub fn brick_count(&self) -> usize {
        self.bricks.iter().product()
    }

    /// Coordinates of a brick of a number.
    pub fn brick(&self, index: usize) -> [usize; 3] {
        let [_, y, z] = self.bricks;
        [index / (y * z), index / z % y, index % z]
    }

    pub fn brick_index(&self, brick: [usize; 3]) -> usize {
        (brick[0] * self.bricks[1] + brick[1]) * self.bricks[2] + brick[2]
    }

    pub fn volume(&self) -> f64 {
        self.step[..self.dimension].iter().product()
    }

    pub fn largest_step(&self) -> f64 {
        self.step[..self.dimension]
            .iter()
            .copied()
            .fold(0.0, f64::max)
    }

    /// Length of the axis in supports.
    pub fn length(&self, axis: usize) -> f64 {
        self.cells[axis] as f64 * self.step[axis]
    }

    /// Position of a point of a cell, in units of cells from the origin.
    pub fn position(&self, at: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| {
            if a < self.dimension {
                self.origin[a] + self.step[a] * at[a]
            } else {
                0.0
            }
        })
    }

    pub fn node_position(&self, node: Node) -> [f64; 3] {
        self.position(node.map(|x| x as f64))
    }

    pub fn centre(&self, brick: usize) -> [f64; 3] {
        self.position(
            self.brick(brick)
                .map(|b| (b * BRICK) as f64 + 0.5 * BRICK as f64),
        )
    }

    /// Half of the diagonal of a brick.
    pub fn half_diagonal(&self) -> f64 {
        let squares = self.step[..self.dimension].iter().map(|s| s * s);
        0.5 * BRICK as f64 * squares.sum::<f64>().sqrt()
    }

    /// The node that stands for it: inside the box along periodic axes.
    pub fn wrapped(&self, node: Node) -> Node {
        std::array::from_fn(|a| {
            if a < self.dimension && self.periodic[a] {
                node[a].rem_euclid(self.cells[a] as i64)
            } else {
                node[a]
            }
        })
    }

    /// Number of entries of an array of `edge` along each axis.
    pub fn block(&self, edge: usize) -> usize {
        edge.pow(self.dimension as u32)
    }

    /// Indices of such an array, in its order.
    pub fn indices(&self, edge: usize) -> impl Iterator<Item = [usize; 3]> + use<> {
        let layers = self.extent(2, edge);
        (0..edge * edge * layers).map(move |k| [k / (edge * layers), k / layers % edge, k % layers])
    }

    /// Nodes whose values the coefficients of a brick follow from.
    pub fn halo(&self, brick: usize) -> impl Iterator<Item = Node> + use<'_> {
        let corner = self.brick(brick);
        self.indices(HALO).map(move |k| {
            let node = std::array::from_fn(|a| {
                if a < self.dimension {
                    (corner[a] * BRICK + k[a]) as i64 - 2
                } else {
                    0
                }
            });
            self.wrapped(node)
        })
    }

    /// Brick and cell of a position; positions beyond the grid count as those at its rim.
    pub fn place(&self, position: [f64; 3]) -> Place {
        let (mut brick, mut cell, mut fraction) = ([0; 3], [0; 3], [0.0; 3]);
        for a in 0..self.dimension {
            let n = self.cells[a] as f64;
            let mut u = (position[a] - self.origin[a]) / self.step[a];
            if self.periodic[a] {
                u -= (u / n).floor() * n;
            }
            let u = u.clamp(0.0, n);
            let index = (u as usize).min(self.cells[a] - 1);
            (brick[a], cell[a]) = (index / BRICK, index % BRICK);
            fraction[a] = u - index as f64;
        }
        Place {
            brick: self.brick_index(brick),
            cell,
            fraction,
        }
    }

    /// Linear interpolation between values at the centres of bricks, and its gradient.
    pub fn between_centres(&self, values: &[f64], position: [f64; 3]) -> (f64, [f64; 3]) {
        let (mut low, mut high, mut part) = ([0; 3], [0; 3], [0.0; 3]);
        for a in 0..self.dimension {
            let n = self.bricks[a] as f64;
            let u = (position[a] - self.origin[a]) / (self.step[a] * BRICK as f64) - 0.5;
            let u = if self.periodic[a] {
                u - (u / n).floor() * n
            } else {
                u.clamp(0.0, n - 1.0)
            };
            low[a] = (u as usize).min(self.bricks[a] - 1);
            part[a] = u - low[a] as f64;
            high[a] = if self.periodic[a] {
                (low[a] + 1) % self.bricks[a]
            } else {
                (low[a] + 1).min(self.bricks[a] - 1)
            };
        }
        let (mut value, mut gradient) = (0.0, [0.0; 3]);
        for corner in 0..1usize << self.dimension {
            let up = |a: usize| corner >> a & 1 == 1;
            let brick = std::array::from_fn(|a| if up(a) { high[a] } else { low[a] });
            let v = values[self.brick_index(brick)];
            let share = |a: usize| if up(a) { part[a] } else { 1.0 - part[a] };
            value += v * (0..self.dimension).map(share).product::<f64>();
            for a in 0..self.dimension {
                let others = (0..self.dimension).filter(|&b| b != a).map(share);
                let sign = if up(a) { 1.0 } else { -1.0 };
                let width = self.step[a] * BRICK as f64;
                gradient[a] += v * sign * others.product::<f64>() / width;
            }
        }
        (value, gradient)
    }
}
