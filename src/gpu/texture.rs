//! Textures as values, and the pool that they go back to: orbiting makes new names every frame, and no new memory.

use serde::Serialize;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub enum Format {
    Rgba32Float,
    Rgba16Float,
    R16Float,
    R32Float,
    Rgba32Uint,
    Rgba8Unorm,
    /// What most windows are made of.
    Bgra8Unorm,
    Depth32Float,
}

impl Format {
    pub fn wgpu(self) -> wgpu::TextureFormat {
        match self {
            Format::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
            Format::Rgba16Float => wgpu::TextureFormat::Rgba16Float,
            Format::R16Float => wgpu::TextureFormat::R16Float,
            Format::R32Float => wgpu::TextureFormat::R32Float,
            Format::Rgba32Uint => wgpu::TextureFormat::Rgba32Uint,
            Format::Rgba8Unorm => wgpu::TextureFormat::Rgba8Unorm,
            Format::Bgra8Unorm => wgpu::TextureFormat::Bgra8Unorm,
            Format::Depth32Float => wgpu::TextureFormat::Depth32Float,
        }
    }

    pub fn bytes_per_texel(self) -> u32 {
        match self {
            Format::Rgba32Float | Format::Rgba32Uint => 16,
            Format::Rgba16Float => 8,
            Format::R16Float => 2,
            Format::R32Float | Format::Rgba8Unorm | Format::Bgra8Unorm | Format::Depth32Float => 4,
        }
    }

    pub fn is_depth(self) -> bool {
        self == Format::Depth32Float
    }

    /// Whether every device can filter it; a 32-bit float is read texel by texel.
    pub fn is_filterable(self) -> bool {
        matches!(self, Format::Rgba16Float | Format::R16Float | Format::Rgba8Unorm | Format::Bgra8Unorm)
    }
}

/// What a texture is, apart from its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub struct Shape {
    pub width: u32,
    pub height: u32,
    /// More than one, or an array by nature: the shader sees `texture_2d_array`.
    pub layers: u32,
    pub array: bool,
    /// Sizes that it is there in, each half of the one before; passes draw to the first.
    pub levels: u32,
    pub format: Format,
}

impl Shape {
    pub fn flat(size: (u32, u32), format: Format) -> Shape {
        Shape { width: size.0, height: size.1, layers: 1, array: false, levels: 1, format }
    }

    pub fn array(size: (u32, u32), layers: u32, format: Format) -> Shape {
        Shape { width: size.0, height: size.1, layers, array: true, levels: 1, format }
    }

    pub fn extent(&self) -> wgpu::Extent3d {
        wgpu::Extent3d { width: self.width, height: self.height, depth_or_array_layers: self.layers }
    }

    /// With all smaller sizes, down to a single texel.
    pub fn with_mips(self) -> Shape {
        Shape { levels: self.width.max(self.height).max(1).ilog2() + 1, ..self }
    }

    /// The size of one level.
    pub fn level(&self, level: u32) -> (u32, u32) {
        ((self.width >> level).max(1), (self.height >> level).max(1))
    }

    pub fn bytes(&self) -> u64 {
        let texels = |level| {
            let (width, height) = self.level(level);
            width as u64 * height as u64
        };
        (0..self.levels).map(texels).sum::<u64>() * self.layers as u64 * self.format.bytes_per_texel() as u64
    }
}

/// A texture; when nobody holds it any more, its memory goes back to the pool.
pub struct Texture {
    pub shape: Shape,
    pub texture: wgpu::Texture,
    /// All layers, as a shader sees them.
    pub view: wgpu::TextureView,
    pool: Pool,
}

impl Texture {
    /// One layer, to be drawn to.
    pub fn layer(&self, layer: u32) -> wgpu::TextureView {
        self.texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2),
            base_array_layer: layer,
            array_layer_count: Some(1),
            mip_level_count: Some(1),
            ..Default::default()
        })
    }
}

impl Drop for Texture {
    fn drop(&mut self) {
        let mut free = self.pool.0.lock().expect("no panic while pooling");
        free.push_back((self.shape, self.texture.clone()));
        while free.len() > MOST_FREE || free.iter().map(|(shape, _)| shape.bytes()).sum::<u64>() > MOST_FREE_BYTES {
            free.pop_front();
        }
    }
}

const MOST_FREE: usize = 32;
const MOST_FREE_BYTES: u64 = 512 << 20;

/// Textures that nobody holds, oldest first. A pass writes all of what it makes, so old content is never seen.
#[derive(Clone, Default)]
pub struct Pool(Arc<Mutex<VecDeque<(Shape, wgpu::Texture)>>>);

impl Pool {
    /// Gives all of it back to the system.
    pub fn clear(&self) {
        self.0.lock().expect("no panic while pooling").clear();
    }

    pub fn take(&self, device: &wgpu::Device, shape: Shape) -> Texture {
        let mut free = self.0.lock().expect("no panic while pooling");
        let found =
            free.iter().rposition(|(s, _)| *s == shape).and_then(|i| free.remove(i)).map(|(_, texture)| texture);
        drop(free);
        let texture = found.unwrap_or_else(|| {
            use wgpu::TextureUsages as Usage;
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: shape.extent(),
                mip_level_count: shape.levels,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: shape.format.wgpu(),
                usage: Usage::TEXTURE_BINDING
                    | Usage::RENDER_ATTACHMENT
                    | Usage::COPY_SRC
                    | if shape.format.is_depth() { Usage::empty() } else { Usage::COPY_DST },
                view_formats: &[],
            })
        });
        let dimension = if shape.array { wgpu::TextureViewDimension::D2Array } else { wgpu::TextureViewDimension::D2 };
        let view =
            texture.create_view(&wgpu::TextureViewDescriptor { dimension: Some(dimension), ..Default::default() });
        Texture { shape, texture, view, pool: self.clone() }
    }
}
