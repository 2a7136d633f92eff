//! The truth: light followed on the CPU, in f64, against which every technique is measured. It shares the optics, the
//! meshes and the scene with the frame that the device draws, and no other code: that independence is its worth.
//!
//! | module | what |
//! |---|---|
//! | [`volume`] | the first integrator: unbiased random walks through the media; and the third: single scattering |
//! | [`free_path`] | how far paths and light get in a medium, homogeneous or in layers |
//! | [`layers`] | which medium a point lies in |
//! | [`bssrdf`] | the second: the diffusion profile of each material, where light enters and where it leaves |
//! | `crossing` | what paths do where they meet a surface |
//! | [`surfaces`] | what surfaces do that paths do not enter |
//! | [`boundary`] | reflection and refraction, smooth and rough |
//! | [`refracted`] | lamps without extent, seen from inside through a smooth boundary |
//! | [`lobe`] | the same through a rough one |
//! | [`light`] | lamps and the surroundings |
//! | [`world`] | the scene as rays see it |
//! | [`path`] | a path on its way: what it lies in and what it weighs |
//! | [`kin`] | what paths of neighbouring pixels share |
//! | [`light_paths`] | paths that begin at lamps, and meet those from the eye |
//! | `light_cells` | where they are likely, and the particles that they met |
//! | [`film`] | means, variances, parts, tiles |
//!
//! Samples are added in steps that double their number; each step is a bake, named by the one before, so that what was
//! interrupted goes on where it was. The same seed gives the same bits on any number of threads.
//!
//! Re-runs when: anything in the scene that light could meet changes, the camera, the size, or this room's code.

pub mod boundary;
pub mod bssrdf;
mod crossing;
pub mod film;
pub mod free_path;
pub mod kin;
pub mod layers;
pub mod light;
mod light_cells;
pub mod light_paths;
pub mod lobe;
pub mod path;
pub mod random;
pub mod refracted;
mod surfaces;
pub mod volume;
pub mod world;

use crate::geometry::mesh::Mesh;
use crate::image::{Image, Texture};
use crate::optics::phase::Phase;
use crate::optics::{Rgb, medium};
use crate::problem::Problem;
use crate::scene::{self, Camera, LightKind, Object, Part, Scene, Sky, Substance, shape};
use crate::store::{Bake, Key, Plan, Run, Slot, Step};
use bssrdf::Bssrdf;
use film::{Film, Level, Moments};
use glam::{DAffine3, DVec3};
use kin::Strand;
use layers::{Layer, Layers};
use light::{Kind, Lamp, SkyImage};
use light_paths::Field;
use path::Inside;
use random::Random;
use rayon::prelude::*;
use refracted::Refracted;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicUsize, Ordering};
use volume::{Light, Tracer};
use world::{Boundary, Matter, Medium, Thing, World};

/// What light does below a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum Integrator {
    /// It is followed: the truth.
    #[default]
    Volume,
    /// The material's profile says how far it goes: what that model makes when nothing else is approximated.
    Bssrdf,
    /// It is followed, but scatters once only. Of the paths of `Volume` those are left that, between coming in from the open
    /// and going out, meet one particle at most (or paint within the medium, which stands for one) and are nowhere reflected
    /// inside: one refraction in, one event, one refraction out. What is reflected outside, and what goes straight through,
    /// are the picture's other parts as ever. What `Layered` approximates.
    Layered,
}

/// Which picture, and how far to go.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    pub integrator: Integrator,
    pub light: Light,
    pub camera: Camera,
    pub size: (u32, u32),
    pub time_s: f64,
    pub max_depth: u32,
    pub seed: u64,
    /// Every `step`-th band of rows from the `first` on: (first, step).
    pub bands: (u32, u32),
}

/// Adds the steps that bring the picture to `samples` per pixel, at least 1.
pub fn plan(plan: &mut Plan, scene: &Scene, settings: &Settings, samples: u64) -> Slot<Film> {
    *doublings(plan, scene, settings, samples).last().expect("there is a first sample")
}

/// Likewise; gives the film of 1, 2, 4, … and at last `samples` paths per pixel.
pub fn doublings(plan: &mut Plan, scene: &Scene, settings: &Settings, samples: u64) -> Vec<Slot<Film>> {
    let tracer = tracer(plan, scene, settings);
    let mut more = |samples, before| {
        let Settings { camera, size, seed, bands, .. } = *settings;
        plan.bake(Trace { tracer, camera, size, seed, bands, samples, before })
    };
    let mut film = more((0, 1), None);
    let mut films = vec![film];
    let mut done = 1;
    while done < samples {
        let upto = (2 * done).min(samples);
        film = more((done, upto), Some(film));
        films.push(film);
        done = upto;
    }
    films
}

fn tracer(plan: &mut Plan, scene: &Scene, settings: &Settings) -> Slot<Tracer> {
    let mut things = Vec::new();
    let mut lamps = Vec::new();
    let mut sky = None;
    for object in scene.objects.iter().filter(|object| object.visible) {
        let (_, rotation, translation) = object.transform.world_from_object().to_scale_rotation_translation();
        things.push(Placed {
            mesh: shape::mesh(plan, object, settings.time_s),
            world_from_object: DAffine3::from_rotation_translation(rotation, translation),
            matter: matter(object, scene.mm_per_unit, settings.integrator),
        });
    }
    for light in scene.lights.iter().filter(|light| light.enabled) {
        let kind = match &light.kind {
            LightKind::Directional { direction, irradiance } => {
                Kind::Directional { direction: *direction, irradiance: *irradiance }
            }
            LightKind::Point { position, intensity } => Kind::Point { position: *position, intensity: *intensity },
            LightKind::Rect { center, u, v, radiance } => {
                things.push(Placed {
                    mesh: shape::quad(plan, &light.name, *u, *v),
                    world_from_object: DAffine3::from_translation(*center),
                    matter: Matter::Emitter(lamps.len()),
                });
                Kind::Rect { center: *center, u: *u, v: *v, radiance: *radiance }
            }
            LightKind::Environment { sky: seen, scale, rotation_deg } => {
                let (scale, image) = match seen {
                    Sky::Constant(radiance) => (*scale * *radiance, None),
                    Sky::Image(map) => {
                        let about = map.path.display().to_string();
                        (Rgb::splat(*scale), Some(plan.given("image.file", about, Key::of(map), map.texture.clone())))
                    }
                };
                sky = Some(SkyText { scale, image, rotation: rotation_deg.to_radians(), shadow: light.shadow });
                continue;
            }
        };
        lamps.push(Lamp { kind, shadow: light.shadow });
    }
    let single = settings.integrator == Integrator::Layered;
    plan.add(BuildTracer { things, lamps, sky, light: settings.light, max_depth: settings.max_depth, single })
}

/// What an object is made of, with coefficients per scene unit.
fn matter(object: &Object, mm_per_unit: f64, integrator: Integrator) -> Matter {
    let material = &object.material;
    let surface = Boundary {
        ior: material.surface.ior,
        roughness: material.surface.roughness.clone(),
        color: material.surface.color.clone(),
    };
    let medium = match &material.medium {
        Substance::Opaque { albedo } => return Matter::Opaque { surface, albedo: *albedo },
        Substance::Translucent(medium) => medium,
    };
    match integrator {
        Integrator::Volume | Integrator::Layered => {
            let layer = |layer: &scene::Layer| Layer {
                medium: followed(&layer.medium, layer.phase, mm_per_unit),
                depth: layer.depth.clone(),
            };
            let list: Vec<Layer> = material.layers.iter().map(layer).collect();
            let layers = (!list.is_empty()).then_some(Layers { list, mm_per_unit });
            Matter::Translucent { surface, medium: followed(medium, material.phase, mm_per_unit), layers }
        }
        Integrator::Bssrdf => {
            let (sigma_a, sigma_s) = (medium.sigma_a * mm_per_unit, medium.sigma_s * mm_per_unit);
            let medium = medium::Medium { sigma_a, sigma_s, g: medium.g };
            let bssrdf = Bssrdf::new(material.profile, medium, material.phase, surface.ior);
            Matter::Bssrdf { surface, bssrdf: Box::new(bssrdf) }
        }
    }
}

/// A medium as paths go through it.
fn followed(medium: &medium::Medium, phase: Phase, mm_per_unit: f64) -> Medium {
    Medium {
        sigma_a: medium.sigma_a * mm_per_unit,
        sigma_s: medium.sigma_s * mm_per_unit,
        phase,
        parameter: Rgb::from_array(medium.g.to_array().map(|g| phase.parameter(g))),
    }
}

#[derive(Serialize)]
struct Placed {
    mesh: Slot<Mesh>,
    /// Rigid: scale is in the mesh.
    world_from_object: DAffine3,
    matter: Matter,
}

#[derive(Serialize)]
struct SkyText {
    scale: Rgb,
    image: Option<Slot<Texture>>,
    rotation: f64,
    shadow: bool,
}

/// The scene, ready for rays.
#[derive(Serialize)]
struct BuildTracer {
    things: Vec<Placed>,
    lamps: Vec<Lamp>,
    sky: Option<SkyText>,
    light: Light,
    max_depth: u32,
    single: bool,
}

impl Step for BuildTracer {
    type Output = Tracer;
    const NEEDS_HOST: bool = false;
    fn name(&self) -> &'static str {
        "reference.world"
    }
    fn about(&self) -> String {
        let things = crate::problem::counted(self.things.len(), "thing");
        format!("{things} ready for rays, and the beams that lamps send into them")
    }
    fn run(&self, run: &Run) -> Result<Tracer, Problem> {
        let things = self
            .things
            .iter()
            .map(|placed| Thing {
                mesh: run.get(placed.mesh),
                world_from_object: placed.world_from_object,
                turn: placed.world_from_object.matrix3,
                matter: placed.matter.clone(),
            })
            .collect();
        let world = World::new(things);
        let mut refracted = Vec::new();
        for (i, lamp) in self.lamps.iter().enumerate() {
            for thing in 0..world.things.len() {
                run.tick(i as f64 / self.lamps.len() as f64)?;
                refracted.extend(Refracted::new(&world, i, &lamp.kind, thing));
            }
        }
        let sky = self.sky.as_ref().map(|sky| light::Sky {
            scale: sky.scale,
            image: sky.image.map(|image| SkyImage::new(run.get(image), sky.rotation)),
            shadow: sky.shadow,
        });
        let lamps = self.lamps.clone();
        let BuildTracer { light, max_depth, single, .. } = *self;
        let mut tracer =
            Tracer { world, lamps, sky, refracted, light, max_depth, single, joins: true, kin: true, field: None };
        tracer.field = Field::new(&tracer, light_paths::PATHS);
        Ok(tracer)
    }
}

/// The step that takes the time.
pub const TRACE: &str = "reference.trace";

/// More samples of every pixel, added to those before.
#[derive(Serialize)]
struct Trace {
    tracer: Slot<Tracer>,
    camera: Camera,
    size: (u32, u32),
    seed: u64,
    bands: (u32, u32),
    /// From and up to.
    samples: (u64, u64),
    before: Option<Slot<Film>>,
}

/// Pixels whose paths are kin.
struct Block {
    /// Each one's place in the film, and in the picture.
    pixels: Vec<(usize, u32, u32)>,
    moments: Vec<Moments>,
}

impl Step for Trace {
    type Output = Film;
    fn name(&self) -> &'static str {
        TRACE
    }
    fn about(&self) -> String {
        format!("paths {} to {} of each pixel", self.samples.0 + 1, self.samples.1)
    }
    fn continues(&self) -> Option<Slot<Film>> {
        self.before
    }
    fn run(&self, run: &Run) -> Result<Film, Problem> {
        let tracer = run.get(self.tracer);
        let before = self.before.map(|slot| run.get(slot));
        let width = self.size.0;
        let mut film = Film::new(self.size, self.bands, self.samples.1);
        let eye = Eye::new(&self.camera, self.size);
        let inside = around(&tracer.world, self.camera.eye);
        // The paths of a block are kin; which block a pixel lies in is the same for every tile.
        let rows: Vec<u32> = film.rows().collect();
        let corners = (0..rows.len())
            .step_by(kin::SIDE as usize)
            .flat_map(|row| (0..width).step_by(kin::SIDE as usize).map(move |x| (row, x)));
        let pixels = |(row, x): (usize, u32)| -> Vec<(usize, u32, u32)> {
            let rows = rows.iter().enumerate().skip(row).take(kin::SIDE as usize);
            let across = x..width.min(x + kin::SIDE);
            rows.flat_map(|(row, y)| across.clone().map(move |x| (row * width as usize + x as usize, x, *y))).collect()
        };
        let mut blocks: Vec<Block> = corners
            .map(|corner| {
                let pixels = pixels(corner);
                Block { moments: vec![Moments::default(); pixels.len()], pixels }
            })
            .collect();
        let (done, all) = (AtomicUsize::new(0), blocks.len() * (self.samples.1 - self.samples.0) as usize);
        for sample in self.samples.0..self.samples.1 {
            let lit = tracer.light_paths(self.seed, sample);
            blocks.par_iter_mut().try_for_each(|Block { pixels, moments }| {
                let path = |&(_, x, y): &(usize, u32, u32)| {
                    let mut random = Random::new(self.seed, y as u64 * width as u64 + x as u64, sample);
                    let (a, b) = random.pair();
                    tracer.trace(self.camera.eye, eye.direction(x as f64 + a, y as f64 + b), inside, &mut random)
                };
                let mut strands: Vec<Strand> = pixels.iter().map(path).collect();
                tracer.settle(&mut strands);
                if let (Some(lit), Some((_, x, y))) = (&lit, pixels.first()) {
                    // A stream that no pixel has, nor light path.
                    let block = u64::MAX / 2 - (*y as u64 * width as u64 + *x as u64);
                    tracer.meet_light(&mut strands, lit, &mut Random::new(self.seed, block, sample));
                }
                let found = strands.iter().zip(moments.iter_mut());
                found.for_each(|(strand, moments)| moments.add(&strand.parts, strand.is_object));
                run.tick((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / all as f64)
            })?;
        }
        let traced = blocks.iter().flat_map(|block| block.pixels.iter().map(|p| p.0).zip(&block.moments));
        for (place, moments) in traced {
            film.pixels[place] = moments.pixel(before.as_ref().map(|film| (&film.pixels[place], film.samples)));
        }
        Ok(film)
    }
}

impl Bake for Trace {
    const CODE: &'static [&'static str] = &["src/reference/", "src/optics/", "src/geometry/", "src/scene/shape.rs"];
}

/// A film's picture.
#[derive(Serialize)]
pub struct Develop {
    pub film: Slot<Film>,
    pub part: Part,
}

impl Step for Develop {
    type Output = Image;
    const NEEDS_HOST: bool = false;
    fn name(&self) -> &'static str {
        "reference.picture"
    }
    fn about(&self) -> String {
        "the mean of all paths".into()
    }
    fn run(&self, run: &Run) -> Result<Image, Problem> {
        Ok(run.get(self.film).picture(self.part))
    }
}

/// A film's level.
#[derive(Serialize)]
pub struct Judge {
    pub film: Slot<Film>,
    pub part: Part,
}

impl Step for Judge {
    type Output = Level;
    const NEEDS_HOST: bool = false;
    fn name(&self) -> &'static str {
        "reference.level"
    }
    fn about(&self) -> String {
        "how far the paths scatter about their mean".into()
    }
    fn run(&self, run: &Run) -> Result<Level, Problem> {
        Ok(run.get(self.film).level(self.part))
    }
}

/// A pinhole camera's rays.
struct Eye {
    forward: DVec3,
    right: DVec3,
    up: DVec3,
    size: (f64, f64),
}

impl Eye {
    fn new(camera: &Camera, (width, height): (u32, u32)) -> Eye {
        let forward = (camera.target - camera.eye).normalize();
        let right = forward.cross(camera.up).normalize();
        let pixel = 2.0 * (0.5 * camera.fov_y_deg.to_radians()).tan() / height as f64;
        let up = right.cross(forward);
        Eye { forward, right: pixel * right, up: pixel * up, size: (width as f64, height as f64) }
    }

    /// Through a place in the picture, in pixels from its top left.
    fn direction(&self, x: f64, y: f64) -> DVec3 {
        let (x, y) = (x - 0.5 * self.size.0, y - 0.5 * self.size.1);
        (self.forward + x * self.right - y * self.up).normalize()
    }
}

/// The closed translucent things in which a point lies: those whose boundary a ray leaves more often than it enters.
fn around(world: &World, p: DVec3) -> Inside {
    // Any direction will do; one that is parallel to nothing meets no edge.
    let direction = DVec3::new(0.5377, 0.6251, 0.5657).normalize();
    let mut crossings = vec![0i32; world.things.len()];
    let (mut origin, mut on) = (p, None);
    while let Some(point) = world.meet(origin, direction, f64::INFINITY, on) {
        crossings[point.thing()] += if direction.dot(point.flat) > 0.0 { 1 } else { -1 };
        (origin, on) = (point.p, Some(point.place));
    }
    let is_around =
        |thing: &usize| crossings[*thing] > 0 && matches!(world.things[*thing].matter, Matter::Translucent { .. });
    (0..world.things.len()).filter(is_around).fold(Inside::default(), |inside, thing| inside.with(thing))
}

#[cfg(test)]
mod tests;
