//! Who is near whom: a grid of blocks and cells that fixes the order of everything, and half lists
//! of pairs per block.

mod block;
mod clusters;
mod grid;
mod list;
mod rows;
mod schedule;
mod skin;

pub use block::{BlockList, ROUNDS};
pub use clusters::{Clusters, FOUR, Members};
pub use grid::Grid;
pub use list::PairList;
pub use rows::Rows;
pub use schedule::Schedule;
pub use skin::{SkinModel, margin_and_skin};
