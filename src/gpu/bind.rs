//! What a pass binds: by the name that the shader gives it, checked against what naga read.

use super::shader::Shader;
use super::texture::Texture;
use super::{Buffer, Images};
use crate::store::{Key, Run, Slot};
use encase::ShaderType;
use encase::internal::WriteInto;
use serde::Serialize;
use std::sync::Arc;

/// A Rust struct that a shader reads, with the places of its fields.
pub trait Uniform: ShaderType + WriteInto {
    /// Name and offset of every field.
    fn fields() -> Vec<(&'static str, u32)>;
}

/// Declares a struct that travels to shaders. Its WGSL twin is written by hand, and the two are compared, name by name and
/// offset by offset, before any pass uses them.
#[macro_export]
macro_rules! uniform {
    ($(#[$meta:meta])* $vis:vis struct $name:ident { $($(#[$field_meta:meta])* $field_vis:vis $field:ident: $type:ty),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, encase::ShaderType)]
        $vis struct $name { $($(#[$field_meta])* $field_vis $field: $type),* }
        impl $crate::gpu::Uniform for $name {
            fn fields() -> Vec<(&'static str, u32)> {
                [$(stringify!($field)),*].into_iter().enumerate()
                    .map(|(i, name)| (name, <$name as encase::ShaderType>::METADATA.offset(i) as u32))
                    .collect()
            }
        }
    };
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Sampler {
    /// Bilinear, clamped to the edge.
    Linear,
    /// Bilinear; around in x, clamped in y: for an environment in longitude and latitude.
    LinearAround,
    /// Bilinear, repeated: for the textures of a material.
    LinearRepeat,
    /// 2x2 percentage-closer comparison, reversed depth: 1 where the reference is at least as near as what is stored.
    Shadow,
}

/// One thing that a pass binds.
#[derive(Clone, Serialize)]
pub enum Bind {
    /// A struct, or a list of them, as the bytes that the shader sees, with the fields of the struct.
    Data {
        bytes: Arc<Vec<u8>>,
        fields: Vec<(&'static str, u32)>,
    },
    Buffer(Slot<Buffer>),
    Texture(Slot<Images>, usize),
    Sampler(Sampler),
}

impl Bind {
    /// One struct: `var<uniform>`.
    pub fn uniform<T: Uniform>(value: &T) -> Bind {
        let mut buffer = encase::UniformBuffer::new(Vec::new());
        buffer.write(value).expect("a vector can grow");
        Bind::Data { bytes: Arc::new(buffer.into_inner()), fields: T::fields() }
    }

    /// A list of structs: `var<storage, read>` of a runtime-sized array.
    pub fn list<T: Uniform + encase::ShaderSize>(values: &[T]) -> Bind {
        let mut buffer = encase::StorageBuffer::new(Vec::new());
        buffer.write(values).expect("a vector can grow");
        Bind::Data { bytes: Arc::new(buffer.into_inner()), fields: T::fields() }
    }
}

/// A thing that a shader's entry points use.
pub(super) struct Wanted<'a> {
    name: &'a str,
    binding: u32,
    visibility: wgpu::ShaderStages,
    space: naga::AddressSpace,
    inner: &'a naga::TypeInner,
}

/// All that the named entry points use, in the order of binding numbers.
pub(super) fn wanted<'a>(shader: &'a Shader, entries: &[&str]) -> Vec<Wanted<'a>> {
    let mut found: Vec<Wanted> = shader
        .module
        .global_variables
        .iter()
        .filter_map(|(handle, variable)| {
            let binding = variable.binding.as_ref()?;
            let mut visibility = wgpu::ShaderStages::empty();
            for (i, entry) in shader.module.entry_points.iter().enumerate() {
                let used = !shader.info.get_entry_point(i)[handle].is_empty();
                if used && entries.contains(&entry.name.as_str()) {
                    visibility |= match entry.stage {
                        naga::ShaderStage::Vertex => wgpu::ShaderStages::VERTEX,
                        naga::ShaderStage::Fragment => wgpu::ShaderStages::FRAGMENT,
                        _ => wgpu::ShaderStages::COMPUTE,
                    };
                }
            }
            (!visibility.is_empty()).then(|| Wanted {
                name: variable.name.as_deref().unwrap_or_default(),
                binding: binding.binding,
                visibility,
                space: variable.space,
                inner: &shader.module.types[variable.ty].inner,
            })
        })
        .collect();
    found.sort_by_key(|wanted| wanted.binding);
    found
}

/// A thing to bind, ready to be given to the device.
pub(super) enum Ready {
    Owned(wgpu::Buffer),
    Buffer(Arc<Buffer>),
    Texture(Arc<Images>, usize),
    Sampler(wgpu::Sampler, Sampler),
}

impl Ready {
    fn texture(&self) -> Option<&Texture> {
        match self {
            Ready::Texture(images, i) => Some(&images.0[*i]),
            _ => None,
        }
    }

    fn resource(&self) -> wgpu::BindingResource<'_> {
        match self {
            Ready::Owned(buffer) => buffer.as_entire_binding(),
            Ready::Buffer(buffer) => buffer.buffer.as_entire_binding(),
            Ready::Texture(images, i) => wgpu::BindingResource::TextureView(&images.0[*i].view),
            Ready::Sampler(sampler, _) => wgpu::BindingResource::Sampler(sampler),
        }
    }
}

/// Pairs what the shader wants with what the pass binds.
///
/// A name that is missing, or a struct whose fields lie elsewhere in the shader, is a mistake in the program (or an edit
/// of a shader beyond what the program knows), and reported as such.
pub(super) fn pair<'a>(
    gpu: &super::device::Gpu,
    run: &Run,
    shader: &Shader,
    wanted: &[Wanted<'a>],
    binds: &[(&'static str, Bind)],
    output: Option<(&str, &Arc<Buffer>)>,
) -> Result<Vec<Ready>, crate::problem::Problem> {
    let mistake = |what: String| {
        crate::problem::Problem::files(format!("the shader {}: {what}", shader.name))
            .hint("bindings are made by name: undo the renaming, or change the pass in src/ with it")
    };
    wanted
        .iter()
        .map(|want| {
            if let Some((name, buffer)) = output
                && name == want.name
            {
                return Ok(Ready::Buffer(buffer.clone()));
            }
            let bind = binds.iter().find(|(name, _)| *name == want.name).map(|(_, bind)| bind);
            let bind = bind.ok_or_else(|| {
                let names: Vec<_> = binds.iter().map(|(name, _)| *name).collect();
                mistake(format!("nothing is bound to `{}`; there is {}", want.name, names.join(", ")))
            })?;
            Ok(match bind {
                Bind::Data { bytes, fields } => {
                    compare_layout(shader, want, fields).map_err(mistake)?;
                    let usage = match want.space {
                        naga::AddressSpace::Uniform => wgpu::BufferUsages::UNIFORM,
                        _ => wgpu::BufferUsages::STORAGE,
                    };
                    Ready::Owned(gpu.buffer(bytes, usage))
                }
                Bind::Buffer(slot) => Ready::Buffer(run.get(*slot)),
                Bind::Texture(slot, i) => Ready::Texture(run.get(*slot), *i),
                Bind::Sampler(sampler) => Ready::Sampler(sampler.make(&gpu.device), *sampler),
            })
        })
        .collect()
}

fn compare_layout(shader: &Shader, want: &Wanted, fields: &[(&'static str, u32)]) -> Result<(), String> {
    let types = &shader.module.types;
    let inner = match want.inner {
        naga::TypeInner::Array { base, .. } => &types[*base].inner,
        inner => inner,
    };
    let naga::TypeInner::Struct { members, .. } = inner else {
        return Err(format!("`{}` is not a struct", want.name));
    };
    let written: Vec<(&str, u32)> = members.iter().map(|m| (m.name.as_deref().unwrap_or_default(), m.offset)).collect();
    match written == fields {
        true => Ok(()),
        false => Err(format!("the fields of `{}` are {written:?} here and {fields:?} in the program", want.name)),
    }
}

impl Sampler {
    fn make(self, device: &wgpu::Device) -> wgpu::Sampler {
        let [u, v] = match self {
            Sampler::Linear | Sampler::Shadow => [wgpu::AddressMode::ClampToEdge; 2],
            Sampler::LinearAround => [wgpu::AddressMode::Repeat, wgpu::AddressMode::ClampToEdge],
            Sampler::LinearRepeat => [wgpu::AddressMode::Repeat; 2],
        };
        device.create_sampler(&wgpu::SamplerDescriptor {
            address_mode_u: u,
            address_mode_v: v,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            compare: (self == Sampler::Shadow).then_some(wgpu::CompareFunction::GreaterEqual),
            ..Default::default()
        })
    }
}

/// The layout of everything that is wanted, given what is bound to it.
pub(super) fn entries(wanted: &[Wanted], ready: &[Ready]) -> Vec<wgpu::BindGroupLayoutEntry> {
    wanted
        .iter()
        .zip(ready)
        .map(|(want, ready)| wgpu::BindGroupLayoutEntry {
            binding: want.binding,
            visibility: want.visibility,
            ty: binding_type(want, ready),
            count: None,
        })
        .collect()
}

fn binding_type(want: &Wanted, ready: &Ready) -> wgpu::BindingType {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    match (want.space, want.inner) {
        (naga::AddressSpace::Uniform, _) => buffer(wgpu::BufferBindingType::Uniform),
        (naga::AddressSpace::Storage { access }, _) => {
            buffer(wgpu::BufferBindingType::Storage { read_only: !access.contains(naga::StorageAccess::STORE) })
        }
        (_, naga::TypeInner::Sampler { .. }) => wgpu::BindingType::Sampler(match ready {
            Ready::Sampler(_, Sampler::Shadow) => wgpu::SamplerBindingType::Comparison,
            _ => wgpu::SamplerBindingType::Filtering,
        }),
        (_, naga::TypeInner::Image { arrayed, class, .. }) => wgpu::BindingType::Texture {
            sample_type: match class {
                naga::ImageClass::Depth { .. } => wgpu::TextureSampleType::Depth,
                naga::ImageClass::Sampled { kind: naga::ScalarKind::Uint, .. } => wgpu::TextureSampleType::Uint,
                naga::ImageClass::Sampled { kind: naga::ScalarKind::Sint, .. } => wgpu::TextureSampleType::Sint,
                _ => wgpu::TextureSampleType::Float {
                    filterable: ready.texture().is_some_and(|texture| texture.shape.format.is_filterable()),
                },
            },
            view_dimension: match arrayed {
                true => wgpu::TextureViewDimension::D2Array,
                false => wgpu::TextureViewDimension::D2,
            },
            multisampled: false,
        },
        (space, inner) => unreachable!("a shader binds {inner:?} in {space:?}, for which there is no word here"),
    }
}

/// A name for a layout, for the pipelines that are kept.
pub(super) fn layout_key(entries: &[wgpu::BindGroupLayoutEntry]) -> Key {
    Key::of(&format!("{entries:?}"))
}

pub(super) fn group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    wanted: &[Wanted],
    ready: &[Ready],
) -> wgpu::BindGroup {
    let entries: Vec<_> = wanted
        .iter()
        .zip(ready)
        .map(|(want, ready)| wgpu::BindGroupEntry { binding: want.binding, resource: ready.resource() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// The vertex formats that the entry point `vertex` reads, by location.
pub(super) fn vertex_inputs(shader: &Shader) -> Vec<(u32, wgpu::VertexFormat)> {
    let types = &shader.module.types;
    let Some(entry) = shader.module.entry_points.iter().find(|entry| entry.name == "vertex") else { return Vec::new() };
    let mut found: Vec<(u32, wgpu::VertexFormat)> = entry
        .function
        .arguments
        .iter()
        .filter_map(|argument| match argument.binding {
            Some(naga::Binding::Location { location, .. }) => {
                let format = match types[argument.ty].inner {
                    naga::TypeInner::Vector { size: naga::VectorSize::Bi, .. } => wgpu::VertexFormat::Float32x2,
                    naga::TypeInner::Vector { size: naga::VectorSize::Tri, .. } => wgpu::VertexFormat::Float32x3,
                    naga::TypeInner::Vector { size: naga::VectorSize::Quad, .. } => wgpu::VertexFormat::Float32x4,
                    _ => wgpu::VertexFormat::Float32,
                };
                Some((location, format))
            }
            _ => None,
        })
        .collect();
    found.sort_by_key(|(location, _)| *location);
    found
}
