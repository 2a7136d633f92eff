//! What a technique is given: its objects, and the maps of the frame, planned only when it asks for them.

use super::{Frame, Item, PACKED, POSITION, upload};
use crate::geometry::mesh::Mesh;
use crate::gpu::{Bind, Buffer, Draw, Format, Gpu, Images, Shader, Shape};
use crate::image::Texture;
use crate::problem::{Problem, counted};
use crate::scene::{AsNumber, Material, TextureMap, Varying};
use crate::store::{Key, Plan, Run, Slot, Step};
use half::f16;
use serde::Serialize;

/// The objects that one technique renders, in one frame. Every map is planned when it is first asked for.
pub struct Surface<'a> {
    pub(crate) frame: &'a Frame<'a>,
    /// Places in the frame's items.
    pub(crate) items: Vec<usize>,
    pub(crate) gbuffer: Slot<Images>,
}

/// One object of a [`Surface`].
#[derive(Clone, Copy)]
pub struct Member<'a> {
    pub(crate) place: usize,
    pub name: &'a str,
    pub material: &'a Material,
    /// Object space, scaled: scene units.
    pub mesh: Slot<Mesh>,
}

impl Member<'_> {
    /// Its place in the table of [`Surface::objects`].
    pub fn place(&self) -> usize {
        self.place
    }
}

impl<'a> Surface<'a> {
    pub fn mm_per_unit(&self) -> f64 {
        self.frame.scene.mm_per_unit
    }

    /// The size of every map.
    pub fn size(&self) -> (u32, u32) {
        self.frame.view.sampled_size()
    }

    pub fn members(&self) -> impl Iterator<Item = Member<'a>> + '_ {
        self.items.iter().map(|&place| {
            let item = &self.frame.items[place];
            let material = self.frame.material(item).expect("an area light is rendered by no technique");
            Member { place, name: &item.name, material, mesh: item.mesh }
        })
    }

    /// The longest side of a member's box, as its object wears it: scene units.
    pub fn extent(&self, member: &Member) -> f64 {
        self.frame.object(self.item(member)).map_or(0.0, super::extent)
    }

    /// The diagonal of that box, scene units.
    pub fn diagonal(&self, member: &Member) -> f64 {
        self.frame.object(self.item(member)).map_or(0.0, super::diagonal)
    }

    pub fn shader(&self, name: &str, flags: &[&str]) -> Result<Shader, Problem> {
        self.frame.shaders.load(name, flags)
    }

    pub fn camera(&self) -> Bind {
        self.frame.camera_bind()
    }

    /// The table of all objects; a draw's `instance` is the place in it.
    pub fn objects(&self) -> Bind {
        self.frame.objects_bind()
    }

    /// Position in eye space (w: 1 + the object's place, 0 for nothing), `rgba32float`.
    pub fn position(&self) -> Bind {
        Bind::Texture(self.gbuffer, POSITION)
    }

    /// Normals, colour and roughness, `rgba32uint`; `frame/surface.wgsl` unpacks it.
    pub fn packed(&self) -> Bind {
        Bind::Texture(self.gbuffer, PACKED)
    }

    /// The G-buffer itself, for passes that draw on exactly its surfaces.
    pub fn depth(&self) -> crate::gpu::Depth {
        crate::gpu::Depth::Equal(self.gbuffer, super::DEPTH)
    }

    /// The table of lamps; none when nothing but the surroundings shines.
    pub fn lights(&self) -> Option<Bind> {
        self.frame.lights_bind()
    }

    /// How much of each lamp that casts shadows every pixel sees: one layer each. None when no lamp casts any.
    pub fn visibility(&self, plan: &mut Plan) -> Result<Option<Bind>, Problem> {
        Ok(self.frame.visibility(plan, self.gbuffer)?.map(|slot| Bind::Texture(slot, 0)))
    }

    /// Transmitted irradiance from the surroundings at each vertex, for a normal each, as a vertex stream of `vec4f`. None
    /// when there are no surroundings.
    pub fn environment(
        &self,
        plan: &mut Plan,
        member: &Member,
        normals: Slot<Buffer>,
    ) -> Result<Option<Slot<Buffer>>, Problem> {
        self.frame.sky_irradiance(plan, self.item(member), normals)
    }

    /// The mesh's positions, as a vertex stream.
    pub fn positions(&self, plan: &mut Plan, member: &Member) -> Slot<Buffer> {
        upload::stream(plan, member.mesh, upload::Stream::Positions)
    }

    /// Whether steps that can hardly change the picture are left out.
    pub fn skips(&self) -> bool {
        self.frame.view.skip
    }

    /// The mesh's own normals, as a vertex stream.
    pub fn normals(&self, plan: &mut Plan, member: &Member) -> Slot<Buffer> {
        upload::stream(plan, member.mesh, upload::Stream::Normals)
    }

    /// The surroundings as 16 lamps far away, a list of `SkyLamp`: where each is, how far it spreads, and its irradiance on a
    /// plane that faces it. None when there are no surroundings.
    pub fn sky_lamps(&self, plan: &mut Plan) -> Option<Bind> {
        self.frame.sky_lamps(plan).map(Bind::Buffer)
    }

    /// Which share of each of these lamps reaches each vertex of a member: four vertex streams of `vec4f`.
    pub fn sky_shares(&self, plan: &mut Plan, member: &Member) -> Result<Vec<Slot<Buffer>>, Problem> {
        self.frame.sky_shares(plan, self.item(member))
    }

    /// How many things the table of [`Surface::objects`] has.
    pub fn places(&self) -> usize {
        self.frame.items.len()
    }

    /// A vector per vertex, as a vertex stream.
    pub fn upload<T: bytemuck::Pod + Send + Sync>(&self, plan: &mut Plan, vectors: Slot<Vec<T>>) -> Slot<Buffer> {
        upload::list(plan, vectors, "a vector per vertex")
    }

    /// The member, to be drawn with the given streams after its positions.
    pub fn draw(&self, plan: &mut Plan, member: &Member, streams: Vec<Slot<Buffer>>) -> Draw {
        let mut all = vec![upload::stream(plan, member.mesh, upload::Stream::Positions)];
        all.extend(streams);
        Draw {
            streams: all,
            indices: upload::stream(plan, member.mesh, upload::Stream::Indices),
            instance: member.place as u32,
        }
    }

    /// Several pictures of which each is 0 where the others' objects are.
    pub fn merge(&self, plan: &mut Plan, pictures: &[Slot<Images>]) -> Result<Option<Slot<Images>>, Problem> {
        self.frame.merge(plan, pictures)
    }

    pub(super) fn item(&self, member: &Member) -> &'a Item {
        &self.frame.items[member.place]
    }
}

/// An image as materials use it: as a colour, or as one number.
pub(super) type Use<'a> = (&'a TextureMap, Option<AsNumber>);

/// The textures of all materials in the picture, in the order in which objects name them.
pub(super) fn maps<'a>(frame: &'a Frame) -> Vec<Use<'a>> {
    let mut found: Vec<Use> = Vec::new();
    for material in frame.items.iter().filter(|item| item.in_view).filter_map(|item| frame.material(item)) {
        let surface = &material.surface;
        let color = if let Varying::Texture(map) = &surface.color { Some((map.as_ref(), None)) } else { None };
        let roughness = match &surface.roughness {
            Varying::Texture(map) => Some((map.as_ref(), Some(map.as_number()))),
            Varying::Constant(_) => None,
        };
        for map in [color, roughness].into_iter().flatten() {
            if !found.contains(&map) {
                found.push(map);
            }
        }
    }
    found
}

/// A map's layer in the array of textures; -1 for one that no object in view names.
pub(super) fn layer_of(maps: &[Use], wanted: Use) -> i32 {
    maps.iter().position(|other| *other == wanted).map_or(-1, |layer| layer as i32)
}

/// The array of textures; none when no material in view has any.
pub(super) fn textures(frame: &Frame, plan: &mut Plan) -> Option<Slot<Images>> {
    let maps: Vec<(Slot<Texture>, Option<AsNumber>)> = maps(frame)
        .into_iter()
        .map(|(map, number)| {
            let about = map.path.display().to_string();
            (plan.given("image.file", about, Key::of(map), map.texture.clone()), number)
        })
        .collect();
    (!maps.is_empty()).then(|| plan.add(Textures { maps }))
}

/// All textures in one array: each is stretched to the size of the largest; what stands for a number has it in its first
/// channel.
#[derive(Serialize)]
struct Textures {
    maps: Vec<(Slot<Texture>, Option<AsNumber>)>,
}

/// Larger textures are shrunk to this.
const LARGEST: u32 = 4096;

impl Step for Textures {
    type Output = Images;
    fn name(&self) -> &'static str {
        "frame.textures"
    }
    fn about(&self) -> String {
        format!("{} to the device", counted(self.maps.len(), "texture"))
    }
    fn run(&self, run: &Run) -> Result<Images, Problem> {
        let maps: Vec<_> = self.maps.iter().map(|(slot, number)| (run.get(*slot), number)).collect();
        let size = |side: fn(&Texture) -> u32| maps.iter().map(|(map, _)| side(map)).max().unwrap_or(1).min(LARGEST);
        let (width, height) = (size(|map| map.width), size(|map| map.height));
        let halves: Vec<[f16; 4]> =
            maps.iter().flat_map(|(map, number)| stretched(map, **number, width, height)).collect();
        let shape = Shape::array((width, height), maps.len() as u32, Format::Rgba16Float);
        Ok(Images(vec![run.host::<Gpu>().texture_with(shape, bytemuck::cast_slice(&halves))]))
    }
}

/// Bilinear, repeating.
fn stretched(map: &Texture, number: Option<AsNumber>, width: u32, height: u32) -> Vec<[f16; 4]> {
    let place = |i: u32, to: u32, from: u32| {
        let at = (i as f32 + 0.5) * from as f32 / to as f32 - 0.5;
        let low = at.floor();
        let wrap = |i: i64| i.rem_euclid(from as i64) as u32;
        (wrap(low as i64), wrap(low as i64 + 1), at - low)
    };
    let mut texels = Vec::with_capacity((width * height) as usize);
    for y in 0..height {
        let (y0, y1, fy) = place(y, height, map.height);
        for x in 0..width {
            let (x0, x1, fx) = place(x, width, map.width);
            let texel = |x: u32, y: u32, c: usize| map.texels[(y * map.width + x) as usize][c];
            let mut values: [f32; 4] = std::array::from_fn(|c| {
                let row = |y| texel(x0, y, c) * (1.0 - fx) + texel(x1, y, c) * fx;
                row(y0) * (1.0 - fy) + row(y1) * fy
            });
            if let Some(number) = number {
                values[0] = number.of(values.map(f64::from)) as f32;
            }
            texels.push(values.map(f16::from_f32));
        }
    }
    texels
}
