//! The surface of the window, and what is painted on it.

use crate::gpu::{Format, Gpu, Images, Shape};
use crate::problem::{Cause, Problem};
use egui::{ClippedPrimitive, TextureId, TexturesDelta};
use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use std::sync::Arc;
use wgpu::CurrentSurfaceTexture as Current;
use winit::dpi::PhysicalSize;
use winit::window::Window;

pub struct Screen {
    pub window: Arc<Window>,
    pub gpu: Gpu,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    /// The window's size differs from the surface's.
    outdated: bool,
    renderer: Renderer,
    /// What stands for the picture among the things to paint.
    pub picture: TextureId,
}

/// What is to be painted.
pub struct Painting {
    pub jobs: Vec<ClippedPrimitive>,
    pub textures: TexturesDelta,
    pub pixels_per_point: f32,
}

/// What a window shows: red, green and blue of each pixel, row 0 at the top.
pub struct Captured {
    pub levels: Vec<[u8; 3]>,
    pub size: (u32, u32),
}

impl Screen {
    pub fn open(window: Arc<Window>, adapter: Option<&str>) -> Result<Screen, Problem> {
        let (gpu, surface, capabilities) = Gpu::open_for(window.clone(), adapter)?;
        // Levels are written as they are, so the format must not encode them once more.
        let known = [wgpu::TextureFormat::Bgra8Unorm, wgpu::TextureFormat::Rgba8Unorm];
        let format = known.into_iter().find(|format| capabilities.formats.contains(format)).ok_or_else(|| {
            Problem::new(Cause::Adapter, format!("the window has none of the formats {known:?}"))
                .hint("try another adapter with --adapter; `diaphane doctor` lists them")
        })?;
        let PhysicalSize { width, height } = window.inner_size();
        let config = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            color_space: wgpu::SurfaceColorSpace::Auto,
            width,
            height,
            desired_maximum_frame_latency: 2,
            present_mode: wgpu::PresentMode::AutoVsync,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: Vec::new(),
        };
        let options = RendererOptions { dithering: false, ..RendererOptions::default() };
        let mut renderer = Renderer::new(&gpu.device, format, options);
        let nothing = gpu.texture_with(Shape::flat((1, 1), Format::Rgba8Unorm), &[0, 0, 0, 255]);
        let picture = renderer.register_native_texture(&gpu.device, &nothing.view, wgpu::FilterMode::Nearest);
        Ok(Screen { window, gpu, surface, config, outdated: true, renderer, picture })
    }

    pub fn resize(&mut self, size: PhysicalSize<u32>) {
        self.outdated |= (size.width, size.height) != (self.config.width, self.config.height);
        (self.config.width, self.config.height) = (size.width, size.height);
    }

    /// Pixels; none of a minimised window.
    pub fn size(&self) -> Option<(u32, u32)> {
        let largest = self.gpu.device.limits().max_texture_dimension_2d;
        let (width, height) = (self.config.width.min(largest), self.config.height.min(largest));
        (width > 0 && height > 0).then_some((width, height))
    }

    /// From now on this is the picture. Smaller ones than the place for it are stretched.
    pub fn show(&mut self, picture: &Images, whole: bool) {
        let filter = if whole { wgpu::FilterMode::Nearest } else { wgpu::FilterMode::Linear };
        let view = &picture.0[0].view;
        self.renderer.update_egui_texture_from_wgpu_texture(&self.gpu.device, view, filter, self.picture);
    }

    /// Paints, and shows it. False: the surface was not ready, so ask again.
    pub fn present(&mut self, painting: &mut Painting) -> Result<bool, Problem> {
        let mut textures = std::mem::take(&mut painting.textures);
        for (id, deltas) in &textures.set {
            for delta in deltas {
                self.renderer.update_texture(&self.gpu.device, &self.gpu.queue, *id, delta);
            }
        }
        let free: Vec<TextureId> = textures.free.iter().copied().collect();
        textures.clear(); // it insists on being dealt with
        let painting = &*painting;
        let shown = self.surface_texture()?.map(|texture| {
            let view = texture.texture.create_view(&Default::default());
            self.paint(painting, &view);
            self.window.pre_present_notify();
            self.gpu.queue.present(texture);
        });
        free.iter().for_each(|id| self.renderer.free_texture(id));
        self.gpu.check("the window")?;
        Ok(shown.is_some())
    }

    /// The next texture of the surface, made anew if the window changed. None: not now.
    fn surface_texture(&mut self) -> Result<Option<wgpu::SurfaceTexture>, Problem> {
        let Some((width, height)) = self.size() else { return Ok(None) };
        for _ in 0..2 {
            if std::mem::take(&mut self.outdated) {
                let config = wgpu::SurfaceConfiguration { width, height, ..self.config.clone() };
                self.surface.configure(&self.gpu.device, &config);
                // A window may change again while this is done.
                self.gpu.check("the window's surface")?;
            }
            match self.surface.get_current_texture() {
                Current::Success(texture) => return Ok(Some(texture)),
                Current::Suboptimal(texture) => {
                    self.outdated = true;
                    return Ok(Some(texture));
                }
                Current::Outdated => self.outdated = true,
                Current::Timeout | Current::Occluded => return Ok(None),
                Current::Lost | Current::Validation => {
                    self.gpu.check("the window's surface")?;
                    return Err(Problem::new(Cause::Unfinished, "the window's surface was lost"));
                }
            }
        }
        Ok(None)
    }

    fn paint(&mut self, painting: &Painting, view: &wgpu::TextureView) {
        let (width, height) = self.size().expect("who paints has a size");
        let screen = ScreenDescriptor { size_in_pixels: [width, height], pixels_per_point: painting.pixels_per_point };
        let Gpu { device, queue, .. } = &self.gpu;
        let mut encoder = device.create_command_encoder(&Default::default());
        let more = self.renderer.update_buffers(device, queue, &mut encoder, &painting.jobs, &screen);
        let mut pass = encoder
            .begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("window"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                ..Default::default()
            })
            .forget_lifetime();
        self.renderer.render(&mut pass, &painting.jobs, &screen);
        drop(pass);
        queue.submit(more.into_iter().chain([encoder.finish()]));
    }

    /// The whole window.
    pub fn capture(&mut self, painting: &Painting) -> Result<Captured, Problem> {
        let size = self.size().ok_or_else(|| Problem::new(Cause::Unfinished, "a minimised window shows nothing"))?;
        let swapped = self.config.format == wgpu::TextureFormat::Bgra8Unorm;
        let format = if swapped { Format::Bgra8Unorm } else { Format::Rgba8Unorm };
        let texture = self.gpu.texture(Shape::flat(size, format));
        self.paint(painting, &texture.view);
        let bytes = self.gpu.read_texture(&texture)?;
        let level = |texel: &[u8]| match swapped {
            true => [texel[2], texel[1], texel[0]],
            false => [texel[0], texel[1], texel[2]],
        };
        Ok(Captured { levels: bytes.chunks_exact(4).map(level).collect(), size })
    }
}
