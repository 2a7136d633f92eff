//! A small vocabulary over wgpu: a device, checked shaders, and passes that are values to be filled in.
//!
//! ```no_run
//! # use diaphane::gpu::{Bind, Format, Fullscreen, Images, Shaders};
//! # use diaphane::store::{Plan, Slot};
//! # fn example(plan: &mut Plan, shaders: &Shaders, picture: Slot<Images>) -> Result<Slot<Images>, diaphane::problem::Problem> {
//! let blurred = plan.add(Fullscreen {
//!     name: "example.blur",
//!     about: "the picture, blurred".into(),
//!     shader: shaders.load("example/blur.wgsl", &[])?,
//!     size: (960, 540),
//!     targets: vec![Format::Rgba16Float],
//!     binds: vec![("picture", Bind::Texture(picture, 0))],
//! });
//! # Ok(blurred) }
//! ```
//!
//! Re-runs when: a pass's shader text, uniforms, inputs or size change.

mod bind;
mod device;
mod look;
mod pass;
mod shader;
mod texture;

pub use bind::{Bind, Sampler, Uniform};
pub use device::{Gpu, adapters, how_to_get_an_adapter, is_software};
pub use look::Texel;
pub use pass::{Blend, Compute, Count, Cover, Depth, Dispatch, Dispatches, Draw, Fullscreen, Layer, Raster};
pub use shader::{Shader, Shaders};
pub use texture::{Format, Shape, Texture};

/// What a pass draws: its targets in their order, then its depth map.
pub struct Images(pub Vec<Texture>);

/// Bytes on the device.
pub struct Buffer {
    pub buffer: wgpu::Buffer,
    /// How many of them are content; the buffer itself may be longer, and what a shader's `arrayLength` says is rounded up
    /// and, where vertices may lie in it, a word more.
    pub bytes: u64,
    /// Which 4-byte words of an element are floats, where a shader made it.
    is_float: Option<Vec<bool>>,
}

impl Buffer {
    /// Vertices, indices or storage.
    pub fn new(gpu: &Gpu, bytes: &[u8]) -> Buffer {
        use wgpu::BufferUsages as Usage;
        let usage = Usage::VERTEX | Usage::INDEX | Usage::STORAGE | Usage::COPY_SRC;
        Buffer { buffer: gpu.buffer(bytes, usage), bytes: bytes.len() as u64, is_float: None }
    }

    fn empty(gpu: &Gpu, bytes: u64, is_float: Option<Vec<bool>>) -> Buffer {
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: bytes.max(16).next_multiple_of(16),
            usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Buffer { buffer, bytes, is_float }
    }
}
