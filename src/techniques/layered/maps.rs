//! The depths of layers on the device: four to a texel, in order, with smaller sizes of themselves.
//!
//! In each texel a layer ends at the deepest depth of all from the outside to it. That is settled before anything is
//! filtered, and means of ordered depths are ordered: where two neighbouring texels lack a layer, nothing between them has
//! it. Depths travel as shares of the deepest that the material has; they are numbers and never colours.

use crate::gpu::{Format, Gpu, Images, Shape};
use crate::image::Texture;
use crate::problem::{Problem, counted};
use crate::scene::{AsNumber, Material, Varying};
use crate::store::{Key, Plan, Run, Slot, Step};
use half::f16;
use serde::Serialize;

/// Larger images are shrunk to this.
const LARGEST: u32 = 4096;

/// The maps of all materials in a picture.
#[derive(Default, Serialize)]
pub struct DepthMaps {
    materials: Vec<Vec<Depth>>,
}

/// Where a layer ends, as a share of the material's deepest depth.
#[derive(Clone, PartialEq, Serialize)]
enum Depth {
    Constant(f64),
    /// An image, how its texels are numbers, and what 1 stands for.
    Image(Slot<Texture>, AsNumber, f64),
}

/// The deepest depth that any layer can have, mm.
pub fn deepest(material: &Material) -> f64 {
    let most = |depth: &Varying<f64>| match depth {
        Varying::Constant(depth) => *depth,
        Varying::Texture(map) => map.range.0.max(map.range.1),
    };
    material.layers.iter().map(|layer| most(&layer.depth)).fold(0.0, f64::max)
}

/// How many maps hold a material's layers.
fn maps_of(layers: &[Depth]) -> usize {
    layers.len().div_ceil(4)
}

impl DepthMaps {
    /// The place of a material's first map; -1 where all its depths are constant.
    pub fn add(&mut self, plan: &mut Plan, material: &Material) -> i32 {
        if !material.layers.iter().any(|layer| matches!(layer.depth, Varying::Texture(_))) {
            return -1;
        }
        let deepest = deepest(material).max(f64::MIN_POSITIVE);
        let mut depth = |depth: &Varying<f64>| match depth {
            Varying::Constant(depth) => Depth::Constant(depth / deepest),
            Varying::Texture(map) => {
                let about = map.path.display().to_string();
                let texture = plan.given("image.file", about, Key::of(map.as_ref()), map.texture.clone());
                Depth::Image(texture, map.as_number(), deepest)
            }
        };
        let layers: Vec<Depth> = material.layers.iter().map(|layer| depth(&layer.depth)).collect();
        let place = self.materials.iter().position(|other| *other == layers).unwrap_or_else(|| {
            self.materials.push(layers);
            self.materials.len() - 1
        });
        self.materials[..place].iter().map(|layers| maps_of(layers)).sum::<usize>() as i32
    }

    /// All of them in one array, each stretched to the size of the largest image. None where no depth is an image.
    pub fn upload(self, plan: &mut Plan) -> Option<Slot<Images>> {
        (!self.materials.is_empty()).then(|| plan.add(self))
    }
}

impl Step for DepthMaps {
    type Output = Images;
    fn name(&self) -> &'static str {
        "layered.maps"
    }
    fn about(&self) -> String {
        let layers: usize = self.materials.iter().map(Vec::len).sum();
        format!("where {} end, to the device", counted(layers, "layer"))
    }
    fn run(&self, run: &Run) -> Result<Images, Problem> {
        let read = |depth: &Depth| match depth {
            Depth::Constant(share) => Read::Constant(*share),
            Depth::Image(slot, number, deepest) => Read::Image(run.get(*slot), *number, *deepest),
        };
        let materials: Vec<Vec<Read>> = self.materials.iter().map(|layers| layers.iter().map(read).collect()).collect();
        let images = || materials.iter().flatten().filter_map(Read::image);
        let side = |side: fn(&Texture) -> u32| images().map(side).max().unwrap_or(1).clamp(1, LARGEST);
        let (width, height) = (side(|image| image.width), side(|image| image.height));
        let mut level: Vec<Map> = materials.iter().flat_map(|layers| ordered(layers, width, height)).collect();
        let shape = Shape::array((width, height), level.len() as u32, Format::Rgba16Float).with_mips();
        let mut halves: Vec<[f16; 4]> = Vec::new();
        for next in 1..=shape.levels {
            halves.extend(level.iter().flat_map(|map| &map.texels).map(|texel| texel.map(f16::from_f32)));
            if next < shape.levels {
                level = level.iter().map(|map| map.shrunk(shape.level(next))).collect();
            }
        }
        Ok(Images(vec![run.host::<Gpu>().texture_with(shape, bytemuck::cast_slice(&halves))]))
    }
}

enum Read {
    Constant(f64),
    Image(std::sync::Arc<Texture>, AsNumber, f64),
}

impl Read {
    fn image(&self) -> Option<&Texture> {
        match self {
            Read::Constant(_) => None,
            Read::Image(image, ..) => Some(image),
        }
    }

    /// At the middle of a texel of a map of that size: bilinear, repeating.
    fn at(&self, (x, y): (u32, u32), (width, height): (u32, u32)) -> f64 {
        let (image, number, deepest) = match self {
            Read::Constant(share) => return *share,
            Read::Image(image, number, deepest) => (image, number, deepest),
        };
        let place = |i: u32, to: u32, from: u32| {
            let at = (f64::from(i) + 0.5) * f64::from(from) / f64::from(to) - 0.5;
            let wrap = |i: f64| i.rem_euclid(f64::from(from)) as u32;
            (wrap(at.floor()), wrap(at.floor() + 1.0), at - at.floor())
        };
        let ((x0, x1, fx), (y0, y1, fy)) = (place(x, width, image.width), place(y, height, image.height));
        let texel = |x: u32, y: u32, c: usize| f64::from(image.texels[(y * image.width + x) as usize][c]);
        let mean = |c: usize| {
            let row = |y| texel(x0, y, c) * (1.0 - fx) + texel(x1, y, c) * fx;
            row(y0) * (1.0 - fy) + row(y1) * fy
        };
        number.of(std::array::from_fn(mean)) / deepest
    }
}

/// Four layers' depths in each texel.
struct Map {
    width: u32,
    height: u32,
    texels: Vec<[f32; 4]>,
}

/// A material's maps, with every layer at least as deep as the one outside it.
fn ordered(layers: &[Read], width: u32, height: u32) -> Vec<Map> {
    let empty = || Map { width, height, texels: Vec::with_capacity((width * height) as usize) };
    let mut maps: Vec<Map> = (0..layers.len().div_ceil(4)).map(|_| empty()).collect();
    for i in 0..width * height {
        let mut deepest = 0f64;
        for (map, four) in maps.iter_mut().zip(layers.chunks(4)) {
            let mut texel = [0.0; 4];
            for (value, layer) in texel.iter_mut().zip(four) {
                deepest = deepest.max(layer.at((i % width, i / width), (width, height)));
                *value = deepest as f32;
            }
            map.texels.push(texel);
        }
    }
    maps
}

impl Map {
    /// Each texel the mean of those that it covers.
    fn shrunk(&self, (width, height): (u32, u32)) -> Map {
        let range = |i: u32, to: u32, from: u32| i * from / to..((i + 1) * from).div_ceil(to).min(from);
        let texel = |i: u32| {
            let (mut sum, mut count) = ([0f64; 4], 0.0);
            for y in range(i / width, height, self.height) {
                for x in range(i % width, width, self.width) {
                    let texel = self.texels[(y * self.width + x) as usize];
                    sum = std::array::from_fn(|c| sum[c] + f64::from(texel[c]));
                    count += 1.0;
                }
            }
            sum.map(|v| (v / count) as f32)
        };
        Map { width, height, texels: (0..width * height).map(texel).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Channel, Encoding};
    use crate::scene::TextureMap;
    use std::sync::Arc;

    fn red() -> AsNumber {
        let map = TextureMap {
            path: "depth.png".into(),
            key: Key::of(&0),
            encoding: Encoding::Linear,
            channel: Channel::R,
            range: (0.0, 1.0),
            invert: false,
            texture: Arc::default(),
        };
        map.as_number()
    }

    #[test]
    fn layers_are_in_order_at_every_size_and_none_appears_between_texels() {
        // Five layers over a chequered image that contradicts itself.
        let image = |f: fn(u32) -> f32| {
            let texels = (0..48).map(|i| [f(i), 0.0, 0.0, 1.0]).collect();
            Read::Image(Arc::new(Texture { width: 8, height: 6, texels }), red(), 1.0)
        };
        let layers = [
            Read::Constant(0.2),
            image(|i| if i % 8 < 4 { 0.1 } else { 0.6 }),
            Read::Constant(0.4),
            image(|i| (i % 7) as f32 / 6.0),
            Read::Constant(0.5),
        ];
        let maps = ordered(&layers, 8, 6);
        assert_eq!(maps.len(), 2);
        let mut level: Vec<Map> = maps;
        for size in [(8, 6), (4, 3), (2, 1), (1, 1)] {
            level = level.iter().map(|map| map.shrunk(size)).collect();
            for (a, b) in level[0].texels.iter().zip(&level[1].texels) {
                assert!(a.is_sorted() && a[3] <= b[0], "{a:?} {b:?}");
            }
        }
        // On the left the second layer ends above the first: it is not there, at any size that knows only the left.
        let left = ordered(&layers, 8, 6)[0].shrunk((4, 3));
        assert_eq!(left.texels[0][0], left.texels[0][1]);
        let right = &left.texels[3];
        assert!((right[1] - 0.6).abs() < 1e-6 && right[2] == right[1]);
    }
}
