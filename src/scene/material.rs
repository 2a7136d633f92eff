//! What a substance is: its surface, its medium, its layers, and the kernel that the artist wants for it.

use crate::optics::Rgb;
use crate::optics::medium::Medium;
use crate::optics::phase::Phase;
use crate::optics::profile::Model;
use crate::problem::Problem;
use crate::scene::fields::{Spec, TextureSpec, Triple};
use crate::scene::material_file::{Curve, Filter, LayerSpec, MaterialFile};
use crate::scene::meaning::Judge;
use crate::scene::medium::{MediumSpec, Substance};
use crate::scene::outside::{Channel, Encoding, Texture};
use crate::scene::path::join;
use crate::scene::reader::Reader;
use crate::scene::tree::Node;
use crate::store::Key;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

/// What scatters light in nature has a handful; what each comes to takes milliseconds to find out.
const MAX_LAYERS: usize = 64;

/// A valid material. Two are equal when nothing that is rendered from them can differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Material {
    pub surface: Surface,
    pub medium: Substance,
    /// Of the light that enters at normal incidence, the share that leaves again: that of the medium under its boundary,
    /// or of the paint.
    pub albedo: Rgb,
    /// How the file spelled the medium.
    pub spelled: MediumSpec,
    pub phase: Phase,
    pub profile: Model,
    pub filter: Filter,
    /// From the outside inwards; below the last lies `medium`.
    pub layers: Vec<Layer>,
    #[serde(skip)]
    pub(super) written: Written,
}

/// Where each field of a material was written. It changes nothing that is rendered, so any two are equal.
#[derive(Clone)]
pub(super) struct Written(Arc<Node>);

impl PartialEq for Written {
    fn eq(&self, _: &Written) -> bool {
        true
    }
}

impl std::fmt::Debug for Written {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.0.source.file.display())
    }
}

impl Material {
    /// A problem with the field at `path`, `filter` or `surface.roughness`, told where it was written.
    pub fn problem(&self, path: &str, what: impl Into<String>) -> Problem {
        Problem::files(what).at(self.written.0.nearest(path).at()).path(path)
    }
}

/// A dielectric boundary.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Surface {
    /// Inside over outside, [1, 4]; 1 is index-matched and reflects nothing.
    pub ior: f64,
    /// Perceptual, [0, 1]; 0 is smooth.
    pub roughness: Varying<f64>,
    /// Multiplies the scattered light once, where it leaves. [0, 1], linear.
    pub color: Varying<Rgb>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Layer {
    pub name: String,
    pub medium: Medium,
    pub phase: Phase,
    /// Where it ends, mm below the surface.
    pub depth: Varying<f64>,
}

/// The same everywhere, or as an image says.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Varying<T> {
    Constant(T),
    Texture(Arc<TextureMap>),
}

impl<T> Varying<T> {
    /// The image, where one says.
    pub fn map(&self) -> Option<&TextureMap> {
        match self {
            Varying::Constant(_) => None,
            Varying::Texture(map) => Some(map),
        }
    }
}

/// An image file and how its values are meant.
#[derive(Clone, Debug, Serialize)]
pub struct TextureMap {
    pub path: PathBuf,
    pub key: Key,
    pub encoding: Encoding,
    /// For one number: the channel that holds it, what its 0 and 1 stand for, and whether it is 1 minus the image's.
    pub channel: Channel,
    pub range: (f64, f64),
    pub invert: bool,
    /// Decoded to linear values.
    #[serde(skip)]
    pub texture: Arc<Texture>,
}

/// How a texel's four values are one number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AsNumber {
    channel: Channel,
    range: (f64, f64),
    invert: bool,
}

impl AsNumber {
    pub fn of(&self, texel: [f64; 4]) -> f64 {
        let value = texel[match self.channel {
            Channel::R => 0,
            Channel::G => 1,
            Channel::B => 2,
            Channel::A => 3,
        }];
        let share = if self.invert { 1.0 - value } else { value };
        self.range.0 + (self.range.1 - self.range.0) * share
    }
}

impl TextureMap {
    pub fn as_number(&self) -> AsNumber {
        AsNumber { channel: self.channel, range: self.range, invert: self.invert }
    }
}

impl PartialEq for TextureMap {
    fn eq(&self, other: &TextureMap) -> bool {
        let rest = |t: &TextureMap| (t.key, t.encoding, t.channel, t.range, t.invert);
        rest(self) == rest(other)
    }
}

/// The material that `file` spells, when it means something; `judge` holds what is wrong.
pub fn build(file: &MaterialFile, reader: &Reader, judge: &mut Judge<'_>) -> Option<Material> {
    let medium = &file.medium;
    medium.check(judge, "medium");
    let ior = file.surface.ior.unwrap_or(medium.default_ior());
    judge.all("surface.ior", &[ior], |v| (1.0..=4.0).contains(&v), "from 1 (index-matched) to 4");
    check_filter(&file.filter, judge);
    if medium.is_opaque() && !file.layers.is_empty() {
        let what = "layers lie over a translucent medium, but this medium is Opaque";
        judge.wrong("layers", what, "give the medium coefficients, or take the layers away");
    }
    let share = |v: f64| (0.0..=1.0).contains(&v);
    let roughness = match &file.surface.roughness {
        Spec::Constant(value) => {
            judge.all("surface.roughness", &[*value], share, "from 0 (smooth) to 1");
            Some(Varying::Constant(*value))
        }
        Spec::Texture(spec) => {
            texture("surface.roughness", spec, Encoding::Linear, &share, "from 0 to 1", reader, judge)
                .map(Varying::Texture)
        }
    };
    let color = match &file.surface.color {
        Spec::Constant(Triple(value)) => {
            judge.all("surface.color", value, share, "from 0 to 1");
            Some(Varying::Constant(Rgb::from(*value)))
        }
        Spec::Texture(spec) => {
            texture("surface.color", spec, Encoding::Srgb, &share, "from 0 to 1", reader, judge).map(Varying::Texture)
        }
    };
    let depths = depths(file, reader, judge);
    if judge.problems.iter().any(Problem::is_error) {
        return None;
    }
    let phase = file.phase.unwrap_or(medium.default_phase());
    let substance = dense_enough("medium", medium.resolve(ior, phase), judge)?;
    let layers = file.layers.iter().zip(depths).enumerate().map(|(i, (layer, depth))| {
        let phase = layer_phase(layer, file);
        match dense_enough(&format!("layers[{i}].medium"), layer.medium.resolve(ior, phase), judge)? {
            Substance::Translucent(medium) => {
                Some(Layer { name: layer.name.clone().unwrap_or_else(|| layer_name(i)), medium, phase, depth: depth? })
            }
            Substance::Opaque { .. } => None,
        }
    });
    Some(Material {
        layers: layers.collect::<Option<_>>()?,
        written: Written(Arc::new(judge.root.clone())),
        surface: Surface { ior, roughness: roughness?, color: color? },
        albedo: match &substance {
            Substance::Translucent(medium) => medium.multiple_scattering_albedo(ior),
            Substance::Opaque { albedo } => *albedo,
        },
        medium: substance,
        spelled: medium.clone(),
        phase,
        profile: file.profile,
        filter: file.filter.clone(),
    })
}

/// A mean free path so short that its coefficients are no numbers any more.
fn dense_enough(path: &str, substance: Substance, judge: &mut Judge<'_>) -> Option<Substance> {
    match &substance {
        Substance::Translucent(m) if !(m.sigma_t() + m.sigma_tr() + m.g).is_finite() => {
            judge.wrong(path, "this medium is too dense to compute with", "a longer mean free path: it is in mm");
            None
        }
        _ => Some(substance),
    }
}

/// A layer's own, else its preset's, else the material's.
fn layer_phase(layer: &LayerSpec, file: &MaterialFile) -> Phase {
    let preset = matches!(layer.medium, MediumSpec::Preset(_)).then(|| layer.medium.default_phase());
    layer.phase.or(preset).or(file.phase).unwrap_or(file.medium.default_phase())
}

/// The file with what it leaves to others filled in: `diaphane check --defaults`.
pub fn complete(file: &MaterialFile) -> MaterialFile {
    let mut file = file.clone();
    file.base = None;
    file.surface.ior.get_or_insert(file.medium.default_ior());
    let phases: Vec<Phase> = file.layers.iter().map(|layer| layer_phase(layer, &file)).collect();
    for (i, (layer, phase)) in file.layers.iter_mut().zip(phases).enumerate() {
        layer.name.get_or_insert(layer_name(i));
        layer.phase = Some(phase);
    }
    file.phase.get_or_insert(file.medium.default_phase());
    file
}

fn layer_name(i: usize) -> String {
    format!("layer {i}")
}

/// Where each layer ends; `None` where that is wrong.
fn depths(file: &MaterialFile, reader: &Reader, judge: &mut Judge<'_>) -> Vec<Option<Varying<f64>>> {
    if file.layers.len() > MAX_LAYERS {
        let what = format!("{} layers are too many", file.layers.len());
        judge.wrong("layers", what, format!("at most {MAX_LAYERS}"));
        return Vec::new();
    }
    let mut names = BTreeSet::new();
    let mut deepest: Option<f64> = None;
    let mut out = Vec::new();
    for (i, layer) in file.layers.iter().enumerate() {
        if judge.full() {
            break;
        }
        let path = format!("layers[{i}]");
        let LayerSpec { name, medium, depth, .. } = layer;
        let name = name.clone().unwrap_or_else(|| layer_name(i));
        judge.name(&path, &name, &mut names);
        let medium_path = join(&path, "medium");
        medium.check(judge, &medium_path);
        if medium.is_opaque() {
            judge.wrong(
                &medium_path,
                "a layer cannot be Opaque",
                "give it coefficients; a floor is a material of its own",
            );
        }
        let depth_path = join(&path, "depth");
        let depth = match depth {
            Spec::Constant(depth) => {
                judge.all(&depth_path, &[*depth], |v| v >= 0.0, "mm below the surface, 0 or more");
                match deepest {
                    Some(above) if *depth <= above => judge.wrong(
                        &depth_path,
                        format!("this layer ends at {depth} mm, not below the one above it, which ends at {above} mm"),
                        "layers go from the outside inwards; depths count from the surface",
                    ),
                    _ => deepest = Some(*depth),
                }
                Some(Varying::Constant(*depth))
            }
            Spec::Texture(spec) => {
                if spec.encoding == Some(Encoding::Srgb) {
                    judge.wrong(&join(&depth_path, "encoding"), "depths are linear", "leave out the encoding");
                }
                let spec = TextureSpec { encoding: Some(Encoding::Linear), ..spec.clone() };
                let map = texture(&depth_path, &spec, Encoding::Linear, &|v| v >= 0.0, "mm, 0 or more", reader, judge);
                map.map(Varying::Texture)
            }
        };
        out.push(depth);
    }
    out
}

/// Reads the image that stands for the value at `path`; its range is `allowed`.
fn texture(
    path: &str,
    spec: &TextureSpec,
    default: Encoding,
    allowed: &dyn Fn(f64) -> bool,
    range: &str,
    reader: &Reader,
    judge: &mut Judge<'_>,
) -> Option<Arc<TextureMap>> {
    let encoding = spec.encoding.unwrap_or(default);
    judge.all(&join(path, "range"), &[spec.range.0, spec.range.1], allowed, range);
    let image_path = join(path, "image");
    let node = judge.root.nearest(&image_path);
    match reader.texture(node, &spec.image, encoding) {
        Ok((texture, file, warnings)) => {
            warnings.into_iter().for_each(|w| judge.found(&image_path, w));
            let TextureSpec { channel, range, invert, .. } = spec.clone();
            Some(Arc::new(TextureMap { path: file.path, key: file.key, encoding, channel, range, invert, texture }))
        }
        Err(problem) => {
            judge.found(&image_path, problem);
            None
        }
    }
}

fn check_filter(filter: &Filter, judge: &mut Judge<'_>) {
    let mut lengths = |name: &str, values: &[f64], range: &str| {
        judge.all(&join("filter", name), values, |v| v >= 0.0, range);
    };
    match filter {
        Filter::Neighbours(k) => {
            lengths("sigma_tr", &k.sigma_tr.0, "1/mm, 0 or more");
            judge.all("filter.radius", &[k.radius], |v| v > 0.0, "mm, above 0");
            judge.all("filter.alpha", &[k.alpha], |v| (0.0..=1.0).contains(&v), "from 0 to 1");
        }
        Filter::Gaussian(k) => lengths("width", &k.width.0, "mm, 0 or more"),
        Filter::Exponential(k) => lengths("width", &k.width.0, "mm, 0 or more"),
        Filter::Diffusion(k) => lengths("time_mm2", &k.time_mm2.0, "mm², 0 or more"),
        Filter::Box(k) => judge.all("filter.wavelength", &k.wavelength.0, |v| v > 0.0, "mm, above 0"),
        Filter::Normalized(k) => judge.all("filter.std", &k.std.0, |v| v > 0.0, "a share of the mesh's axis, above 0"),
        Filter::Curve(k) => check_curve(k, judge),
        Filter::FromMedium(_) => {}
    }
}

fn check_curve(curve: &Curve, judge: &mut Judge<'_>) {
    if curve.points.is_empty() {
        judge.wrong("filter.points", "a curve needs points", "points: [(omega, weight), …], omega in rad/mm");
    }
    let mut last = -1.0;
    for (i, (omega, _)) in curve.points.iter().enumerate() {
        if judge.full() {
            break;
        }
        let path = format!("filter.points[{i}].0");
        judge.all(&path, &[*omega], |v| v >= 0.0, "rad/mm, 0 or more");
        if *omega >= 0.0 && *omega <= last {
            judge.wrong(&path, format!("{omega} does not lie above {last}"), "list the points by ascending omega");
        }
        last = last.max(*omega);
    }
}
