//! What this room needs of image and geometry.

pub use crate::geometry::mesh::Mesh;
pub use crate::image::{Channel, Encoding, Texture, Tone, decode};

use crate::geometry::obj;
use crate::problem::Problem;
use crate::store::File;

/// A mesh with normals, and what had to be mended.
pub fn read_obj(file: &File) -> Result<(Mesh, Vec<Problem>), Problem> {
    obj::read_obj(&file.bytes, &file.path)
}
