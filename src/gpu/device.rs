//! The device: found, opened, waited for, and asked what went wrong.

use super::texture::{Pool, Shape, Texture};
use crate::problem::{Cause, Problem, nearest};
use crate::store::{Key, Run};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;

/// What kind of pipeline a pass needs is known when it runs; each is made once.
#[derive(Clone)]
pub(super) enum Pipeline {
    Render(wgpu::RenderPipeline, wgpu::BindGroupLayout),
    Compute(wgpu::ComputePipeline, wgpu::BindGroupLayout),
}

/// An open device. It is the host that passes run on.
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub adapter: wgpu::AdapterInfo,
    /// Whether each pass is waited for, so that its time is its own.
    pub timed: bool,
    pub(super) pool: Pool,
    pub(super) pipelines: Mutex<HashMap<Key, Pipeline>>,
    errors: Arc<Mutex<Vec<String>>>,
    /// Why the device is gone, once it is.
    gone: Arc<OnceLock<String>>,
    has_timestamps: bool,
}

/// Whether an adapter computes on the CPU.
pub fn is_software(info: &wgpu::AdapterInfo) -> bool {
    info.device_type == wgpu::DeviceType::Cpu
}

fn instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env())
}

/// All adapters of this machine, hardware first.
pub fn adapters() -> Vec<wgpu::Adapter> {
    adapters_of(&instance())
}

fn adapters_of(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    found.sort_by_key(|adapter| match adapter.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    found
}

/// What to do on a machine without an adapter.
pub fn how_to_get_an_adapter() -> &'static str {
    if cfg!(target_os = "linux") {
        "install a Vulkan driver: `tools/start` does it on Debian and Ubuntu (packages libvulkan1 and \
         mesa-vulkan-drivers, which also draws without a graphics card); on Fedora `dnf install mesa-vulkan-drivers \
         vulkan-loader`, on Arch `pacman -S vulkan-swrast vulkan-icd-loader`"
    } else {
        "install your graphics card's driver"
    }
}

impl Gpu {
    /// Opens the adapter whose name contains `wanted`, or the best one.
    pub fn open(wanted: Option<&str>) -> Result<Gpu, Problem> {
        Gpu::open_one(adapters(), wanted)
    }

    /// Opens an adapter that can draw to a window, and the surface of that window.
    pub fn open_for(
        window: impl Into<wgpu::SurfaceTarget<'static>>,
        wanted: Option<&str>,
    ) -> Result<(Gpu, wgpu::Surface<'static>, wgpu::SurfaceCapabilities), Problem> {
        let instance = instance();
        let cannot = |why: &str| {
            Problem::new(Cause::Adapter, format!("the window cannot be drawn to: {why}"))
                .hint("`diaphane doctor` lists the adapters; `diaphane render` makes pictures without a window")
        };
        let surface = instance.create_surface(window).map_err(|error| cannot(&error.to_string()))?;
        let all = adapters_of(&instance);
        let none_at_all = all.is_empty();
        let mut able: Vec<_> = all.into_iter().filter(|adapter| adapter.is_surface_supported(&surface)).collect();
        if able.is_empty() && !none_at_all {
            return Err(cannot("no adapter can"));
        }
        let place = Gpu::choose(&able, wanted)?;
        let adapter = able.swap_remove(place);
        let capabilities = surface.get_capabilities(&adapter);
        Ok((Gpu::open_one(vec![adapter], None)?, surface, capabilities))
    }

    /// The place of the adapter whose name contains `wanted`, or of the best one.
    fn choose(adapters: &[wgpu::Adapter], wanted: Option<&str>) -> Result<usize, Problem> {
        if adapters.is_empty() {
            return Err(Problem::new(Cause::Adapter, "there is no graphics adapter").hint(how_to_get_an_adapter()));
        }
        let names: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
        let Some(wanted) = wanted else { return Ok(0) };
        let lower = wanted.to_lowercase();
        names.iter().position(|name| name.to_lowercase().contains(&lower)).ok_or_else(|| {
            let near = nearest(wanted, names.iter().map(String::as_str));
            let all = names.join("`, `");
            Problem::new(Cause::Adapter, format!("there is no adapter `{wanted}`"))
                .hint(near.map_or(format!("there is `{all}`"), |near| format!("did you mean `{near}`?")))
        })
    }

    fn open_one(adapters: Vec<wgpu::Adapter>, wanted: Option<&str>) -> Result<Gpu, Problem> {
        let adapter = &adapters[Gpu::choose(&adapters, wanted)?];
        let info = adapter.get_info();
        let wanted_features = wgpu::Features::TIMESTAMP_QUERY;
        let features = adapter.features() & wanted_features;
        // WebGPU's own limits, but for what large scenes and pictures need: as much as the adapter has.
        let has = adapter.limits();
        let limits = wgpu::Limits {
            max_texture_dimension_2d: has.max_texture_dimension_2d,
            max_buffer_size: has.max_buffer_size,
            max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
            ..wgpu::Limits::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("diaphane"),
            required_features: features,
            required_limits: limits,
            ..Default::default()
        }))
        .map_err(|error| {
            Problem::new(Cause::Adapter, format!("the adapter `{}` cannot be opened: {error}", info.name))
                .hint("try another one with --adapter; `diaphane doctor` lists them")
        })?;
        let errors: Arc<Mutex<Vec<String>>> = Arc::default();
        let log = errors.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            log.lock().expect("no panic while noting an error").push(error.to_string());
        }));
        let gone: Arc<OnceLock<String>> = Arc::default();
        let told = gone.clone();
        device.set_device_lost_callback(move |_, why| {
            told.set(why).ok(); // the first reason stands
        });
        Ok(Gpu {
            device,
            queue,
            adapter: info,
            timed: false,
            pool: Pool::default(),
            pipelines: Mutex::default(),
            errors,
            gone,
            has_timestamps: features.contains(wgpu::Features::TIMESTAMP_QUERY),
        })
    }

    pub fn is_software(&self) -> bool {
        is_software(&self.adapter)
    }

    /// Whether the device is gone: a driver crashed, or the card was unplugged. Whoever still needs it opens another one.
    pub fn is_lost(&self) -> bool {
        self.gone.get().is_some()
    }

    /// Bytes that are allocated on the device now, the textures that wait for their next use among them. None where the
    /// system keeps no books: on Metal.
    pub fn allocated(&self) -> Option<u64> {
        self.device.generate_allocator_report().map(|report| report.total_allocated_bytes)
    }

    /// Gives back to the system what nobody holds any more.
    pub fn free(&self) -> Result<(), Problem> {
        self.pool.clear();
        self.wait()
    }

    pub fn texture(&self, shape: Shape) -> Texture {
        self.pool.take(&self.device, shape)
    }

    /// A texture with content: all layers, row by row, top first.
    pub fn texture_with(&self, shape: Shape, bytes: &[u8]) -> Texture {
        let texture = self.texture(shape);
        let mut rest = bytes;
        for level in 0..shape.levels {
            let (width, height) = shape.level(level);
            let row = width * shape.format.bytes_per_texel();
            let (these, others) = rest.split_at((row * height * shape.layers) as usize);
            self.queue.write_texture(
                wgpu::TexelCopyTextureInfo { mip_level: level, ..texture.texture.as_image_copy() },
                these,
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: Some(height) },
                wgpu::Extent3d { width, height, depth_or_array_layers: shape.layers },
            );
            rest = others;
        }
        texture
    }

    /// A buffer with content; an empty one gets 16 bytes, since WebGPU knows no empty bindings.
    pub fn buffer(&self, bytes: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let size = (bytes.len().max(16) as u64).next_multiple_of(16);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: true,
        });
        if let Ok(mut mapped) = buffer.get_mapped_range_mut(..) {
            mapped.slice(..bytes.len()).copy_from_slice(bytes);
        }
        buffer.unmap();
        buffer
    }

    /// Two timestamps around a pass, where they can be believed: on a graphics card and when somebody asks.
    pub(super) fn stopwatch(&self) -> Option<wgpu::QuerySet> {
        (self.timed && self.has_timestamps && !self.is_software()).then(|| {
            self.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            })
        })
    }

    /// Sends a pass off; when passes are timed, waits for it.
    pub(super) fn submit(
        &self,
        run: &Run,
        name: &str,
        mut encoder: wgpu::CommandEncoder,
        stopwatch: Option<wgpu::QuerySet>,
    ) -> Result<(), Problem> {
        let resolved = stopwatch.map(|queries| {
            let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: 256,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            encoder.resolve_query_set(&queries, 0..2, &buffer, 0);
            buffer
        });
        self.queue.submit([encoder.finish()]);
        if self.timed {
            self.wait()?;
        }
        self.check(name)?;
        if let Some(buffer) = resolved {
            let bytes = self.read_buffer(&buffer, 16)?;
            let ticks = |i: usize| u64::from_le_bytes(bytes[8 * i..8 * i + 8].try_into().expect("8 bytes"));
            let nanoseconds = ticks(1).saturating_sub(ticks(0)) as f64 * self.queue.get_timestamp_period() as f64;
            run.took(Duration::from_nanos(nanoseconds as u64));
        }
        Ok(())
    }

    /// Waits until everything that was sent off is done.
    pub fn wait(&self) -> Result<(), Problem> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).map(|_| ()).map_err(|error| lost(&error.to_string()))
    }

    /// What the device has complained of since it was last asked.
    pub fn check(&self, name: &str) -> Result<(), Problem> {
        if let Some(why) = self.gone.get() {
            return Err(lost(why));
        }
        let errors = std::mem::take(&mut *self.errors.lock().expect("no panic while noting an error"));
        match errors.first() {
            None => Ok(()),
            Some(error) if error.contains("Out of Memory") || error.contains("out of memory") => {
                Err(Problem::new(Cause::Unfinished, format!("{name}: the device is out of memory"))
                    .hint("render a smaller --size, or with fewer samples per pixel (antialias: 1)"))
            }
            Some(error) => Err(Problem::new(Cause::Unfinished, format!("{name}: the device refused: {error}"))
                .hint("this is a mistake in the shader or in the program; `diaphane doctor` shows the adapter")),
        }
    }

    /// The first `bytes` of a buffer.
    pub fn read_buffer(&self, buffer: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, Problem> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: bytes,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes);
        self.queue.submit([encoder.finish()]);
        self.map(&staging)
    }

    /// The texels of a texture's first layer, row by row, top first.
    pub fn read_texture(&self, texture: &Texture) -> Result<Vec<u8>, Problem> {
        self.read_layer(texture, 0)
    }

    /// The texels of one layer of a texture, row by row, top first.
    pub fn read_layer(&self, texture: &Texture, layer: u32) -> Result<Vec<u8>, Problem> {
        let row = texture.shape.width * texture.shape.format.bytes_per_texel();
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: padded as u64 * texture.shape.height as u64,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                ..texture.texture.as_image_copy()
            },
            wgpu::TexelCopyBufferInfo {
                buffer: &staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded),
                    rows_per_image: Some(texture.shape.height),
                },
            },
            wgpu::Extent3d { depth_or_array_layers: 1, ..texture.shape.extent() },
        );
        self.queue.submit([encoder.finish()]);
        let bytes = self.map(&staging)?;
        Ok(bytes.chunks_exact(padded as usize).flat_map(|line| &line[..row as usize]).copied().collect())
    }

    fn map(&self, staging: &wgpu::Buffer) -> Result<Vec<u8>, Problem> {
        let (sender, receiver) = std::sync::mpsc::channel();
        staging.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            sender.send(result).ok(); // nobody listens when the wait below has failed already
        });
        self.wait()?;
        self.check("reading back")?;
        match receiver.try_recv() {
            Ok(Ok(())) => {}
            _ => return Err(lost("nothing could be read back")),
        }
        let bytes = staging.get_mapped_range(..).map_err(|error| lost(&error.to_string()))?.to_vec();
        staging.unmap();
        Ok(bytes)
    }
}

fn lost(why: &str) -> Problem {
    Problem::new(Cause::Unfinished, format!("the device was lost: {why}")).hint("run the same command again")
}
