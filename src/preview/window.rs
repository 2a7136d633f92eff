//! The event loop: what happens when. The only place that knows winit.

use super::channel::{Channel, Order};
use super::pace::{Pace, Times};
use super::panel::Panel;
use super::screen::Screen;
use super::stage::{Drawn, Stage, Viewing};
use super::worker::{News, Reading, Tell};
use super::{Asked, Subject};
use crate::gpu::Shaders;
use crate::image::Display;
use crate::problem::{Cause, Problem, Problems};
use crate::render;
use crate::scene::{Camera, Reader, TechniqueText};
use crate::store::{Files, Finished, Follow};
use crate::techniques::reference::Reference;
use serde_json::json;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Instant;
use winit::application::ApplicationHandler;
use winit::dpi::{LogicalSize, PhysicalSize, Size};
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::window::{Window, WindowId};

/// What other threads bring.
enum Brought {
    News(News),
    /// Some file may have changed.
    Files,
    Order(Order),
    Close,
}

/// As the files and flags say; what hands changed stands until these change.
#[derive(Clone, PartialEq)]
pub(super) struct Base {
    pub camera: Camera,
    technique: TechniqueText,
    time_s: f64,
    display: Display,
}

impl Base {
    fn of(subject: &Subject) -> Base {
        let look = &subject.look;
        let settings = &subject.scene.view;
        Base {
            camera: look.view.camera,
            technique: look.technique.clone(),
            time_s: look.view.time_s,
            display: Display { tone: settings.tone, exposure_ev: settings.exposure_ev as f32 },
        }
    }
}

/// All that the window is.
pub(super) struct Preview {
    pub path: PathBuf,
    adapter: Option<String>,
    size: Size,
    pub channel: Channel,
    pub stage: Stage,
    reading: Reading,
    pub reads: bool,
    files: Arc<Files>,
    follow: Follow,
    pub egui: egui::Context,
    pub input: Option<egui_winit::State>,
    /// What is drawn on; who draws has taken it.
    pub screen: Option<Screen>,
    window: Option<Arc<Window>>,
    pub panel: Panel,
    pub base: Option<Base>,
    pub viewing: Viewing,
    /// The picture's place, pixels.
    pub place: (u32, u32),
    pub pace: Pace,
    pub times: Times,
    pub drawn: Option<Drawn>,
    /// What the worker made since the last picture.
    pub made: Vec<Finished>,
    pub warnings: Vec<Problem>,
    /// A choice that is not possible with this scene.
    pub refused: Problems,
    /// The problems that were told last.
    pub told: Problems,
    pub note: Option<(Instant, String)>,
    /// When it began, and the scene's time then.
    pub playing: Option<(Instant, f64)>,
    pub capture: Option<PathBuf>,
    pub told_waiting: bool,
    pub frames: u64,
    /// Whether the device was opened anew and has drawn nothing yet.
    pub rebuilt: bool,
    pub next: Option<Instant>,
    end: Option<Problem>,
}

/// Opens the window, and stays until it is closed.
pub fn open(asked: Asked) -> Result<(), Problem> {
    let no_window = |error: &dyn std::fmt::Display| {
        Problem::new(Cause::Adapter, format!("no window can be opened: {error}")).hint(
            "a window needs a desktop; `diaphane render SCENE -o OUT.png` makes a picture without one, and under \
             `xvfb-run` there is a desktop that nobody sees",
        )
    };
    let event_loop = EventLoop::with_user_event().build().map_err(|error| no_window(&error))?;
    let proxy = event_loop.create_proxy();
    let interrupted = event_loop.create_proxy();
    // A second handler cannot be set; the first serves. The window may be gone by then.
    ctrlc::set_handler(move || drop(interrupted.send_event(Brought::Close))).ok();
    let mut preview = Preview::new(asked, move |brought| drop(proxy.send_event(brought)));
    event_loop.run_app(&mut preview).map_err(|error| no_window(&error))?;
    preview.channel.say("closed", json!({ "frames": preview.frames }));
    match preview.end {
        Some(problem) => Err(problem),
        None => Ok(()),
    }
}

impl Preview {
    fn new(asked: Asked, bring: impl Fn(Brought) + Clone + Send + 'static) -> Preview {
        let files = Arc::<Files>::default();
        let shaders = Shaders::new(Shaders::usual_folder(), files.clone()).with_stand_ins();
        let reader = Reader::new(files.clone());
        let Asked { options, scene, look, size, json } = asked;
        let channel = Channel { open: json };
        let sender = Mutex::new(bring.clone());
        let tell: Tell = Arc::new(move |news| {
            sender.lock().expect("nobody panics while telling")(Brought::News(news));
        });
        let (path, sets, read_files) = (scene.clone(), options.sets.clone(), files.clone());
        let read = move || {
            read_files.forget();
            let (scene, warnings) = reader.scene(&path, &sets)?;
            let look = look(&scene)?;
            Ok((Subject { scene: Arc::new(scene), look }, warnings))
        };
        let orders = bring.clone();
        channel.listen(move |order| orders(Brought::Order(order)));
        Preview {
            reading: Reading::start(read, tell.clone()),
            reads: false,
            files,
            follow: Follow::new(move || bring(Brought::Files)),
            adapter: options.adapter.clone(),
            size: match size {
                Some((width, height)) => PhysicalSize::new(width, height).into(),
                None => LogicalSize::new(1280, 720).into(),
            },
            channel,
            stage: Stage::new(options, shaders, tell),
            path: scene,
            egui: egui::Context::default(),
            input: None,
            screen: None,
            window: None,
            panel: Panel::default(),
            base: None,
            viewing: Viewing { camera: Camera::default(), size: (1, 1), display: Display::default(), moving: false },
            place: (1, 1),
            pace: Pace::default(),
            times: Times::default(),
            drawn: None,
            made: Vec::new(),
            warnings: Vec::new(),
            refused: Problems::default(),
            told: Problems::default(),
            note: None,
            playing: None,
            capture: None,
            told_waiting: false,
            frames: 0,
            rebuilt: false,
            next: None,
            end: None,
        }
    }

    pub fn redraw_soon(&self) {
        if let Some(window) = &self.window {
            window.request_redraw();
        }
    }

    pub fn read_files(&mut self) {
        self.reads = true;
        self.reading.ask();
    }

    /// From now on this is to be seen.
    pub fn want(&mut self, subject: Subject) {
        let technique = &subject.look.technique;
        if self.stage.subject().is_none_or(|old| old.look.technique != *technique) {
            self.pace.start_anew(technique.name == Reference::NAME);
        }
        self.stage.want(subject);
    }

    /// What the files hold by now.
    fn read(&mut self, read: Result<(Subject, Vec<Problem>), Problems>) {
        self.reads = false;
        match read {
            Err(problems) => self.stage.read(problems),
            Ok((mut subject, warnings)) => {
                self.stage.read(Problems::default());
                self.warnings = warnings;
                self.refused = Problems::default();
                let base = Base::of(&subject);
                let old = self.base.replace(base.clone());
                if old.as_ref().is_none_or(|old| old.camera != base.camera) {
                    self.viewing.camera = base.camera;
                }
                if old.as_ref().is_none_or(|old| old.display != base.display) {
                    self.viewing.display = base.display;
                }
                if let (Some(old), Some(now)) = (old, self.stage.subject()) {
                    if old.technique == base.technique {
                        subject.look.technique = now.look.technique.clone();
                    }
                    if old.time_s == base.time_s {
                        subject.look.view.time_s = now.look.view.time_s;
                    }
                    if now.scene == subject.scene {
                        subject.scene = now.scene.clone();
                    }
                }
                // A technique that was chosen by hand may be impossible by now.
                if let Err(problems) = render::check(&subject.scene, &subject.look.technique) {
                    self.refused = problems;
                    subject.look.technique = base.technique;
                }
                self.want(subject);
            }
        }
        self.stage.name_files();
        self.follow.depend_on(&self.files);
        self.redraw_soon();
    }

    fn hear(&mut self, news: News) {
        match news {
            News::Read(read) => self.read(read),
            // Who looks at a picture is not disturbed while a better one is made.
            News::Progress if self.drawn.as_ref().is_some_and(|drawn| drawn.current) => {}
            news => {
                self.made.extend(self.stage.hear(news));
                self.redraw_soon();
            }
        }
    }

    /// Everything that lives on the device, once more: it was lost. The second time in a row it is given up.
    pub fn rebuild(&mut self, event_loop: &ActiveEventLoop, why: Problem) {
        let screen = self.screen.take();
        // What the old device holds has to go before the window gets another surface.
        self.drawn = None;
        self.stage.forget_device();
        drop(screen);
        if self.rebuilt {
            return self.give_up(event_loop, why);
        }
        self.rebuilt = true;
        let Some(window) = self.window.clone() else { return };
        match self.set_up(window) {
            Ok(()) => self.channel.say("rebuilt", json!({ "problems": [why.json()] })),
            Err(problem) => self.give_up(event_loop, problem),
        }
    }

    fn give_up(&mut self, event_loop: &ActiveEventLoop, problem: Problem) {
        self.end = Some(problem);
        event_loop.exit();
    }

    /// Device, surface and panel for a window.
    fn set_up(&mut self, window: Arc<Window>) -> Result<(), Problem> {
        let screen = Screen::open(window.clone(), self.adapter.as_deref())?;
        // The panel's textures live on the device.
        self.egui = egui::Context::default();
        self.egui.set_theme(egui::Theme::Dark);
        self.input = Some(egui_winit::State::new(
            self.egui.clone(),
            egui::ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            None,
            Some(screen.gpu.device.limits().max_texture_dimension_2d as usize),
        ));
        self.screen = Some(screen);
        self.window = Some(window);
        self.redraw_soon();
        Ok(())
    }
}

impl ApplicationHandler<Brought> for Preview {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.screen.is_some() {
            return;
        }
        let name = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let attributes =
            Window::default_attributes().with_title(format!("{name} - diaphane")).with_inner_size(self.size);
        let window = event_loop.create_window(attributes).map(Arc::new);
        let set_up = window
            .map_err(|error| Problem::new(Cause::Adapter, format!("no window can be opened: {error}")))
            .and_then(|window| self.set_up(window));
        match set_up {
            Ok(()) => {
                if let Some(screen) = &self.screen {
                    let gpu = &screen.gpu;
                    let (width, height) = screen.size().unwrap_or_default();
                    let facts = json!({
                        "adapter": gpu.adapter.name, "software": gpu.is_software(), "width": width, "height": height,
                    });
                    self.channel.say("ready", facts);
                }
                self.read_files();
            }
            Err(problem) => self.give_up(event_loop, problem),
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        if matches!(cause, StartCause::ResumeTimeReached { .. }) {
            self.next = None;
            self.redraw_soon();
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, brought: Brought) {
        match brought {
            Brought::News(news) => self.hear(news),
            Brought::Files => {
                if !self.follow.changed().is_empty() {
                    self.read_files();
                }
            }
            Brought::Order(Order::Close) | Brought::Close => event_loop.exit(),
            Brought::Order(order) => self.obey(order),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let (Some(screen), Some(input)) = (&mut self.screen, &mut self.input) else { return };
        let response = input.on_window_event(&screen.window, &event);
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::RedrawRequested => self.redraw(event_loop),
            WindowEvent::Resized(size) => {
                screen.resize(size);
                self.redraw_soon();
            }
            _ if response.repaint => self.redraw_soon(),
            _ => {}
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        event_loop.set_control_flow(self.next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }
}
