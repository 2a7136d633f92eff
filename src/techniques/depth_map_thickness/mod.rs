//! DepthMapThickness: how thick an object is towards a lamp is read from a depth map that the lamp sees it in [Green2004].
//!
//! At a point, thickness is its own distance to the lamp less the distance that the map holds where the point is seen: where
//! light entered. What is left of it comes out there. The object is drawn into the map a little larger than it is, so that
//! its silhouette does not miss, and keeps its true distances, or everything would be too thick by as much.
//!
//! - `blur: 0` averages the distances over a square so many mm wide around the entry, which softens edges and stands for
//!   diffusion.
//! - `grow: 0.005`, as a share of the object's longest side, is how much larger it is drawn.
//! - `attenuation`, `sigma`, `max_thickness`, `terms`, `ambient`, `diffuse`, `scatter` are those of `SphericalThickness`.
//!   `DepthMapThickness(attenuation: Beer, sigma: Extinction, terms: Paper)` is the method to the letter.
//!
//! Costs: a map of the object for each lamp (16 for an area light, six faces of a cube for a lamp nearby), made again when
//! one of the two moves, and a pass over its pixels. No bake: what deforms costs no more.
//!
//! Fails on concave objects, by construction: a map holds one entry, so that a gap counts as filled, and depths jump at
//! edges between near and far parts, which show as seams on whatever lies behind: `scenes/gaps.ron` has a knot with them,
//! beside one of `SphericalThickness`. `blur` softens seams, and leaves gaps filled. It knows nothing of surroundings: they
//! are scattered where they enter, and none of them comes through. Light that comes through is not taken from what is
//! scattered back, as `SphericalThickness` does, so that thin things are too bright in front.
//!
//! ```
//! use diaphane::scene::TechniqueText;
//! let text = TechniqueText::from_flag("--technique", "DepthMapThickness(blur: 1.5)")?;
//! diaphane::techniques::read(&text)?;
//! # Ok::<(), diaphane::problem::Problem>(())
//! ```

use super::attenuation::{Attenuation, Response, Sigma, Terms, positive};
use super::{Scattered, Technique};
use crate::frame::{Lamp, Member, Surface};
use crate::gpu::{Bind, Blend, Buffer, Cover, Depth, Format, Images, Layer, Raster};
use crate::problem::{Problem, counted};
use crate::scene::TechniqueText;
use crate::store::{Plan, Slot};
use crate::uniform;
use glam::{Mat4, Vec3};
use serde::Deserialize;

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DepthMapThickness {
    /// mm
    blur: f64,
    /// Of the longest side.
    grow: f64,
    attenuation: Attenuation,
    sigma: Sigma,
    /// mm
    max_thickness: Option<f64>,
    terms: Terms,
    ambient: f64,
    diffuse: f64,
    scatter: f64,
}

impl Default for DepthMapThickness {
    fn default() -> DepthMapThickness {
        DepthMapThickness {
            blur: 0.0,
            grow: 0.005,
            attenuation: Attenuation::default(),
            sigma: Sigma::default(),
            max_thickness: None,
            terms: Terms::default(),
            ambient: 1.0,
            diffuse: 1.0,
            scatter: 1.0,
        }
    }
}

uniform! {
    struct Measure {
        middle: Vec3,
        diagonal: f32,
        grow: f32,
        blur: f32,
    }
}

uniform! {
    struct MapView {
        clip_from_object: Mat4,
        sample_index: i32,
        texel: f32,
    }
}

uniform! {
    struct Factors {
        ambient: f32,
        diffuse: f32,
        scatter: f32,
        per_sample: u32,
    }
}

/// Where a lamp's light enters an object, and what is left of it after so many mm.
struct Entry {
    /// Views of one sample of the lamp.
    per_sample: u32,
    binds: Vec<(&'static str, Bind)>,
}

impl DepthMapThickness {
    pub fn read(text: &TechniqueText) -> Result<Box<dyn Technique>, Problem> {
        let settings: DepthMapThickness = text.settings()?;
        let DepthMapThickness { blur, grow, ambient, diffuse, scatter, max_thickness, .. } = settings;
        if let Some(max_thickness) = max_thickness {
            positive(text, "max_thickness", max_thickness, false)?;
        }
        let others = [("blur", blur), ("grow", grow), ("ambient", ambient), ("diffuse", diffuse), ("scatter", scatter)];
        for (name, value) in others {
            positive(text, name, value, true)?;
        }
        Ok(Box::new(settings))
    }

    fn factors(&self, per_sample: u32) -> Bind {
        Bind::uniform(&Factors {
            ambient: self.ambient as f32,
            diffuse: self.diffuse as f32,
            scatter: self.scatter as f32,
            per_sample,
        })
    }

    /// What a pass for one lamp needs to know of it.
    fn entry(
        &self,
        plan: &mut Plan,
        surface: &Surface,
        member: &Member,
        lamp: &Lamp,
        normals: Slot<Buffer>,
    ) -> Result<Entry, Problem> {
        let (mm_per_unit, extent) = (surface.mm_per_unit(), surface.extent(member));
        let grow = self.grow * extent;
        let (middle, diagonal) = surface.box_of(member);
        let views = surface.lamp_views(member, lamp, grow);
        let measure = Measure {
            middle: middle.as_vec3(),
            diagonal: diagonal as f32,
            grow: grow as f32,
            blur: (self.blur / mm_per_unit) as f32,
        };
        let view = |(i, (clip_from_object, texel)): (usize, &(Mat4, f64))| MapView {
            clip_from_object: *clip_from_object,
            sample_index: (i as u32 / views.per_sample) as i32,
            texel: *texel as f32,
        };
        let table: Vec<MapView> = views.views.iter().enumerate().map(view).collect();
        let draw = surface.draw(plan, member, vec![normals]);
        let layer = |view: &MapView| Layer {
            binds: vec![("view", Bind::uniform(view))],
            cover: Cover::Meshes(vec![draw.clone()]),
        };
        let map = plan.add(Raster {
            name: "depth_map_thickness.map",
            about: format!("where light of `{}` enters `{}`, {}", lamp.name, member.name, counted(table.len(), "view")),
            shader: surface.shader("techniques/depth_map_thickness/map.wgsl", &[])?,
            size: (views.size, views.size),
            targets: vec![(Format::R32Float, Blend::Replace)],
            depth: Depth::Write,
            layers: table.iter().map(layer).collect(),
            array: true,
            binds: vec![("measure", Bind::uniform(&measure)), ("lamp", lamp.bind.clone())],
        });
        let max_thickness = self.max_thickness.unwrap_or(extent * mm_per_unit);
        let response = Response::of(self.attenuation, self.sigma, max_thickness, member.material);
        let mut binds = vec![
            ("measure", Bind::uniform(&measure)),
            ("lamp", lamp.bind.clone()),
            ("map_views", Bind::list(&table)),
            ("distances", Bind::Texture(map, 0)),
        ];
        binds.extend(response.map(|response| ("transmittances", response.table(diagonal * mm_per_unit))));
        Ok(Entry { per_sample: views.per_sample, binds })
    }

    /// The light of one object: a pass for each lamp, each on top of the one before.
    fn member(&self, plan: &mut Plan, surface: &Surface, member: &Member) -> Result<Slot<Images>, Problem> {
        let normals = surface.normals(plan, member);
        let environment = surface.environment(plan, member, normals)?;
        let visibility = surface.visibility(plan)?;
        let mut sum: Option<Slot<Images>> = None;
        let lamps = surface.lamps(member);
        // Without lamps one pass is for the surroundings.
        let lamps = if lamps.is_empty() { vec![None] } else { lamps.into_iter().map(Some).collect() };
        for lamp in lamps {
            let mut flags = Vec::new();
            let mut binds =
                vec![("camera", surface.camera()), ("objects", surface.objects()), ("packed_map", surface.packed())];
            let (mut streams, mut per_sample, mut about) = (vec![normals], 1, "the surroundings".to_string());
            if let Some(lamp) = lamp {
                flags.push("LAMP");
                about = format!("`{}`", lamp.name);
                let entry = self.entry(plan, surface, member, &lamp, normals)?;
                per_sample = entry.per_sample;
                binds.extend(entry.binds);
                if self.terms == Terms::Balanced {
                    flags.push("BALANCED");
                }
                if self.blur > 0.0 {
                    flags.push("BLUR");
                }
                if let Some(visibility) = visibility.clone().filter(|_| lamp.casts()) {
                    flags.push("SHADOWS");
                    binds.push(("visibility", visibility));
                }
                if let Some(others) = surface.others(plan, member, &lamp)? {
                    flags.push("OTHERS");
                    binds.extend(others);
                }
            }
            match (sum, environment) {
                (Some(before), _) => {
                    flags.push("MORE");
                    binds.push(("before", Bind::Texture(before, 0)));
                }
                (None, Some(environment)) => {
                    flags.push("ENVIRONMENT");
                    streams.push(environment);
                }
                (None, None) => {}
            }
            binds.push(("factors", self.factors(per_sample)));
            let draw = surface.draw(plan, member, streams);
            sum = Some(plan.add(Raster {
                name: "depth_map_thickness.lamp",
                about: format!("light of {about} that `{}` scattered or let through", member.name),
                shader: surface.shader("techniques/depth_map_thickness/lamp.wgsl", &flags)?,
                size: surface.size(),
                targets: vec![(Format::Rgba32Float, Blend::Replace)],
                depth: surface.depth(),
                layers: vec![Layer::meshes(vec![draw])],
                array: false,
                binds,
            }));
        }
        Ok(sum.expect("there is at least one pass"))
    }
}

impl Technique for DepthMapThickness {
    fn plan(&self, plan: &mut Plan, surface: &Surface) -> Result<Scattered, Problem> {
        let members: Vec<Member> = surface.members().collect();
        let scattered: Vec<Slot<Images>> =
            members.iter().map(|member| self.member(plan, surface, member)).collect::<Result<_, Problem>>()?;
        Ok(surface.merge(plan, &scattered)?.expect("a technique is asked for objects"))
    }
}
