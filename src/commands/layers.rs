use super::look::parse_size;
use super::progress::seconds;
use super::{Answer, counted};
use crate::geometry::depth_map::depth_map;
use crate::geometry::mesh::Mesh;
use crate::geometry::normals::Normals;
use crate::geometry::obj::read_obj;
use crate::image::{Display, Format, Image, Tone, write_file};
use crate::problem::{At, Cause, Problem, Problems};
use crate::store::Files;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Paint how deep meshes lie below another one, for a material's `layers`: by rays along its normals
#[derive(clap::Args)]
pub struct Layers {
    /// The mesh that is seen, with texture coordinates: .obj
    outer: PathBuf,
    /// Up to three meshes within it, from the outside inwards, one for each layer's end: red, green, blue
    #[arg(required = true, num_args = 1..=3, value_name = "INNER")]
    inner: Vec<PathBuf>,
    /// The image to write, .png (256 levels) or .exr
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Texels
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = parse_size)]
    size: (u32, u32),
    /// How long a unit of the meshes is
    #[arg(long, value_name = "MM", default_value_t = 1.0, value_parser = above_0)]
    mm_per_unit: f64,
    /// What white stands for, mm, and how deep a layer is where there is no end of it; else the deepest that was met
    #[arg(long, value_name = "MM", value_parser = above_0)]
    deepest: Option<f64>,
}

fn above_0(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().map_err(|_| "a number above 0 is expected".to_string())?;
    if number > 0.0 && number.is_finite() { Ok(number) } else { Err("it must be above 0".into()) }
}

impl Layers {
    pub fn run(self) -> Result<Answer, Problems> {
        let started = Instant::now();
        let format = Format::of(&self.output)?;
        let files = Files::default();
        let mut warnings = Vec::new();
        let mut read = |path: &Path| -> Result<Mesh, Problem> {
            let file = files.read(path).map_err(|error| {
                Problem::files(format!("the mesh cannot be read: {error}")).at(At::file(path)).hint("name an .obj file")
            })?;
            let (mesh, told) = read_obj(&file.bytes, path)?;
            warnings.extend(told);
            Ok(mesh.with_normals(Normals::Auto))
        };
        let outer = read(&self.outer)?;
        if outer.uvs.is_empty() {
            let problem = Problem::files("this mesh has no texture coordinates to paint in").at(At::file(&self.outer));
            return Err(problem.hint("unwrap it: lines `vt`, and faces `f 1/1 2/2 3/3`").into());
        }
        let mut maps = Vec::new();
        for path in &self.inner {
            let map = depth_map(&outer, &read(path)?, self.size, &|_| Ok(()))?;
            maps.push(map.ok_or_else(|| {
                Problem::files("its faces cover no texel of the map").at(At::file(&self.outer)).hint("a larger --size")
            })?);
        }
        let met = maps.iter().flatten().filter(|depth| depth.is_finite()).fold(0.0, |most: f64, d| most.max(*d));
        if met == 0.0 {
            let problem = Problem::files("no ray inwards meets it").at(At::file(&self.inner[0]));
            return Err(problem.hint("inner meshes lie inside the outer one, in the same space and unit").into());
        }
        let deepest = self.deepest.unwrap_or(met * self.mm_per_unit);
        let texel = |i: usize| {
            std::array::from_fn(|c| maps.get(c).map_or(1.0, |map| share(map[i] * self.mm_per_unit, deepest)))
        };
        let (width, height) = self.size;
        let image = Image { width, height, pixels: (0..(width * height) as usize).map(texel).collect() };
        // Depths are numbers: no curve.
        let display = Display { tone: Tone::Clamp, exposure_ev: 0.0 };
        write_file(&self.output, &image.encode(format, display, &[])?)
            .map_err(|problem| Problem { cause: Cause::Unfinished, ..problem })?;
        let file = self.output.display().to_string();
        let channels = ["R", "G", "B"];
        let ron: Vec<String> = channels[..maps.len()]
            .iter()
            .map(|channel| format!("depth: Texture(image: {file:?}, channel: {channel}, range: (0.0, {deepest:.6}))"))
            .collect();
        let text = format!(
            "{file}  {}, up to {deepest:.3} mm deep  {}\n{}\n",
            counted(maps.len(), "layer"),
            seconds(started.elapsed()),
            ron.join("\n")
        );
        let facts = json!({
            "file": file,
            "size": [width, height],
            "deepest_mm": deepest,
            "depths": ron,
            "seconds": started.elapsed().as_secs_f64(),
        });
        Ok(Answer::new(text, facts).warn(warnings))
    }
}

/// Where a ray met nothing the layer goes as deep as any.
fn share(depth: f64, deepest: f64) -> f32 {
    (depth / deepest).min(1.0) as f32
}
