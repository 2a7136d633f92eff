//! Passes as values: fill in a struct, add it to the plan. A new fullscreen pass is about ten lines.
//!
//! Every pass writes all of what it makes; colours start at 0 and depth, which is reversed everywhere (1 near, 0 far), at 0.

use super::bind::{self, Bind, Ready};
use super::device::{Gpu, Pipeline};
use super::shader::Shader;
use super::texture::{Format, Shape, Texture};
use super::{Buffer, Images, look};
use crate::problem::Problem;
use crate::store::{Key, Run, Slot, Step};
use serde::Serialize;
use std::sync::Arc;

/// How a target takes what is drawn to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Blend {
    Replace,
    Add,
}

/// What a raster pass does with depth.
#[derive(Clone, Serialize)]
pub enum Depth {
    /// No depth at all: everything is drawn.
    Off,
    /// A new depth map, the last of the pass's images; the nearest surface wins.
    Write,
    /// Only what lies exactly on the surfaces of that depth map is drawn.
    Equal(Slot<Images>, usize),
}

/// One mesh to draw: vertex streams by location, and indices. `instance` is what the shader sees as `instance_index`.
#[derive(Clone, Serialize)]
pub struct Draw {
    pub streams: Vec<Slot<Buffer>>,
    pub indices: Slot<Buffer>,
    pub instance: u32,
}

/// What a layer's fragments come from.
#[derive(Clone, Serialize)]
pub enum Cover {
    /// Every pixel: the shader includes `lib/fullscreen.wgsl`.
    Pixels,
    Meshes(Vec<Draw>),
}

/// One layer of a raster pass, with what differs between layers.
#[derive(Clone, Serialize)]
pub struct Layer {
    pub binds: Vec<(&'static str, Bind)>,
    pub cover: Cover,
}

impl Layer {
    pub fn meshes(draws: Vec<Draw>) -> Layer {
        Layer { binds: Vec::new(), cover: Cover::Meshes(draws) }
    }
}

/// Draws meshes, or every pixel of several layers. Makes its colour targets in their order, then the depth map if it writes one.
#[derive(Serialize)]
pub struct Raster {
    pub name: &'static str,
    /// For people: no part of the pass's name.
    #[serde(skip)]
    pub about: String,
    pub shader: Shader,
    pub size: (u32, u32),
    pub targets: Vec<(Format, Blend)>,
    pub depth: Depth,
    /// Several layers make arrays.
    pub layers: Vec<Layer>,
    pub array: bool,
    pub binds: Vec<(&'static str, Bind)>,
}

/// Runs a fragment shader for every pixel. The shader includes `lib/fullscreen.wgsl`.
#[derive(Serialize)]
pub struct Fullscreen {
    pub name: &'static str,
    /// For people: no part of the pass's name.
    #[serde(skip)]
    pub about: String,
    pub shader: Shader,
    pub size: (u32, u32),
    pub targets: Vec<Format>,
    pub binds: Vec<(&'static str, Bind)>,
}

/// Runs a compute shader over `count` elements, 64 a workgroup, into one buffer of `count * stride` bytes. The count is
/// that of the buffer `over`, whose elements are `over_stride` bytes long.
#[derive(Serialize)]
pub struct Compute {
    pub name: &'static str,
    /// For people: no part of the pass's name.
    #[serde(skip)]
    pub about: String,
    pub shader: Shader,
    /// The name of the shader's output, and the bytes of one of its elements.
    pub output: (&'static str, u32),
    pub over: Slot<Buffer>,
    pub over_stride: u32,
    pub binds: Vec<(&'static str, Bind)>,
}

impl Step for Raster {
    type Output = Images;
    fn name(&self) -> &'static str {
        self.name
    }
    fn about(&self) -> String {
        self.about.clone()
    }
    fn run(&self, run: &Run) -> Result<Images, Problem> {
        draw(run, self)
    }
}

impl Step for Fullscreen {
    type Output = Images;
    fn name(&self) -> &'static str {
        self.name
    }
    fn about(&self) -> String {
        self.about.clone()
    }
    fn run(&self, run: &Run) -> Result<Images, Problem> {
        let raster = Raster {
            name: self.name,
            about: String::new(),
            shader: self.shader.clone(),
            size: self.size,
            targets: self.targets.iter().map(|format| (*format, Blend::Replace)).collect(),
            depth: Depth::Off,
            layers: vec![Layer { binds: Vec::new(), cover: Cover::Pixels }],
            array: false,
            binds: self.binds.clone(),
        };
        draw(run, &raster)
    }
}

impl Step for Compute {
    type Output = Buffer;
    fn name(&self) -> &'static str {
        self.name
    }
    fn about(&self) -> String {
        self.about.clone()
    }
    fn run(&self, run: &Run) -> Result<Buffer, Problem> {
        let gpu: &Gpu = run.host();
        let count = run.get(self.over).bytes / self.over_stride as u64;
        let is_float = look::float_words(&self.shader, self.output.0);
        let output = Arc::new(Buffer::empty(gpu, count * self.output.1 as u64, is_float));
        let wanted = bind::wanted(&self.shader, &["compute"]);
        let ready = bind::pair(gpu, run, &self.shader, &wanted, &self.binds, Some((self.output.0, &output)))?;
        let entries = bind::entries(&wanted, &ready);
        let Pipeline::Compute(pipeline, layout) = compute_pipeline(gpu, self.name, &self.shader, &entries) else {
            unreachable!("a compute pass has a compute pipeline")
        };
        let group = bind::group(&gpu.device, &layout, &wanted, &ready);
        let stopwatch = gpu.stopwatch();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let timestamp_writes = stopwatch.as_ref().map(|query_set| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(0),
                end_of_pass_write_index: Some(1),
            });
            let mut pass =
                encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(self.name), timestamp_writes });
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            let groups = count.div_ceil(64) as u32;
            // A dispatch has at most 65,535 groups along an axis: the shader puts the two together again.
            pass.dispatch_workgroups(groups.min(ROW_OF_GROUPS), groups.div_ceil(ROW_OF_GROUPS), 1);
        }
        gpu.submit(run, self.name, encoder, stopwatch)?;
        drop::<Vec<Ready>>(ready);
        Ok(Arc::into_inner(output).expect("nothing holds the output any more"))
    }
}

fn draw(run: &Run, raster: &Raster) -> Result<Images, Problem> {
    let gpu: &Gpu = run.host();
    let shape = |format| Shape {
        width: raster.size.0,
        height: raster.size.1,
        layers: raster.layers.len() as u32,
        array: raster.array,
        levels: 1,
        format,
    };
    let mut images: Vec<Texture> = raster.targets.iter().map(|(format, _)| gpu.texture(shape(*format))).collect();
    if matches!(raster.depth, Depth::Write) {
        images.push(gpu.texture(shape(Format::Depth32Float)));
    }
    let tested = match &raster.depth {
        Depth::Equal(slot, i) => Some((run.get(*slot), *i)),
        _ => None,
    };
    let entries: &[&str] = if raster.targets.is_empty() { &["vertex"] } else { &["vertex", "fragment"] };
    let wanted = bind::wanted(&raster.shader, entries);
    let stopwatch = gpu.stopwatch();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    for (i, layer) in raster.layers.iter().enumerate() {
        let mut binds = layer.binds.clone();
        binds.extend(raster.binds.iter().cloned());
        let ready = bind::pair(gpu, run, &raster.shader, &wanted, &binds, None)?;
        let bind_entries = bind::entries(&wanted, &ready);
        let Pipeline::Render(pipeline, bind_layout) =
            render_pipeline(gpu, raster.name, &raster.shader, &bind_entries, &raster.targets, &raster.depth)
        else {
            unreachable!("a raster pass has a render pipeline")
        };
        let group = bind::group(&gpu.device, &bind_layout, &wanted, &ready);
        let views: Vec<_> = images.iter().map(|image| image.layer(i as u32)).collect();
        let (colours, depth) = views.split_at(raster.targets.len());
        let attachments: Vec<_> = colours.iter().map(colour_attachment).collect();
        let depth_view = depth.first().or(tested.as_ref().map(|(images, i)| &images.0[*i].view));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(raster.name),
            color_attachments: &attachments,
            depth_stencil_attachment: depth_view.map(|view| wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: tested
                    .is_none()
                    .then_some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: timestamps(&stopwatch, i == 0, i + 1 == raster.layers.len()),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        let draws = match &layer.cover {
            Cover::Pixels => {
                pass.draw(0..3, 0..1);
                continue;
            }
            Cover::Meshes(draws) => draws,
        };
        for draw in draws {
            for (location, stream) in draw.streams.iter().enumerate() {
                pass.set_vertex_buffer(location as u32, run.get(*stream).buffer.slice(..));
            }
            let indices = run.get(draw.indices);
            pass.set_index_buffer(indices.buffer.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..(indices.bytes / 4) as u32, 0, draw.instance..draw.instance + 1);
        }
    }
    gpu.submit(run, raster.name, encoder, stopwatch)?;
    Ok(Images(images))
}

/// How many workgroups `lib/element.wgsl` expects side by side.
const ROW_OF_GROUPS: u32 = 32768;

fn colour_attachment(view: &wgpu::TextureView) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    Some(wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
    })
}

fn timestamps(
    stopwatch: &Option<wgpu::QuerySet>,
    first: bool,
    last: bool,
) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
    let query_set = stopwatch.as_ref().filter(|_| first || last)?;
    Some(wgpu::RenderPassTimestampWrites {
        query_set,
        beginning_of_pass_write_index: first.then_some(0),
        end_of_pass_write_index: last.then_some(1),
    })
}

/// Makes a pipeline once per shader, layout and targets.
fn kept(gpu: &Gpu, key: Key, make: impl FnOnce() -> Pipeline) -> Pipeline {
    gpu.pipelines.lock().expect("no panic while making a pipeline").entry(key).or_insert_with(make).clone()
}

fn module(gpu: &Gpu, shader: &Shader) -> wgpu::ShaderModule {
    let source = wgpu::ShaderSource::Wgsl(shader.text.as_str().into());
    let descriptor = wgpu::ShaderModuleDescriptor { label: Some(&shader.name), source };
    let mut checks = wgpu::ShaderRuntimeChecks::checked();
    // Bounding every loop makes some compilers take minutes, and no loop of ours runs for ever: each has a count.
    checks.force_loop_bounding = false;
    // SAFETY: bounds checks stay on; only endless loops are no longer guarded against.
    unsafe { gpu.device.create_shader_module_trusted(descriptor, checks) }
}

fn bind_layout(gpu: &Gpu, entries: &[wgpu::BindGroupLayoutEntry]) -> (wgpu::BindGroupLayout, wgpu::PipelineLayout) {
    let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries });
    let pipeline = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&layout)],
        ..Default::default()
    });
    (layout, pipeline)
}

fn render_pipeline(
    gpu: &Gpu,
    name: &str,
    shader: &Shader,
    entries: &[wgpu::BindGroupLayoutEntry],
    targets: &[(Format, Blend)],
    depth: &Depth,
) -> Pipeline {
    let depth_mode = match depth {
        Depth::Off => 0,
        Depth::Write => 1,
        Depth::Equal(..) => 2,
    };
    kept(gpu, Key::of(&(shader.key, bind::layout_key(entries), targets, depth_mode)), || {
        let module = module(gpu, shader);
        let (layout, pipeline_layout) = bind_layout(gpu, entries);
        let inputs = bind::vertex_inputs(shader);
        let attributes: Vec<[wgpu::VertexAttribute; 1]> = inputs
            .iter()
            .map(|&(shader_location, format)| [wgpu::VertexAttribute { format, offset: 0, shader_location }])
            .collect();
        let buffers: Vec<_> = attributes
            .iter()
            .map(|attribute| {
                Some(wgpu::VertexBufferLayout {
                    array_stride: attribute[0].format.size(),
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: attribute,
                })
            })
            .collect();
        let add = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let states: Vec<_> = targets
            .iter()
            .map(|(format, blend)| {
                Some(wgpu::ColorTargetState {
                    format: format.wgpu(),
                    blend: (*blend == Blend::Add).then_some(wgpu::BlendState { color: add, alpha: add }),
                    write_mask: wgpu::ColorWrites::ALL,
                })
            })
            .collect();
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(name),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &buffers,
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: (depth_mode > 0).then(|| wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(depth_mode == 1),
                depth_compare: Some(match depth_mode {
                    1 => wgpu::CompareFunction::Greater,
                    _ => wgpu::CompareFunction::Equal,
                }),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: (!targets.is_empty()).then(|| wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &states,
            }),
            multiview_mask: None,
            cache: None,
        });
        Pipeline::Render(pipeline, layout)
    })
}

fn compute_pipeline(gpu: &Gpu, name: &str, shader: &Shader, entries: &[wgpu::BindGroupLayoutEntry]) -> Pipeline {
    kept(gpu, Key::of(&("compute", shader.key, bind::layout_key(entries))), || {
        let module = module(gpu, shader);
        let (layout, pipeline_layout) = bind_layout(gpu, entries);
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("compute"),
            compilation_options: Default::default(),
            cache: None,
        });
        Pipeline::Compute(pipeline, layout)
    })
}
