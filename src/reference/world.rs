//! The scene as rays see it: every triangle of every visible object and area light in world space.

use super::boundary::Facing;
use super::bssrdf::Bssrdf;
use super::layers::{Layers, Strata};
use crate::geometry::bvh::{Bvh, Hit};
use crate::geometry::clearance::Clearance;
use crate::geometry::mesh::Mesh;
use crate::optics::Rgb;
use crate::optics::phase::Phase;
use crate::scene::{TextureMap, Varying};
use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;
use serde::Serialize;
use std::sync::Arc;

/// What a thing is made of. Lengths are scene units.
#[derive(Clone, Debug, Serialize)]
pub enum Matter {
    /// Lambertian under a dielectric boundary.
    Opaque { surface: Boundary, albedo: Rgb },
    Translucent {
        surface: Boundary,
        medium: Medium,
        /// Over the medium; none where it fills all of the thing.
        layers: Option<Layers>,
    },
    /// The same, but light is not followed through it.
    Bssrdf { surface: Boundary, bssrdf: Box<Bssrdf> },
    /// An area light: its place in the scene's list.
    Emitter(usize),
}

#[derive(Clone, Debug, Serialize)]
pub struct Boundary {
    pub ior: f64,
    pub roughness: Varying<f64>,
    pub color: Varying<Rgb>,
}

impl Boundary {
    /// Whether all of it is smooth.
    pub fn is_smooth(&self) -> bool {
        let Varying::Constant(roughness) = self.roughness else { return false };
        Facing { flat: DVec3::Z, normal: DVec3::Z, eta: self.ior, roughness }.is_smooth()
    }
}

/// Coefficients per scene unit, and the phase function's own parameter for each channel.
#[derive(Clone, Debug, Serialize)]
pub struct Medium {
    pub sigma_a: Rgb,
    pub sigma_s: Rgb,
    pub phase: Phase,
    pub parameter: Rgb,
}

impl Medium {
    pub fn sigma_t(&self) -> Rgb {
        self.sigma_a + self.sigma_s
    }

    /// The share of a path's light that comes, scattered, by a direction in which the path goes on, 1/sr.
    pub fn scattered(&self, from: DVec3, to: DVec3) -> Rgb {
        Rgb::from_array(self.parameter.to_array().map(|k| self.phase.value(-from.dot(to), k)))
    }
}

pub struct Thing {
    pub mesh: Arc<Mesh>,
    pub world_from_object: DAffine3,
    /// Turns normals.
    pub turn: DMat3,
    pub matter: Matter,
}

pub struct World {
    pub bvh: Bvh,
    pub things: Vec<Thing>,
    /// Around each thing.
    pub balls: Vec<Ball>,
    /// The layers of each thing that has some, in space.
    pub strata: Vec<Option<Strata>>,
    /// How far it is from within each thing that light goes through to any surface, at least.
    clearances: Vec<Option<Clearance>>,
}

#[derive(Clone, Copy, Debug)]
pub struct Ball {
    pub center: DVec3,
    pub radius: f64,
}

/// A triangle of a thing: a ray that starts on it does not meet it again.
pub type Place = (u32, u32);

/// A point of a surface, in world space.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    pub p: DVec3,
    /// Along the ray that found it.
    pub t: f64,
    pub place: Place,
    pub barycentrics: glam::DVec2,
    /// Of the triangle, outwards.
    pub flat: DVec3,
    /// Interpolated, on the same side.
    pub normal: DVec3,
}

impl Point {
    pub fn thing(&self) -> usize {
        self.place.0 as usize
    }
}

impl World {
    pub fn new(things: Vec<Thing>) -> World {
        let meshes: Vec<(&Mesh, DAffine3)> =
            things.iter().map(|thing| (thing.mesh.as_ref(), thing.world_from_object)).collect();
        let strata = things.iter().map(Strata::of).collect();
        let bvh = Bvh::new(&meshes);
        let clearances = things.par_iter().map(|thing| thing.clearance(&bvh)).collect();
        let balls = things.iter().map(Thing::ball).collect();
        World { bvh, balls, strata, clearances, things }
    }

    /// How far it is from a point to any surface, at least; 0 where that is not known, as outside of the thing.
    pub fn clearance(&self, thing: usize, p: DVec3) -> f64 {
        self.clearances[thing].as_ref().map_or(0.0, |clearance| clearance.at(p))
    }

    /// A guess of how far it is from a point in a thing along a direction to a surface, `enough` at most.
    pub fn guess(&self, thing: usize, p: DVec3, direction: DVec3, enough: f64) -> f64 {
        self.clearances[thing].as_ref().map_or(0.0, |clearance| clearance.guess(p, direction, enough))
    }

    /// What a ray meets first within `t_max`, on either side; never the triangle `from` that it starts on.
    pub fn meet(&self, origin: DVec3, direction: DVec3, t_max: f64, from: Option<Place>) -> Option<Point> {
        let hit = self.bvh.closest_hit_but(origin, direction, t_max, from)?;
        Some(self.point(origin, direction, hit))
    }

    fn point(&self, origin: DVec3, direction: DVec3, hit: Hit) -> Point {
        let thing = &self.things[hit.object as usize];
        let (flat, normal) = thing.normals(hit.triangle as usize, hit.barycentrics);
        Point {
            p: origin + hit.t * direction,
            t: hit.t,
            place: (hit.object, hit.triangle),
            barycentrics: hit.barycentrics,
            flat,
            normal,
        }
    }

    /// Every place where the line through `p` meets one thing, in the line's order; `t` is below 0 behind `p`.
    pub fn along(&self, thing: usize, p: DVec3, direction: DVec3) -> Vec<Point> {
        let hits = self.bvh.hits_along(thing as u32, p, direction);
        hits.into_iter().map(|hit| self.point(p, direction, hit)).collect()
    }

    pub fn is_free(&self, origin: DVec3, direction: DVec3, t_max: f64, from: Option<Place>) -> bool {
        self.bvh.closest_hit_but(origin, direction, t_max, from).is_none()
    }
}

impl Thing {
    /// None of what light does not go through.
    fn clearance(&self, bvh: &Bvh) -> Option<Clearance> {
        let Matter::Translucent { .. } = self.matter else { return None };
        let (min, max) = self.bounds();
        Some(Clearance::new(min, max, bvh.triangles()))
    }

    /// World space.
    fn bounds(&self) -> (DVec3, DVec3) {
        let corners = self.mesh.positions.iter().map(|p| self.world_from_object.transform_point3(p.as_dvec3()));
        corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)))
    }

    /// Around the middle of its box. Wide enough for the f32 in which rays see its corners.
    fn ball(&self) -> Ball {
        let corners = || self.mesh.positions.iter().map(|p| self.world_from_object.transform_point3(p.as_dvec3()));
        let (min, max) = self.bounds();
        let center = 0.5 * (min + max);
        let radius = corners().map(|p| p.distance(center)).fold(0.0, f64::max);
        Ball { center, radius: 1.0001 * radius }
    }

    /// Its place in the scene's list of lights, if it is one.
    pub fn lamp(&self) -> Option<usize> {
        match self.matter {
            Matter::Emitter(lamp) => Some(lamp),
            _ => None,
        }
    }

    /// A boundary of it, seen from outside.
    pub fn outside(&self, surface: &Boundary, point: &Point) -> Facing {
        let roughness = self.roughness(surface, point);
        Facing { flat: point.flat, normal: point.normal, eta: surface.ior, roughness }
    }

    /// Whether light changes its direction where it enters.
    pub fn refracts(&self) -> bool {
        matches!(&self.matter, Matter::Translucent { surface, .. } if surface.ior != 1.0)
    }

    /// The triangle's outward normal, and the interpolated one on the same side of it; the first for both where the second
    /// vanishes.
    pub fn normals(&self, triangle: usize, b: glam::DVec2) -> (DVec3, DVec3) {
        let [i, j, k] = self.mesh.triangles[triangle].map(|v| self.mesh.normals[v as usize].as_dvec3());
        let [p, q, r] = self.mesh.corners(triangle);
        let flat = (self.turn * (q - p).cross(r - p)).normalize();
        let mut normal = (self.turn * ((1.0 - b.x - b.y) * i + b.x * j + b.y * k)).normalize_or(flat);
        if normal.dot(flat) < 0.0 {
            normal = -normal;
        }
        (flat, normal)
    }

    /// Texture coordinates; v runs upwards.
    pub fn uv(&self, triangle: usize, b: glam::DVec2) -> (f64, f64) {
        if self.mesh.uvs.is_empty() {
            return (0.0, 0.0);
        }
        let [i, j, k] = self.mesh.triangles[triangle].map(|v| self.mesh.uvs[v as usize].as_dvec2());
        let uv = (1.0 - b.x - b.y) * i + b.x * j + b.y * k;
        (uv.x, uv.y)
    }

    pub fn color(&self, surface: &Boundary, point: &Point) -> Rgb {
        match &surface.color {
            Varying::Constant(color) => *color,
            Varying::Texture(map) => {
                let [r, g, b, _] = texel(map, self.uv(point.place.1 as usize, point.barycentrics));
                Rgb::new(r, g, b)
            }
        }
    }

    pub fn roughness(&self, surface: &Boundary, point: &Point) -> f64 {
        number(&surface.roughness, self.uv(point.place.1 as usize, point.barycentrics))
    }
}

/// What a number is at these texture coordinates.
pub fn number(value: &Varying<f64>, uv: (f64, f64)) -> f64 {
    match value {
        Varying::Constant(value) => *value,
        Varying::Texture(map) => map.as_number().of(texel(map, uv)),
    }
}

/// Bilinear, repeating, v upwards.
fn texel(map: &TextureMap, (u, v): (f64, f64)) -> [f64; 4] {
    let image = &map.texture;
    let place = |at: f64, size: u32| {
        let at = at * size as f64 - 0.5;
        let low = at.floor();
        let wrap = |i: f64| i.rem_euclid(size as f64) as u32;
        (wrap(low), wrap(low + 1.0), at - low)
    };
    let ((x0, x1, fx), (y0, y1, fy)) = (place(u, image.width), place(1.0 - v, image.height));
    let at = |x: u32, y: u32, c: usize| image.texels[(y * image.width + x) as usize][c] as f64;
    std::array::from_fn(|c| {
        let row = |y| at(x0, y, c) * (1.0 - fx) + at(x1, y, c) * fx;
        row(y0) * (1.0 - fy) + row(y1) * fy
    })
}
