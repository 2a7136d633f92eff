//! What a technique is given, and what follows it.
//!
//! [`Frame::new`] decides who is in the picture and lit by what, without planning a step. Its methods then add the steps
//! of the frame to a plan when they are asked for: the G-buffer, shadows, the surroundings, gloss, the sum of the parts.
//! Asking twice plans once, and what nobody asks for is never made.
//!
//! Positions on the device are in eye space: the world's axes and unit, with the eye at the origin, subtracted in f64.
//!
//! | steps | re-run when |
//! |---|---|
//! | meshes, filtered normals, sky visibility | the shape, its material's medium or kernel, or who stands where, changes |
//! | shadow maps | a shape, a transform or the light's place changes; not its colour, not the camera |
//! | the rest | the camera or anything in the picture changes |

mod compose;
mod gloss;
mod lamp;
mod lights;
mod sky;
mod surface;
mod tables;
mod upload;

pub use crate::scene::Part;
pub(crate) use compose::{display, read_back};
pub use lamp::{Lamp, LampViews};
pub use surface::{Member, Surface};

use crate::geometry::mesh::Mesh;
use crate::gpu::{Bind, Blend, Buffer, Depth, Draw, Format, Images, Layer, Raster, Shaders};
use crate::optics::fresnel::diffuse_transmittance;
use crate::problem::{Problem, counted};
use crate::scene::{Camera, LightKind, Material, Object, Scene, Substance, Varying, shape};
use crate::store::{Plan, Slot};
use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3};
use std::cell::OnceCell;
use upload::Stream;
pub(crate) use upload::picture as to_device;

/// How to look at a scene, as far as the frame is concerned.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    pub camera: Camera,
    pub size: (u32, u32),
    /// Samples per pixel and axis.
    pub antialias: u32,
    pub time_s: f64,
    pub part: Part,
    /// Whether steps that cannot change the picture are left out.
    pub skip: bool,
}

impl View {
    /// The size that is drawn, before samples become pixels.
    pub fn sampled_size(&self) -> (u32, u32) {
        (self.size.0 * self.antialias, self.size.1 * self.antialias)
    }
}

/// A thing that is drawn or casts a shadow: an object, or an area light.
pub(crate) struct Item {
    pub name: String,
    pub thing: Thing,
    pub mesh: Slot<Mesh>,
    /// Rigid: scale is in the mesh.
    pub world_from_object: DAffine3,
    /// World space, certainly containing it.
    pub corners: [DVec3; 8],
    pub in_view: bool,
    /// How far above the surface its shadows are looked up, scene units: where its technique lets light in around an edge.
    pub entry: f64,
}

impl Item {
    /// Around its corners: middle and radius, world space.
    fn ball(&self) -> (DVec3, f64) {
        let middle = self.corners.iter().sum::<DVec3>() / 8.0;
        (middle, self.corners.iter().map(|p| p.distance(middle)).fold(0.0, f64::max))
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Thing {
    /// The object's place in the scene.
    Object(usize),
    /// The light's place in the scene.
    Light(usize),
}

/// Who is in the picture, and lit by what.
pub struct Frame<'a> {
    pub scene: &'a Scene,
    pub view: &'a View,
    pub(crate) shaders: &'a Shaders,
    pub(crate) items: Vec<Item>,
    clip_from_eye: DMat4,
    camera: tables::Camera,
    /// The visibility of the lamps, once it was asked for: many views are costly to plan again.
    visibility: OnceCell<Option<Slot<Images>>>,
    /// The table of everything that is drawn, once it was asked for: nearly every pass binds it.
    objects: OnceCell<Bind>,
}

impl<'a> Frame<'a> {
    pub fn new(scene: &'a Scene, view: &'a View, shaders: &'a Shaders, plan: &mut Plan) -> Frame<'a> {
        let mut items = Vec::new();
        for (i, object) in scene.objects.iter().enumerate() {
            if !object.visible {
                plan.skip(format!("the object `{}`, its mesh and its bakes", object.name), "visible: false");
                continue;
            }
            let (min, max) = shape::bounds(object);
            let full = object.transform.world_from_object();
            let (_, rotation, translation) = full.to_scale_rotation_translation();
            let world_from_object = DAffine3::from_rotation_translation(rotation, translation);
            items.push(Item {
                name: object.name.clone(),
                thing: Thing::Object(i),
                mesh: shape::mesh(plan, object, view.time_s),
                world_from_object,
                corners: shape::corners(min, max).map(|p| world_from_object.transform_point3(p)),
                in_view: true,
                entry: 0.0,
            });
        }
        for (i, light) in scene.lights.iter().enumerate() {
            let LightKind::Rect { center, u, v, .. } = light.kind else { continue };
            if !light.enabled {
                continue;
            }
            let corner = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(a, b)| center + a * u + b * v);
            items.push(Item {
                name: light.name.clone(),
                thing: Thing::Light(i),
                mesh: shape::quad(plan, &light.name, u, v),
                world_from_object: DAffine3::from_translation(center),
                corners: std::array::from_fn(|i| corner[i % 4]),
                in_view: true,
                entry: 0.0,
            });
        }
        for light in scene.lights.iter().filter(|light| !light.enabled) {
            plan.skip(format!("the light `{}`", light.name), "enabled: false");
        }
        let mut frame = Frame {
            scene,
            view,
            shaders,
            items,
            clip_from_eye: DMat4::IDENTITY,
            camera: Frame::camera(view),
            visibility: OnceCell::new(),
            objects: OnceCell::new(),
        };
        frame.clip_from_eye = frame.projection() * frame.rotation();
        frame.camera.clip_from_eye = frame.clip_from_eye.as_mat4();
        frame.cull(plan);
        frame
    }

    fn camera(view: &View) -> tables::Camera {
        let (width, height) = view.sampled_size();
        let forward = (view.camera.target - view.camera.eye).normalize();
        let right = forward.cross(view.camera.up).normalize();
        let half_height = (0.5 * view.camera.fov_y_deg.to_radians()).tan();
        tables::Camera {
            clip_from_eye: glam::Mat4::IDENTITY,
            forward: forward.as_vec3(),
            width: width as f32,
            right: right.as_vec3(),
            height: height as f32,
            up: right.cross(forward).as_vec3(),
            pixel: (2.0 * half_height / height as f64) as f32,
        }
    }

    /// View space (x right, y up, looking along -z) from eye space: a rotation.
    fn rotation(&self) -> DMat4 {
        let camera = &self.view.camera;
        let forward = (camera.target - camera.eye).normalize();
        let right = forward.cross(camera.up).normalize();
        let up = right.cross(forward);
        DMat4::from_mat3(DMat3::from_cols(right, up, -forward).transpose())
    }

    /// Reversed depth without a far end, so that nothing needs a setting; floats spend their precision evenly along it.
    fn projection(&self) -> DMat4 {
        let nearest = self
            .items
            .iter()
            .map(|item| {
                let (center, radius) = item.ball();
                (center.distance(self.view.camera.eye) - radius).max(1e-4 * radius)
            })
            .fold(f64::INFINITY, f64::min);
        let near = if nearest.is_finite() && nearest > 0.0 { 0.5 * nearest } else { 0.01 };
        let (width, height) = self.view.sampled_size();
        let f = 1.0 / (0.5 * self.view.camera.fov_y_deg.to_radians()).tan();
        DMat4::from_cols_array_2d(&[
            [f * height as f64 / width as f64, 0.0, 0.0, 0.0],
            [0.0, f, 0.0, 0.0],
            [0.0, 0.0, 0.0, -1.0],
            [0.0, 0.0, near, 0.0],
        ])
    }

    /// Notes which items are outside the view: outside one of its five planes with all corners.
    fn cull(&mut self, plan: &mut Plan) {
        let clip_from_eye = self.clip_from_eye;
        let eye = self.view.camera.eye;
        for item in &mut self.items {
            let clip = item.corners.map(|p| clip_from_eye * (p - eye).extend(1.0));
            let outside = |beyond: fn(&glam::DVec4) -> bool| clip.iter().all(beyond);
            let out = outside(|p| p.x < -p.w)
                || outside(|p| p.x > p.w)
                || outside(|p| p.y < -p.w)
                || outside(|p| p.y > p.w)
                || outside(|p| p.w < 0.0);
            if out && self.view.skip {
                item.in_view = false;
                plan.skip(
                    format!("drawing `{}`, and the bakes that only its own look needs", item.name),
                    "outside the view",
                );
            }
        }
    }

    /// Sets how far above an item's surface its shadows are looked up, mm; a tenth of the item at most.
    pub(crate) fn set_entry(&mut self, place: usize, entry_mm: f64) {
        let item = &mut self.items[place];
        let (_, radius) = item.ball();
        item.entry = (entry_mm / self.scene.mm_per_unit).min(0.2 * radius);
        self.objects = OnceCell::new();
    }

    pub(crate) fn material(&self, item: &Item) -> Option<&Material> {
        self.object(item).map(|object| object.material.as_ref())
    }

    pub(crate) fn object(&self, item: &Item) -> Option<&Object> {
        match item.thing {
            Thing::Object(i) => Some(&self.scene.objects[i]),
            Thing::Light(_) => None,
        }
    }

    pub(crate) fn camera_bind(&self) -> Bind {
        Bind::uniform(&self.camera)
    }

    /// The table of everything that is drawn, in the order of the items.
    pub(crate) fn objects_bind(&self) -> Bind {
        let table = || {
            let maps = surface::maps(self);
            Bind::list(&self.items.iter().map(|item| self.row(item, &maps)).collect::<Vec<tables::Object>>())
        };
        self.objects.get_or_init(table).clone()
    }

    fn row(&self, item: &Item, maps: &[surface::Use]) -> tables::Object {
        let eye_from_world = DAffine3::from_translation(-self.view.camera.eye);
        let (middle, radius) = item.ball();
        let mut row = tables::Object {
            eye_from_object: DMat4::from(eye_from_world * item.world_from_object).as_mat4(),
            color: Vec3::ONE,
            roughness: 1.0,
            scatter: Vec3::ZERO,
            eta: 1.0,
            emission: Vec3::ZERO,
            entry: item.entry as f32,
            sigma_t: Vec3::ZERO,
            color_layer: -1,
            roughness_layer: -1,
            flags: 0,
            distance: middle.distance(self.view.camera.eye) as f32,
        };
        match item.thing {
            Thing::Light(i) => {
                if let LightKind::Rect { radiance, .. } = self.scene.lights[i].kind {
                    row.emission = radiance.as_vec3();
                    row.flags = tables::EMITTER;
                }
            }
            Thing::Object(i) => {
                let material = &self.scene.objects[i].material;
                row.eta = material.surface.ior as f32;
                row.scatter = scatter(material).as_vec3();
                match &material.surface.color {
                    Varying::Constant(color) => row.color = color.as_vec3(),
                    Varying::Texture(map) => row.color_layer = surface::layer_of(maps, (map, None)),
                }
                match &material.surface.roughness {
                    Varying::Constant(roughness) => row.roughness = *roughness as f32,
                    Varying::Texture(map) => {
                        row.roughness_layer = surface::layer_of(maps, (map, Some(map.as_number())))
                    }
                }
                if let Substance::Translucent(medium) = &material.medium {
                    row.flags = tables::TRANSLUCENT;
                    let densest = DVec3::splat(DENSEST / radius);
                    row.sigma_t = (medium.sigma_t() * self.scene.mm_per_unit).min(densest).as_vec3();
                }
            }
        }
        row
    }

    /// Draws the items for which `wanted` holds, with the given streams after their positions.
    pub(crate) fn draws(
        &self,
        plan: &mut Plan,
        wanted: impl Fn(&Item) -> bool,
        mut streams: impl FnMut(&mut Plan, &Item) -> Vec<Slot<Buffer>>,
    ) -> Vec<Draw> {
        self.items
            .iter()
            .enumerate()
            .filter(|(_, item)| item.in_view && wanted(item))
            .map(|(i, item)| {
                let mut all = vec![upload::stream(plan, item.mesh, Stream::Positions)];
                all.extend(streams(plan, item));
                Draw { streams: all, indices: upload::stream(plan, item.mesh, Stream::Indices), instance: i as u32 }
            })
            .collect()
    }

    /// Position (eye space; w is 1 + the item's place), packed normals, colour and roughness, then depth.
    pub fn gbuffer(&self, plan: &mut Plan) -> Result<Slot<Images>, Problem> {
        let textures = surface::textures(self, plan);
        let mut binds = vec![("camera", self.camera_bind()), ("objects", self.objects_bind())];
        let mut flags = Vec::new();
        if let Some(textures) = textures {
            flags.push("TEXTURES");
            binds.push(("textures", Bind::Texture(textures, 0)));
            binds.push(("repeat", Bind::Sampler(crate::gpu::Sampler::LinearRepeat)));
        }
        let draws = self.draws(
            plan,
            |_| true,
            |plan, item| {
                let mut streams = vec![upload::stream(plan, item.mesh, Stream::Normals)];
                if textures.is_some() {
                    streams.push(upload::stream(plan, item.mesh, Stream::Uvs));
                }
                streams
            },
        );
        let drawn = draws.len();
        Ok(plan.add(Raster {
            name: "frame.gbuffer",
            about: format!("position, normal, colour and roughness of {}", counted(drawn, "thing")),
            shader: self.shaders.load("frame/gbuffer.wgsl", &flags)?,
            size: self.view.sampled_size(),
            targets: vec![(Format::Rgba32Float, Blend::Replace), (Format::Rgba32Uint, Blend::Replace)],
            depth: Depth::Write,
            layers: vec![Layer::meshes(draws)],
            array: false,
            binds,
        }))
    }
}

/// Mean free paths from a thing's middle to its farthest corner, beyond which a medium counts as no denser for light that
/// goes straight through: a thousandth of that way is opaque by then, and several faces add up within a half float. Larger
/// ones are infinite there, and the difference of two infinities is no number.
const DENSEST: f64 = 8000.0;

/// Where the G-buffer keeps what.
pub(crate) const POSITION: usize = 0;
pub(crate) const PACKED: usize = 1;
pub(crate) const DEPTH: usize = 2;

/// Radiance scattered out of a half space per irradiance that entered it, but for the Fresnel transmittance on the way
/// out: albedo / (c pi), with c the hemispherical mean of that transmittance, so that all of the albedo leaves.
fn scatter(material: &Material) -> DVec3 {
    material.albedo / (std::f64::consts::PI * diffuse_transmittance(material.surface.ior))
}

/// The longest side of the box in which an object lies before it is placed, scene units.
pub fn extent(object: &Object) -> f64 {
    let (min, max) = shape::bounds(object);
    (max - min).max_element()
}

/// The diagonal of that box.
fn diagonal(object: &Object) -> f64 {
    let (min, max) = shape::bounds(object);
    min.distance(max)
}

/// A ball in which an object certainly lies: its centre in the world, and its radius, scene units.
pub fn ball(object: &Object) -> (DVec3, f64) {
    let (min, max) = shape::bounds(object);
    let (_, rotation, translation) = object.transform.world_from_object().to_scale_rotation_translation();
    (translation + rotation * (0.5 * (min + max)), 0.5 * min.distance(max))
}
