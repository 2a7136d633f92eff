//! Meshes, lists and pictures on the device.

use crate::geometry::mesh::Mesh;
use crate::gpu::{Buffer, Format, Gpu, Images, Shape};
use crate::image::Image;
use crate::problem::Problem;
use crate::store::{Plan, Run, Slot, Step};
use serde::Serialize;

/// One stream of a mesh, on the device.
#[derive(Serialize)]
struct Upload {
    mesh: Slot<Mesh>,
    stream: Stream,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(super) enum Stream {
    Positions,
    Normals,
    Uvs,
    Indices,
}

impl Step for Upload {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        format!("{:?} to the device", self.stream).to_lowercase()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let mesh = run.get(self.mesh);
        let gpu: &Gpu = run.host();
        Ok(match self.stream {
            Stream::Positions => Buffer::new(gpu, bytemuck::cast_slice(&mesh.positions)),
            Stream::Normals => Buffer::new(gpu, bytemuck::cast_slice(&mesh.normals)),
            // A mesh without texture coordinates shows one texel.
            Stream::Uvs if mesh.uvs.is_empty() => Buffer::new(gpu, &vec![0; 8 * mesh.positions.len()]),
            Stream::Uvs => Buffer::new(gpu, bytemuck::cast_slice(&mesh.uvs)),
            Stream::Indices => Buffer::new(gpu, bytemuck::cast_slice(&mesh.triangles)),
        })
    }
}

pub(super) fn stream(plan: &mut Plan, mesh: Slot<Mesh>, stream: Stream) -> Slot<Buffer> {
    plan.add(Upload { mesh, stream })
}

/// A list, on the device as it is.
#[derive(Serialize)]
#[serde(bound = "")]
struct UploadList<T> {
    list: Slot<Vec<T>>,
    #[serde(skip)]
    about: &'static str,
}

impl<T: bytemuck::Pod + Send + Sync> Step for UploadList<T> {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        format!("{} to the device", self.about)
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        Ok(Buffer::new(run.host::<Gpu>(), bytemuck::cast_slice(run.get(self.list).as_slice())))
    }
}

pub(super) fn list<T>(plan: &mut Plan, list: Slot<Vec<T>>, about: &'static str) -> Slot<Buffer>
where
    T: bytemuck::Pod + Send + Sync,
{
    plan.add(UploadList { list, about })
}

/// A picture that was made elsewhere, on the device as if it had been drawn there.
#[derive(Serialize)]
struct UploadPicture {
    picture: Slot<Image>,
}

impl Step for UploadPicture {
    type Output = Images;
    fn name(&self) -> &'static str {
        "gpu.upload"
    }
    fn about(&self) -> String {
        "the picture to the device".into()
    }
    fn run(&self, run: &Run) -> Result<Images, Problem> {
        let picture = run.get(self.picture);
        let texels: Vec<[f32; 4]> = picture.pixels.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]).collect();
        let shape = Shape::flat((picture.width, picture.height), Format::Rgba32Float);
        Ok(Images(vec![run.host::<Gpu>().texture_with(shape, bytemuck::cast_slice(&texels))]))
    }
}

pub(crate) fn picture(plan: &mut Plan, picture: Slot<Image>) -> Slot<Images> {
    plan.add(UploadPicture { picture })
}
