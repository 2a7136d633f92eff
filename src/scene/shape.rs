//! From an object's shape to its mesh: the steps that whoever draws or traces the scene shares.
//!
//! Re-runs when: a shape's parameters, its normals, its scale, or (for what deforms) the time change. Moving and turning an
//! object re-runs nothing here.

use super::{Deform, Figure, MeshSource, Normals, Object};
use crate::geometry::deform::Twist;
use crate::geometry::mesh::{Bounds, Mesh};
use crate::geometry::{normals, sculpture, shapes};
use crate::problem::Problem;
use crate::store::{Bake, Plan, Run, Slot, Step};
use glam::{DAffine3, DVec3};
use serde::Serialize;

/// A shape that the program makes itself.
#[derive(Serialize)]
struct Shape {
    shape: MeshSource,
}

impl Step for Shape {
    type Output = Mesh;
    fn name(&self) -> &'static str {
        "geometry.shape"
    }
    fn about(&self) -> String {
        describe(&self.shape)
    }
    fn run(&self, run: &Run) -> Result<Mesh, Problem> {
        Ok(match &self.shape {
            MeshSource::Sphere { radius, subdivisions } => shapes::sphere(*radius, *subdivisions),
            MeshSource::Box { size } => shapes::cuboid(*size),
            MeshSource::Torus { radius, tube, segments } => shapes::torus(*radius, *tube, *segments),
            MeshSource::TorusKnot { p, q, radius, tube, segments } => {
                shapes::torus_knot(*p, *q, *radius, *tube, *segments)
            }
            MeshSource::Slab { size, segments } => shapes::slab(*size, *segments),
            MeshSource::Sculpture { figure, height, detail } => {
                let figure = match figure {
                    Figure::Hare => sculpture::Figure::Hare,
                    Figure::Bust => sculpture::Figure::Bust,
                };
                run.tick(0.0)?;
                sculpture::sculpture(figure, *height, *detail)
            }
            MeshSource::File { .. } => unreachable!("a file's mesh is read with the scene"),
        })
    }
}

impl Bake for Shape {
    const CODE: &'static [&'static str] = &["src/geometry/", "src/scene/shape.rs"];
}

fn describe(shape: &MeshSource) -> String {
    match shape {
        MeshSource::File { path, .. } => path.display().to_string(),
        MeshSource::Sphere { radius, subdivisions } => {
            format!("a sphere of radius {radius}, {} triangles", 20 * 4u64.pow(*subdivisions))
        }
        MeshSource::Box { size } => format!("a box of {} x {} x {}", size.x, size.y, size.z),
        MeshSource::Torus { radius, tube, .. } => format!("a torus of radii {radius} and {tube}"),
        MeshSource::TorusKnot { p, q, radius, .. } => format!("a ({p}, {q}) torus knot of radius {radius}"),
        MeshSource::Slab { size, .. } => format!("a slab of {} x {} x {}", size.x, size.y, size.z),
        MeshSource::Sculpture { figure, height, .. } => format!("the {figure:?}, {height} high").to_lowercase(),
    }
}

/// A shape as its object wears it: normals chosen, deformed, scaled. What is left of the object's transform is rigid.
#[derive(Serialize)]
struct Worn {
    mesh: Slot<Mesh>,
    normals: Normals,
    deform: Vec<Deform>,
    /// 0 for what does not move by itself, so that time is no part of its name.
    time_s: f64,
    scale: DVec3,
}

impl Step for Worn {
    type Output = Mesh;
    const NEEDS_HOST: bool = false;
    fn name(&self) -> &'static str {
        "geometry.worn"
    }
    fn about(&self) -> String {
        let mut parts = vec![match self.normals {
            Normals::Auto => "its own normals".to_string(),
            Normals::Smooth { crease_deg } => format!("normals smooth up to {crease_deg} degrees"),
            Normals::Flat => "flat normals".to_string(),
        }];
        if !self.deform.is_empty() {
            parts.push(format!("deformed at {} s", self.time_s));
        }
        if self.scale != DVec3::ONE {
            parts.push(format!("scaled by {}", self.scale));
        }
        format!("the shape with {}", parts.join(", "))
    }
    fn run(&self, run: &Run) -> Result<Mesh, Problem> {
        let mesh = run.get(self.mesh);
        let mut mesh = mesh.as_ref().clone().with_normals(match self.normals {
            Normals::Auto => normals::Normals::Auto,
            Normals::Smooth { crease_deg } => normals::Normals::Smooth { crease_deg },
            Normals::Flat => normals::Normals::Flat,
        });
        for deform in &self.deform {
            let Deform::Twist { axis, deg_per_unit, speed_hz } = *deform;
            mesh = Twist { axis, deg_per_unit, speed_hz }.apply(&mesh, self.time_s);
        }
        Ok(match self.scale == DVec3::ONE {
            true => mesh,
            false => mesh.transformed(&DAffine3::from_scale(self.scale)),
        })
    }
}

/// Adds the steps that make an object's mesh, in its own space but for its scale: scene units.
pub fn mesh(plan: &mut Plan, object: &Object, time_s: f64) -> Slot<Mesh> {
    let mesh = match &object.mesh {
        MeshSource::File { key, mesh, .. } => plan.given("geometry.file", describe(&object.mesh), *key, mesh.clone()),
        shape => plan.bake(Shape { shape: shape.clone() }),
    };
    let moves = object.deform.iter().any(|Deform::Twist { speed_hz, .. }| *speed_hz != 0.0);
    plan.add(Worn {
        mesh,
        normals: object.normals,
        deform: object.deform.clone(),
        time_s: if moves { time_s } else { 0.0 },
        scale: object.transform.scale,
    })
}

/// Where an object's mesh certainly lies, before it is made: object space, scaled.
pub fn bounds(object: &Object) -> (DVec3, DVec3) {
    let (mut min, mut max) = match &object.mesh {
        MeshSource::File { mesh, .. } => {
            let Bounds { min, max } = mesh.bounds();
            (min.as_dvec3(), max.as_dvec3())
        }
        MeshSource::Sphere { radius, .. } => (DVec3::splat(-radius), DVec3::splat(*radius)),
        MeshSource::Box { size } | MeshSource::Slab { size, .. } => (-0.5 * *size, 0.5 * *size),
        MeshSource::Torus { radius, tube, .. } => around(radius + tube),
        // The knot's own radius varies by half of `radius` at most.
        MeshSource::TorusKnot { radius, tube, .. } => around(2.0 * radius + tube),
        MeshSource::Sculpture { height, .. } => {
            (height * DVec3::new(-0.7, -0.01, -0.7), height * DVec3::new(0.7, 1.01, 0.7))
        }
    };
    for Deform::Twist { axis, .. } in &object.deform {
        // Turning about an axis keeps each point's distance from it, and its height.
        let corners = corners(min, max);
        let axis = axis.normalize();
        let reach = corners.iter().map(|p| p.reject_from_normalized(axis).length()).fold(0.0, f64::max);
        let heights = corners.map(|p| p.dot(axis));
        let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let ends = [axis * low, axis * high];
        min = ends[0].min(ends[1]) - DVec3::splat(reach);
        max = ends[0].max(ends[1]) + DVec3::splat(reach);
    }
    let (a, b) = (min * object.transform.scale, max * object.transform.scale);
    (a.min(b), a.max(b))
}

fn around(radius: f64) -> (DVec3, DVec3) {
    (DVec3::splat(-radius), DVec3::splat(radius))
}

/// The corners of a box.
pub fn corners(min: DVec3, max: DVec3) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        DVec3::new(
            if i & 1 == 0 { min.x } else { max.x },
            if i & 2 == 0 { min.y } else { max.y },
            if i & 4 == 0 { min.z } else { max.z },
        )
    })
}

/// The quad of an area light.
pub fn quad(plan: &mut Plan, name: &str, u: DVec3, v: DVec3) -> Slot<Mesh> {
    plan.add(Quad { name: name.to_string(), u, v })
}

#[derive(Serialize)]
struct Quad {
    #[serde(skip)]
    name: String,
    u: DVec3,
    v: DVec3,
}

impl Step for Quad {
    type Output = Mesh;
    const NEEDS_HOST: bool = false;
    fn name(&self) -> &'static str {
        "geometry.quad"
    }
    fn about(&self) -> String {
        format!("the area light `{}` as a thing", self.name)
    }
    fn run(&self, _: &Run) -> Result<Mesh, Problem> {
        let normal = self.u.cross(self.v).normalize().as_vec3();
        let positions = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(a, b)| (a * self.u + b * self.v).as_vec3())
            .to_vec();
        Ok(Mesh { positions, normals: vec![normal; 4], uvs: Vec::new(), triangles: vec![[0, 1, 2], [0, 2, 3]] })
    }
}
