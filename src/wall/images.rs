//! Which images there are: one for each wall, and images of images where walls meet at right angles.
//! An image over a set of walls moves with -v_j if their number is odd and with +v_j if it is even.

use super::field::Field;
use super::geometry::{Shape, Surface, dot};
use crate::domain::PeriodicBox;
use crate::error::{Error, Result};

/// Largest cosine of the angle at which a field wall meets another wall "at right angles".
const RIGHT: f64 = 0.05;

/// Most kinds of images: their labels share a byte of the noise key with the half step.
const MOST: usize = 127;

/// An image over one to three walls that meet at right angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Image {
    /// The walls, ascending.
    pub walls: [u32; 3],
    /// How many of them.
    pub order: usize,
    /// Name in noise keys, from 1 on; direct pairs have 0.
    pub label: u8,
    /// Is there friction with it? Not where the fluid slips on one of the walls.
    pub friction: bool,
    /// Is one of the walls of any shape?
    pub shaped: bool,
}

impl Image {
    /// The walls of the image.
    pub fn walls(&self) -> &[u32] {
        &self.walls[..self.order]
    }

    /// Does it move against the particle, so that there is friction with the walls?
    pub fn odd(&self) -> bool {
        self.order % 2 == 1
    }
}

/// How two walls stand to each other.
enum Relation {
    Corner,
    Apart,
}

fn gap(index: [usize; 2], gap: f64) -> Result<Relation> {
    if gap >= 1.0 - 1e-9 {
        return Ok(Relation::Apart);
    }
    Err(Error::Invalid(format!(
        "`walls` {} and {} must be at least one support apart or meet at right angles, got a gap of {gap:.4} supports",
        index[0], index[1]
    )))
}

fn refuse(index: [usize; 2], what: &str) -> Result<Relation> {
    Err(Error::Invalid(format!(
        "`walls` {} and {} {what}",
        index[0], index[1]
    )))
}

fn planes(index: [usize; 2], one: &Shape, other: &Shape) -> Result<Relation> {
    let (
        Shape::Plane {
            point: p,
            normal: n,
        },
        Shape::Plane {
            point: q,
            normal: m,
        },
    ) = (one, other)
    else {
        return Ok(Relation::Apart);
    };
    let cosine = dot(*n, *m);
    if cosine.abs() < 1e-9 {
        return Ok(Relation::Corner);
    }
    if cosine > 1.0 - 1e-12 {
        return refuse(index, "are planes that face the same way: leave one out");
    }
    if cosine < -1.0 + 1e-12 {
        return gap(index, dot(*n, [0, 1, 2].map(|a| q[a] - p[a])));
    }
    refuse(
        index,
        "are planes at an angle that is not a right one: describe both by one Polyline, LevelSet or Mesh",
    )
}

fn plane_and_round(index: [usize; 2], plane: &Shape, round: &Shape) -> Result<Relation> {
    let (
        Shape::Plane { point, normal },
        Shape::Round {
            centre,
            axis,
            radius,
            side,
        },
    ) = (plane, round)
    else {
        return Ok(Relation::Apart);
    };
    if let Some(axis) = *axis {
        let along = normal[axis].abs();
        if along > 1.0 - 1e-12 {
            return Ok(Relation::Corner);
        }
        if along > 1e-9 {
            return refuse(
                index,
                "are a plane and a cylinder at an angle that is not a right one: describe both by one LevelSet or Mesh",
            );
        }
    }
    if *side < 0.0 {
        return refuse(index, "are a plane and a surface around it: leave one out");
    }
    let height = dot(*normal, [0, 1, 2].map(|a| centre[a] - point[a]));
    gap(index, height - radius)
}

fn rounds(index: [usize; 2], one: &Shape, other: &Shape, cell: &PeriodicBox) -> Result<Relation> {
    let (
        Shape::Round {
            centre: c,
            axis: a,
            radius: r,
            side: s,
        },
        Shape::Round {
            centre: d,
            axis: b,
            radius: q,
            side: t,
        },
    ) = (one, other)
    else {
        return Ok(Relation::Apart);
    };
    let apart: [f64; 3] = std::array::from_fn(|k| {
        if Some(k) == *a || Some(k) == *b {
            0.0
        } else {
            cell.separation(k, c[k] - d[k])
        }
    });
    let distance = dot(apart, apart).sqrt();
    if *s > 0.0 && *t > 0.0 {
        return gap(index, distance - r - q);
    }
    if *s < 0.0 && *t < 0.0 {
        return refuse(index, "both have the fluid inside: leave one out");
    }
    let (outer, inner) = if *s < 0.0 { (r, q) } else { (q, r) };
    gap(index, outer - distance - inner)
}

/// A field wall and another wall: a support apart, or at right angles wherever they are nearer.
fn field_and(
    index: [usize; 2],
    field: &Field,
    other: &Surface,
    cell: &PeriodicBox,
) -> Result<Relation> {
    let room = 2.0 * field.report.spacing[0];
    let mut meet = false;
    for facet in &field.report.surface {
        let inside = |a: usize| {
            cell.periodic[a] || (-room..=cell.limits[a] + room).contains(&facet.position[a])
        };
        let foot = other.foot(facet.position, cell);
        if !(0..3).all(inside) || !(-room..1.0 - 1e-9).contains(&foot.distance) {
            continue;
        }
        if dot(foot.normal, facet.normal).abs() > RIGHT {
            return refuse(
                index,
                &format!(
                    "must be at least one support apart or meet at right angles, got a gap of {:.4} supports at {:?} supports: describe both by one Polyline, LevelSet or Mesh",
                    foot.distance, facet.position
                ),
            );
        }
        meet = true;
    }
    Ok(if meet {
        Relation::Corner
    } else {
        Relation::Apart
    })
}

fn relation(index: [usize; 2], surfaces: &[Surface], cell: &PeriodicBox) -> Result<Relation> {
    let (one, other) = (&surfaces[index[0]].shape, &surfaces[index[1]].shape);
    match (one, other) {
        (Shape::Field { field, .. }, _) => field_and(index, field, &surfaces[index[1]], cell),
        (_, Shape::Field { field, .. }) => field_and(index, field, &surfaces[index[0]], cell),
        (Shape::Plane { .. }, Shape::Plane { .. }) => planes(index, one, other),
        (Shape::Plane { .. }, Shape::Round { .. }) => plane_and_round(index, one, other),
        (Shape::Round { .. }, Shape::Plane { .. }) => plane_and_round(index, other, one),
        _ => rounds(index, one, other, cell),
    }
}

/// A wall in a periodic box must be periodic itself.
fn check_periodicity(index: usize, surface: &Surface, cell: &PeriodicBox) -> Result<()> {
    for a in 0..3 {
        if !cell.periodic[a] {
            continue;
        }
        match surface.shape {
            Shape::Plane { normal, .. } if normal[a].abs() > 1e-12 => {
                return Err(Error::Invalid(format!(
                    "`walls[{index}]` must not cross the periodic axis {}: name the other axes in `periodic`",
                    ["x", "y", "z"][a]
                )));
            }
            Shape::Round {
                axis, radius, side, ..
            } if axis != Some(a) => {
                let left = cell.edges[a] - 2.0 * radius;
                if side < 0.0 && left < 0.0 || side > 0.0 && left < 1.0 - 1e-9 {
                    return Err(Error::Invalid(format!(
                        "`walls[{index}]` must leave {} along the periodic axis {}, got {left:.4} supports",
                        if side > 0.0 {
                            "a gap of at least one support to its own image"
                        } else {
                            "room for itself in the box"
                        },
                        ["x", "y", "z"][a]
                    )));
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// All kinds of images of the walls, or why the walls do not go together.
pub fn images(surfaces: &[Surface], cell: &PeriodicBox) -> Result<Vec<Image>> {
    let n = surfaces.len();
    for (index, surface) in surfaces.iter().enumerate() {
        check_periodicity(index, surface, cell)?;
    }
    let mut corner = vec![false; n * n];
    for i in 0..n {
        for j in i + 1..n {
            corner[i * n + j] = matches!(relation([i, j], surfaces, cell)?, Relation::Corner);
        }
    }
    let mut found: Vec<(usize, [usize; 3])> = (0..n).map(|i| (1, [i, 0, 0])).collect();
    for i in 0..n {
        for j in i + 1..n {
            if !corner[i * n + j] {
                continue;
            }
            found.push((2, [i, j, 0]));
            for k in j + 1..n {
                if corner[i * n + k] && corner[j * n + k] {
                    found.push((3, [i, j, k]));
                }
            }
        }
    }
    if found.len() > MOST {
        return Err(Error::Invalid(format!(
            "`walls` must make at most {MOST} kinds of images, got {}",
            found.len()
        )));
    }
    Ok(found
        .into_iter()
        .enumerate()
        .map(|(k, (order, walls))| Image {
            walls: walls.map(|w| w as u32),
            order,
            label: k as u8 + 1,
            friction: walls[..order].iter().all(|&w| !surfaces[w].slip),
            shaped: walls[..order]
                .iter()
                .any(|&w| matches!(surfaces[w].shape, Shape::Field { .. })),
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(point: [f64; 3], normal: [f64; 3]) -> Surface {
        Surface {
            shape: Shape::Plane { point, normal },
            velocity: [0.0; 3],
            spin: [0.0; 3],
            slip: false,
        }
    }

    fn round(centre: [f64; 3], axis: Option<usize>, radius: f64, side: f64) -> Surface {
        Surface {
            shape: Shape::Round {
                centre,
                axis,
                radius,
                side,
            },
            velocity: [0.0; 3],
            spin: [0.0; 3],
            slip: false,
        }
    }

    fn cell(periodic: [bool; 3]) -> PeriodicBox {
        PeriodicBox::with_walls(&[9.0; 3], 1.0, &periodic).unwrap()
    }

    #[test]
    fn a_closed_box_has_seven_images_at_a_corner() {
        let walls: Vec<Surface> = (0..3)
            .flat_map(|a| {
                let mut n = [0.0; 3];
                n[a] = 1.0;
                let far = n.map(|x| 9.0 * x);
                [plane([0.0; 3], n), plane(far, n.map(|x| -x))]
            })
            .collect();
        let all = images(&walls, &cell([false; 3])).unwrap();
        let count = |order| all.iter().filter(|i| i.order == order).count();
        assert_eq!((count(1), count(2), count(3)), (6, 12, 8));
        assert!(all.iter().all(|i| i.odd() == (i.order != 2)));
        let labels: std::collections::HashSet<u8> = all.iter().map(|i| i.label).collect();
        assert_eq!(labels.len(), 26);
        // A pipe with a lid has its corner, too.
        let pipe = [
            round([4.5; 3], Some(2), 3.0, -1.0),
            plane([0.0; 3], [0.0, 0.0, 1.0]),
        ];
        assert_eq!(images(&pipe, &cell([false; 3])).unwrap().len(), 3);
    }

    #[test]
    fn walls_that_do_not_go_together_are_refused() {
        let text =
            |walls: &[Surface], periodic| images(walls, &cell(periodic)).unwrap_err().to_string();
        let free = [false; 3];
        let floor = plane([0.0; 3], [0.0, 0.0, 1.0]);
        assert!(text(std::slice::from_ref(&floor), [true; 3]).contains("periodic axis z"));
        let lid = plane([0.0, 0.0, 0.7], [0.0, 0.0, -1.0]);
        assert!(text(&[floor.clone(), lid], free).contains("gap of 0.7000"));
        let slope = plane([9.0; 3], [0.0, -0.6, -0.8]);
        assert!(text(&[floor.clone(), slope], free).contains("not a right one"));
        assert!(text(&[floor.clone(), floor.clone()], free).contains("same way"));
        let post = round([4.5, 4.5, 2.5], Some(0), 2.0, 1.0);
        assert!(text(&[floor, post], free).contains("gap of 0.5000"));
        let big = round([4.5; 3], Some(2), 4.2, 1.0);
        assert!(text(&[big], [true; 3]).contains("its own image"));
        let pipe = round([4.5; 3], Some(2), 4.0, -1.0);
        assert!(text(&[pipe.clone(), pipe.clone()], free).contains("both have the fluid inside"));
        let rod = round([4.5, 5.5, 0.0], Some(2), 2.5, 1.0);
        assert!(text(&[pipe.clone(), rod], free).contains("gap of 0.5000"));
        assert!(images(&[pipe, round([4.5; 3], Some(2), 2.0, 1.0)], &cell(free)).is_ok());
    }
}
