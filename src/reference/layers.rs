//! Layers in space: which medium a point of a thing lies in.
//!
//! The depth of a point is its distance to the closest point of the thing's surface, and that point's texture coordinates
//! say how deep each layer reaches [Francois2006]: the point lies in the first layer that reaches deeper than it, and below
//! them all in the medium. So a layer never reaches above the one outside it. Near a flat surface this is what the paper
//! means; where surfaces curve or meet, it is what a depth below a surface can mean everywhere inside.
//!
//! Depths change no faster than places do: all points within r of a point have its depth, give or take r. That is what
//! bounds a medium over a stretch of a path ([`Strata::around`]). Lengths are scene units but in [`Layer`].

use super::world::{Matter, Medium, Thing, number};
use crate::geometry::nearest::Nearest;
use crate::optics::Rgb;
use crate::scene::Varying;
use glam::{DAffine3, DVec3};
use serde::Serialize;

/// A thing's layers as its material has them.
#[derive(Clone, Debug, Serialize)]
pub struct Layers {
    /// From the outside inwards.
    pub list: Vec<Layer>,
    pub mm_per_unit: f64,
}

/// Its medium is per scene unit, as all media of the reference are.
#[derive(Clone, Debug, Serialize)]
pub struct Layer {
    pub medium: Medium,
    /// Where it ends, mm below the surface.
    pub depth: Varying<f64>,
}

/// A thing's layers in its space, and what lies below them.
pub struct Strata {
    nearest: Nearest,
    object_from_world: DAffine3,
    layers: Layers,
    /// The layers and, last, the medium below.
    strata: Vec<Stratum>,
    /// One mean free path where it is shortest.
    finest: f64,
    /// Deeper than two mean free paths below all layers, depths are not told apart.
    deep: f64,
}

struct Stratum {
    medium: Medium,
    /// Between these depths lie all of its points.
    from: f64,
    to: f64,
}

/// What a path may meet within a radius of where it is.
pub struct Around {
    pub radius: f64,
    /// The least and the greatest extinction there.
    pub least: Rgb,
    pub most: Rgb,
}

impl Strata {
    /// None for a thing without layers.
    pub fn of(thing: &Thing) -> Option<Strata> {
        let Matter::Translucent { medium, layers: Some(layers), .. } = &thing.matter else { return None };
        let mut strata = Vec::new();
        let (mut from, mut deepest) = (f64::NEG_INFINITY, 0.0f64);
        for layer in &layers.list {
            let (low, high) = extremes(&layer.depth);
            let to = high / layers.mm_per_unit;
            strata.push(Stratum { medium: layer.medium.clone(), from, to });
            deepest = deepest.max(to);
            // What lies below begins no higher than every layer above can end.
            from = from.max(low / layers.mm_per_unit);
        }
        strata.push(Stratum { medium: medium.clone(), from, to: f64::INFINITY });
        let most = strata.iter().map(|stratum| stratum.medium.sigma_t().max_element()).fold(0.0, f64::max);
        Some(Strata {
            nearest: Nearest::new(&thing.mesh),
            object_from_world: thing.world_from_object.inverse(),
            layers: layers.clone(),
            strata,
            finest: 1.0 / most,
            deep: deepest + 2.0 / medium.sigma_t().max_element(),
        })
    }

    /// The depth of a point of the thing, or less where that is far below all layers, and the medium that it lies in.
    pub fn at(&self, thing: &Thing, p: DVec3) -> (f64, &Medium) {
        let Some(closest) = self.nearest.find(self.object_from_world.transform_point3(p), self.deep) else {
            return (self.deep, &self.strata[self.strata.len() - 1].medium);
        };
        let uv = thing.uv(closest.triangle as usize, closest.barycentrics);
        let depth_mm = closest.distance * self.layers.mm_per_unit;
        let layers = &self.layers.list;
        let place = layers.iter().position(|layer| number(&layer.depth, uv) > depth_mm).unwrap_or(layers.len());
        (closest.distance, &self.strata[place].medium)
    }

    /// What lies around a point of that depth: as far as the next change of layers, but at least a mean free path, so that
    /// paths do not creep up to a change for ever.
    pub fn around(&self, depth: f64) -> Around {
        let ends = self.strata.iter().flat_map(|stratum| [stratum.from, stratum.to]);
        let gap = ends.map(|end| (end - depth).abs()).fold(f64::INFINITY, f64::min);
        // Short of the change itself by more than a depth's rounding.
        let radius = (1.0 - 1e-9) * gap.max(self.finest);
        let mut around = Around { radius, least: Rgb::INFINITY, most: Rgb::ZERO };
        for stratum in self.strata.iter().filter(|s| s.from < depth + radius && s.to > depth - radius) {
            let sigma_t = stratum.medium.sigma_t();
            (around.least, around.most) = (around.least.min(sigma_t), around.most.max(sigma_t));
        }
        around
    }

    /// The least extinction of any channel anywhere.
    pub fn thinnest(&self) -> f64 {
        self.strata.iter().map(|stratum| stratum.medium.sigma_t().min_element()).fold(f64::INFINITY, f64::min)
    }
}

/// The least and the greatest number that a texture holds.
fn extremes(value: &Varying<f64>) -> (f64, f64) {
    match value {
        Varying::Constant(value) => (*value, *value),
        Varying::Texture(map) => {
            let (as_number, nothing) = (map.as_number(), (f64::INFINITY, f64::NEG_INFINITY));
            let numbers = map.texture.texels.iter().map(|texel| as_number.of(texel.map(f64::from)));
            numbers.fold(nothing, |(low, high), number| (low.min(number), high.max(number)))
        }
    }
}
