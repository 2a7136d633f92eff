//! What this room needs of image and geometry.

use crate::problem::{At, Problem};
use crate::store::File;
use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::path::Path;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub fn is_closed(&self) -> bool {
        let mut edges = std::collections::BTreeMap::new();
        for t in &self.triangles {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
            }
        }
        !self.triangles.is_empty() && edges.values().all(|n| *n == 0)
    }
    /// Longest side of the axis-aligned box.
    pub fn extent(&self) -> f64 {
        let min = self.positions.iter().fold(Vec3::INFINITY, |m, p| m.min(*p));
        let max = self.positions.iter().fold(Vec3::NEG_INFINITY, |m, p| m.max(*p));
        f64::from((max - min).max_element())
    }
}

pub fn read_obj(file: &File) -> Result<(Mesh, Vec<Problem>), Problem> {
    let text = String::from_utf8_lossy(&file.bytes);
    let mut mesh = Mesh::default();
    for (line, words) in text.lines().map(|l| l.split_whitespace().collect::<Vec<_>>()).enumerate() {
        let bad = |what: &str| Problem::files(format!("line {}: {what}", line + 1)).at(At::file(&file.path));
        match words.as_slice() {
            ["v", x, y, z, ..] => {
                let number = |w: &str| w.parse::<f32>().map_err(|_| bad("not a number"));
                mesh.positions.push(Vec3::new(number(x)?, number(y)?, number(z)?));
            }
            ["f", a, b, c] => {
                let index = |w: &str| {
                    let i = w.split('/').next().and_then(|w| w.parse::<u32>().ok());
                    i.and_then(|i| i.checked_sub(1)).ok_or_else(|| bad("not an index"))
                };
                mesh.triangles.push([index(a)?, index(b)?, index(c)?]);
            }
            _ => {}
        }
    }
    Ok((mesh, Vec::new()))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Encoding {
    Srgb,
    Linear,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Channel {
    #[default]
    R,
    G,
    B,
    A,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tone {
    Clamp,
    #[default]
    Srgb,
    Filmic,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Texture {
    pub width: u32,
    pub height: u32,
    pub texels: Vec<[f32; 4]>,
}

impl Texture {
    pub fn check(&self, _: &Path) -> Vec<Problem> {
        Vec::new()
    }
}

pub fn decode(bytes: &[u8], file: &Path, _: Encoding) -> Result<Texture, Problem> {
    match ::image::load_from_memory(bytes) {
        Ok(image) => Ok(Texture { width: image.width(), height: image.height(), texels: Vec::new() }),
        Err(e) => Err(Problem::files(format!("the image is damaged or cut short: {e}")).at(At::file(file))),
    }
}
