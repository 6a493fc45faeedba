//! A triangulated surface: exact distances to its triangles, signed by the pseudo-normals of its
//! faces, edges and vertices (Baerentzen and Aanaes, IEEE Trans. Vis. Comput. Graph. 11 (2005) 243).

use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::{PointQuery, intersection_test};
use parry3d_f64::shape::{TriMesh, TriMeshFlags};
use rayon::prelude::*;

use crate::error::{Error, Result};

/// Points per task.
const TASK: usize = 256;

/// A surface whose triangles, seen from outside, go round counter-clockwise.
#[derive(Debug)]
pub struct Solid {
    mesh: TriMesh,
}

impl Solid {
    /// From points and the points of each triangle, numbers that must be in range.
    pub fn new(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Self> {
        let count = points.len() as u32;
        if let Some(bad) = triangles.iter().flatten().find(|&&k| k >= count) {
            return Err(Error::Invalid(format!(
                "`triangles` must hold numbers of the {count} points, got {bad}"
            )));
        }
        let vertices = points
            .iter()
            .map(|&[x, y, z]| Vector::new(x, y, z))
            .collect();
        TriMesh::with_flags(vertices, triangles.to_vec(), TriMeshFlags::ORIENTED)
            .map(|mesh| Self { mesh })
            .map_err(|error| Error::Invalid(format!("`triangles` make no surface: {error}")))
    }

    /// Signed distances, > 0 outside.
    pub fn distances(&self, points: &[[f64; 3]]) -> Vec<f64> {
        let distance = |&[x, y, z]: &[f64; 3]| {
            let point = Vector::new(x, y, z);
            let found = self.mesh.project_local_point(point, false);
            let length = (point - found.point).length();
            if found.is_inside { -length } else { length }
        };
        points.par_iter().with_min_len(TASK).map(distance).collect()
    }

    /// The first two triangles without a common point that cross or touch.
    pub fn crossing(&self) -> Option<[u32; 2]> {
        let indices = self.mesh.indices();
        let here = Pose::IDENTITY;
        (0..indices.len() as u32)
            .into_par_iter()
            .find_map_first(|k| {
                let triangle = self.mesh.triangle(k);
                let own = indices[k as usize];
                let bounds = triangle.local_aabb();
                let near = self.mesh.bvh().intersect_aabb(&bounds);
                let crosses = |&other: &u32| {
                    other > k
                        && !indices[other as usize].iter().any(|p| own.contains(p))
                        && intersection_test(&here, &triangle, &here, &self.mesh.triangle(other))
                            .is_ok_and(|found| found.intersecting)
                };
                near.filter(crosses).min().map(|other| [k, other])
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit cube from two triangles a face.
    fn cube() -> Solid {
        let points: Vec<[f64; 3]> = (0..8)
            .map(|k| [k >> 2 & 1, k >> 1 & 1, k & 1].map(f64::from))
            .collect();
        let faces = [
            [0, 1, 3, 2],
            [4, 6, 7, 5],
            [0, 4, 5, 1],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 5, 7, 3],
        ];
        let triangles: Vec<[u32; 3]> = faces
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
        Solid::new(&points, &triangles).unwrap()
    }

    #[test]
    fn distances_to_a_cube_are_exact_at_faces_edges_and_corners() {
        let solid = cube();
        let far = [
            ([0.5, 0.5, 0.9], -0.1),
            ([0.4, 0.3, 1.5], 0.5),
            ([-0.3, 0.5, -0.4], 0.5),
            ([1.2, 1.3, 1.6], 0.7),
            ([1e-9, 0.5, 0.5], -1e-9),
        ];
        let points: Vec<[f64; 3]> = far.iter().map(|f| f.0).collect();
        for (got, (place, expected)) in solid.distances(&points).iter().zip(far) {
            assert!(
                (got - expected).abs() < 1e-12,
                "{place:?}: {got} {expected}"
            );
        }
        assert_eq!(solid.crossing(), None);
    }

    #[test]
    fn triangles_that_cross_are_found() {
        let points = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.2, 0.2, -1.0],
            [0.3, 0.2, 1.0],
            [0.2, 0.3, 1.0],
        ];
        let solid = Solid::new(&points, &[[0, 1, 2], [3, 4, 5]]).unwrap();
        assert_eq!(solid.crossing(), Some([0, 1]));
        let text = Solid::new(&points, &[[0, 1, 6]]).unwrap_err().to_string();
        assert!(text.contains("6 points, got 6"), "{text}");
    }
}
