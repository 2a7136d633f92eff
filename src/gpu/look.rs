//! The numbers of what passes made, back from the device: for whoever looks between the steps.

use super::device::Gpu;
use super::shader::Shader;
use super::texture::Format;
use super::{Buffer, Images};
use crate::problem::Problem;
use half::f16;
use std::fmt;

/// Where a number of a pass's images stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Which target, in the pass's order.
    pub image: usize,
    pub layer: u32,
    pub x: u32,
    pub y: u32,
    pub channel: u32,
}

impl fmt::Display for Texel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Texel { image, layer, x, y, channel } = self;
        write!(f, "pixel {x}, {y} of target {image}, layer {layer}, channel {channel}")
    }
}

impl Images {
    /// Tells `each` every number of every layer. Integers are left out.
    pub fn floats(&self, gpu: &Gpu, mut each: impl FnMut(Texel, f32)) -> Result<(), Problem> {
        for (image, texture) in self.0.iter().enumerate() {
            let (width, stride) = (texture.shape.width, texture.shape.format.bytes_per_texel());
            let size = match texture.shape.format {
                Format::Rgba32Float | Format::R32Float | Format::Depth32Float => 4,
                Format::Rgba16Float | Format::R16Float => 2,
                Format::Rgba32Uint | Format::Rgba8Unorm | Format::Bgra8Unorm => continue,
            };
            let channels = stride / size as u32;
            for layer in 0..texture.shape.layers {
                for (i, bytes) in gpu.read_layer(texture, layer)?.chunks_exact(size).enumerate() {
                    let (pixel, channel) = (i as u32 / channels, i as u32 % channels);
                    let value = match *bytes {
                        [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
                        [a, b] => f16::from_le_bytes([a, b]).to_f32(),
                        _ => unreachable!("a chunk is a word or a half"),
                    };
                    each(Texel { image, layer, x: pixel % width, y: pixel / width, channel }, value);
                }
            }
        }
        Ok(())
    }
}

impl Buffer {
    /// Tells `each` the element, the word within it and the value of every number that a shader wrote as a float. What was
    /// sent to the device as bytes counts as floats throughout.
    pub fn floats(&self, gpu: &Gpu, mut each: impl FnMut(usize, usize, f32)) -> Result<(), Problem> {
        if self.bytes == 0 {
            return Ok(());
        }
        let all = [true];
        let is_float = self.is_float.as_deref().unwrap_or(&all);
        let bytes = gpu.read_buffer(&self.buffer, self.bytes.next_multiple_of(4))?;
        for (i, bytes) in bytes.chunks_exact(4).enumerate() {
            let (element, word) = (i / is_float.len(), i % is_float.len());
            if is_float[word] {
                each(element, word, f32::from_le_bytes(bytes.try_into().expect("a chunk has 4 bytes")));
            }
        }
        Ok(())
    }
}

/// Which 4-byte words of an element of a shader's array hold floats: all else is integers and padding.
pub(super) fn float_words(shader: &Shader, array: &str) -> Option<Vec<bool>> {
    let module = &shader.module;
    let variable = module.global_variables.iter().find(|(_, variable)| variable.name.as_deref() == Some(array))?.1;
    let naga::TypeInner::Array { base, stride, .. } = module.types[variable.ty].inner else { return None };
    let mut words = vec![false; stride as usize / 4];
    mark(module, base, 0, &mut words);
    Some(words)
}

fn mark(module: &naga::Module, ty: naga::Handle<naga::Type>, at: u32, words: &mut [bool]) {
    use naga::TypeInner as Inner;
    let is_float = |scalar: naga::Scalar| scalar == naga::Scalar::F32;
    let mut run = |from: u32, count: u32, scalar| {
        (0..count).for_each(|i| words[(from / 4 + i) as usize] = is_float(scalar));
    };
    match &module.types[ty].inner {
        Inner::Scalar(scalar) | Inner::Atomic(scalar) => run(at, 1, *scalar),
        Inner::Vector { size, scalar } => run(at, *size as u32, *scalar),
        Inner::Matrix { columns, rows, scalar } => {
            // A column of three is as wide as one of four.
            let stride = if *rows == naga::VectorSize::Bi { 8 } else { 16 };
            (0..*columns as u32).for_each(|i| run(at + i * stride, *rows as u32, *scalar));
        }
        Inner::Array { base, size: naga::ArraySize::Constant(count), stride } => {
            (0..count.get()).for_each(|i| mark(module, *base, at + i * stride, words));
        }
        Inner::Struct { members, .. } => {
            members.iter().for_each(|member| mark(module, member.ty, at + member.offset, words));
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Shaders;

    #[test]
    fn floats_are_told_from_integers_and_padding() {
        let folder = tempfile::tempdir().unwrap();
        let text = "struct Splat { place: vec3f, count: u32, turn: mat2x3f, near: array<vec2<i32>, 2>, last: f32 }
            @group(0) @binding(0) var<storage, read_write> splats: array<Splat>;
            @compute @workgroup_size(1) fn compute() { splats[0].last = 1.0; }";
        std::fs::write(folder.path().join("splat.wgsl"), text).unwrap();
        let shaders = Shaders::new(Some(folder.path().to_path_buf()), Default::default());
        let words = float_words(&shaders.load("splat.wgsl", &[]).unwrap(), "splats").unwrap();
        let shown: String = words.iter().map(|float| if *float { 'f' } else { '.' }).collect();
        assert_eq!(shown, "fff.fff.fff.....f...");
    }
}
