//! The project's own figures, modelled as signed distance fields and meshed finely and evenly.
//!
//! A figure is a field over space (see `clay` for the vocabulary), negative inside. It is meshed in three steps:
//! `polygonise` finds a closed surface through a lattice, `remesh` makes its triangles nearly equilateral while
//! keeping it on the field's zero set, and the normals are the field's gradient, so that they are as smooth as the clay.

mod bust;
mod clay;
mod hare;
mod polygonise;
mod remesh;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::geometry::mesh::{Bounds, Mesh};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Figure {
    /// A seated hare with long thin ears, for light from behind.
    Hare,
    /// A sleeping head.
    Bust,
}

/// Cells along the height at which the figures show all that they have: about 50,000 triangles.
pub const DEFAULT_DETAIL: u32 = 190;

/// Fewer cells than this lose the ears.
pub const LEAST_DETAIL: u32 = 32;

/// A shape in space: the distance to its surface, negative inside. It may be off by a factor of two away from the
/// surface and must be smooth near it.
trait Field: Sync {
    fn distance(&self, p: DVec3) -> f64;

    /// A box that holds the surface.
    fn bounds(&self) -> (DVec3, DVec3);

    /// The direction in which the distance grows, not unit; by central differences over `step`.
    fn gradient(&self, p: DVec3, step: f64) -> DVec3 {
        // Four points of a tetrahedron do what six on the axes would.
        const CORNERS: [DVec3; 4] = [
            DVec3::new(1.0, -1.0, -1.0),
            DVec3::new(-1.0, -1.0, 1.0),
            DVec3::new(-1.0, 1.0, -1.0),
            DVec3::new(1.0, 1.0, 1.0),
        ];
        CORNERS.iter().map(|c| self.distance(p + step * c) * c).sum::<DVec3>() / (4.0 * step)
    }

    /// A step of Newton's method along the gradient, from `p` to the surface, which is about a lattice cell away.
    fn project(&self, p: DVec3, step: f64) -> DVec3 {
        let gradient = self.gradient(p, step);
        p - self.distance(p) * gradient / gradient.length_squared()
    }
}

/// The figure standing on y = 0, `height` scene units tall, centred in x and z, facing +z, without uvs. `detail` is the
/// number of lattice cells along its height, at least [`LEAST_DETAIL`]; the triangles grow as its square. Closed; the
/// same bits for the same arguments.
pub fn sculpture(figure: Figure, height: f64, detail: u32) -> Mesh {
    match figure {
        Figure::Hare => mesh(&hare::Hare::new(), height, detail),
        Figure::Bust => mesh(&bust::Bust::new(), height, detail),
    }
}

fn mesh(field: &impl Field, height: f64, detail: u32) -> Mesh {
    let (min, max) = field.bounds();
    let cell = (max.y - min.y) / detail.max(LEAST_DETAIL) as f64;
    let rough = polygonise::polygonise(field, cell);
    let surface = remesh::remesh(rough, field, 1.3 * cell);

    // The box is only about the figure's: its own decides how large it is and where it stands.
    let bounds = Bounds::of(surface.positions.iter().map(|p| p.as_vec3()));
    let foot = DVec3::new(bounds.center().x, bounds.min.y as f64, bounds.center().z);
    let scale = height / bounds.size().y;
    let normals: Vec<Vec3> =
        surface.positions.par_iter().map(|p| field.gradient(*p, 1e-2 * cell).normalize().as_vec3()).collect();
    Mesh {
        positions: surface.positions.iter().map(|p| (scale * (p - foot)).as_vec3()).collect(),
        normals,
        uvs: vec![],
        triangles: surface.triangles,
    }
}

#[cfg(test)]
mod tests;
