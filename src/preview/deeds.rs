//! What becomes of what hands and programs want.

use super::camera;
use super::channel::Order;
use super::panel::Wish;
use super::screen::{Painting, Screen};
use super::stage::Viewing;
use super::window::Preview;
use crate::frame::ball;
use crate::image::tone::linear_from_srgb;
use crate::image::{Display, Format, Image, Tone, write_file};
use crate::problem::{Cause, Problem, Problems};
use crate::render;
use crate::scene::TechniqueText;
use crate::store::Key;
use glam::{DVec2, DVec3};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;
use winit::dpi::PhysicalSize;

impl Preview {
    pub fn grant(&mut self, wish: Wish, screen: &mut Screen) {
        let height = self.place.1 as f64 / screen.window.scale_factor();
        let now = Instant::now();
        if matches!(wish, Wish::Orbit(_) | Wish::Pan(_) | Wish::Zoom(_) | Wish::Time(_)) {
            self.pace.moved(now);
        }
        let camera = &mut self.viewing.camera;
        match wish {
            Wish::Orbit(drag) => camera::orbit(camera, drag, height),
            Wish::Pan(drag) => camera::pan(camera, drag, height),
            Wish::Zoom(notches) => camera::zoom(camera, notches),
            Wish::Frame(object) => self.look_at(object),
            Wish::Camera(from) => *camera = from,
            Wish::Pick(place, look_there) => {
                let through = Viewing { camera: camera::through(camera, place), size: (1, 1), ..self.viewing };
                // What cannot be drawn says so with the picture.
                self.panel.chosen = self.stage.seen(&screen.gpu, &through).unwrap_or_default();
                if look_there && self.panel.chosen.is_some() {
                    self.look_at(self.panel.chosen);
                }
            }
            Wish::Choose(object) => self.panel.chosen = object,
            Wish::Technique(ron) => self.choose(&ron),
            Wish::Display(display) => self.viewing.display = display,
            Wish::Time(time_s) => {
                if let Some(mut subject) = self.stage.subject().cloned() {
                    subject.look.view.time_s = time_s;
                    self.want(subject);
                }
            }
            Wish::Play(play) => {
                let time_s = self.stage.subject().map_or(0.0, |subject| subject.look.view.time_s);
                self.playing = play.then_some((now, time_s));
            }
            Wish::Screenshot => self.write_picture(screen, None),
            Wish::Panel => self.panel.shown ^= true,
        }
        self.redraw_soon();
    }

    pub fn obey(&mut self, order: Order) {
        let wish = match order {
            Order::Resize(0, _) | Order::Resize(_, 0) => return self.resize(PhysicalSize::new(0, 0)),
            Order::Resize(width, height) => return self.resize(PhysicalSize::new(width, height)),
            Order::Visible(visible) => {
                self.screen.iter().for_each(|screen| screen.window.set_visible(visible));
                return self.redraw_soon();
            }
            Order::Camera(name) => {
                let scene = self.stage.subject().map(|subject| subject.scene.clone());
                match scene.and_then(|scene| scene.bookmarks.get(&name).copied()) {
                    Some(camera) => Wish::Camera(camera),
                    None => return self.refuse(&format!("there is no bookmark `{name}`")),
                }
            }
            Order::Orbit(x, y) => Wish::Orbit(DVec2::new(x, y)),
            Order::Pan(x, y) => Wish::Pan(DVec2::new(x, y)),
            Order::Zoom(notches) => Wish::Zoom(notches),
            Order::Frame(None) => Wish::Frame(None),
            Order::Frame(Some(name)) => {
                let scene = self.stage.subject().map(|subject| subject.scene.clone());
                match scene.and_then(|scene| scene.objects.iter().position(|object| object.name == name)) {
                    Some(place) => Wish::Frame(Some(place)),
                    None => return self.refuse(&format!("there is no object `{name}`")),
                }
            }
            Order::Technique(ron) => Wish::Technique(ron),
            Order::Exposure(ev) => Wish::Display(Display { exposure_ev: ev as f32, ..self.viewing.display }),
            Order::Time(time_s) => Wish::Time(time_s),
            Order::Play(play) => Wish::Play(play),
            Order::Panel => Wish::Panel,
            Order::Screenshot(file) => return self.with_screen(|own, screen| own.write_picture(screen, file)),
            Order::Capture(file) => {
                self.capture = Some(file);
                return self.redraw_soon();
            }
            Order::Status => return self.tell_status(),
            Order::LoseDevice => {
                self.screen.iter().for_each(|screen| screen.gpu.device.destroy());
                return self.redraw_soon();
            }
            Order::Close => return,
        };
        self.with_screen(|own, screen| own.grant(wish, screen));
    }

    /// The screen stands apart while something is done with it and the rest.
    fn with_screen(&mut self, deed: impl FnOnce(&mut Preview, &mut Screen)) {
        if let Some(mut screen) = self.screen.take() {
            deed(self, &mut screen);
            self.screen = Some(screen);
            self.redraw_soon();
        }
    }

    fn resize(&mut self, size: PhysicalSize<u32>) {
        let Some(screen) = &mut self.screen else { return };
        // No desktop lets a program make a window without pixels; some do it themselves when it is minimised.
        let granted = if size.width == 0 { Some(size) } else { screen.window.request_inner_size(size) };
        screen.resize(granted.unwrap_or_else(|| screen.window.inner_size()));
        self.redraw_soon();
    }

    fn refuse(&self, what: &str) {
        let problem = Problem::new(Cause::Words, what);
        self.channel.say("refused", json!({ "problems": [problem.json()] }));
    }

    /// The technique of every object that names none.
    fn choose(&mut self, ron: &str) {
        let Some(mut subject) = self.stage.subject().cloned() else { return };
        let checked = TechniqueText::from_flag("technique", ron)
            .map_err(Problems::from)
            .and_then(|text| render::check(&subject.scene, &text).map(|()| text));
        match checked {
            Ok(text) => {
                subject.look.technique = text;
                self.refused = Problems::default();
                self.want(subject);
            }
            Err(problems) => self.refused = problems,
        }
    }

    /// Looks at an object, or at all that is there.
    fn look_at(&mut self, object: Option<usize>) {
        let Some(subject) = self.stage.subject() else { return };
        let objects = &subject.scene.objects;
        let balls: Vec<(DVec3, f64)> = match object.and_then(|place| objects.get(place)) {
            Some(object) => vec![ball(object)],
            None => objects.iter().filter(|object| object.visible).map(ball).collect(),
        };
        if balls.is_empty() {
            return;
        }
        let center = balls.iter().map(|(center, _)| *center).sum::<DVec3>() / balls.len() as f64;
        let radius = balls.iter().map(|(at, radius)| at.distance(center) + radius).fold(0.0, f64::max);
        let aspect = self.place.0 as f64 / self.place.1 as f64;
        camera::frame(&mut self.viewing.camera, center, radius, aspect);
    }

    /// Writes the picture as `diaphane render` would, without the panel.
    fn write_picture(&mut self, screen: &mut Screen, file: Option<PathBuf>) {
        let viewing = Viewing { size: self.place, ..self.viewing };
        let written = self.stage.image(&screen.gpu, &viewing).and_then(|found| {
            let Some((image, subject)) = found else {
                return Err(Problem::new(Cause::Unfinished, "there is no picture yet"));
            };
            let text = [
                ("Software", concat!("diaphane ", env!("CARGO_PKG_VERSION"))),
                ("diaphane:scene", &Key::of(&*subject.scene).to_string()),
                ("diaphane:technique", &subject.look.technique.ron),
            ];
            let bytes = image.encode(Format::Png, viewing.display, &text)?;
            match file {
                Some(file) => write_file(&file, &bytes).map(|()| file),
                None => write_beside(&self.path, &bytes),
            }
        });
        self.tell_written("screenshot", written);
    }

    /// Writes all of the window.
    pub fn write_capture(&mut self, screen: &mut Screen, painting: &Painting, file: PathBuf) {
        let written = screen.capture(painting).and_then(|captured| {
            let (levels, (width, height)) = (captured.levels, captured.size);
            let pixels = levels.iter().map(|texel| texel.map(|level| linear_from_srgb(f32::from(level) / 255.0)));
            let image = Image { width, height, pixels: pixels.collect() };
            let display = Display { tone: Tone::Srgb, exposure_ev: 0.0 };
            write_file(&file, &image.encode(Format::Png, display, &[])?)?;
            Ok(file)
        });
        self.tell_written("captured", written);
    }

    fn tell_written(&mut self, event: &str, written: Result<PathBuf, Problem>) {
        let note = match &written {
            Ok(file) => {
                self.channel.say(event, json!({ "path": file.display().to_string() }));
                format!("wrote {}", file.display())
            }
            Err(problem) => {
                self.channel.say("refused", json!({ "problems": [problem.json()] }));
                problem.to_string()
            }
        };
        if event == "screenshot" {
            self.note = Some((Instant::now(), note));
            self.redraw_soon();
        }
    }
}

/// Writes a picture of a scene under a name that is free: beside it, else where the program was started.
fn write_beside(scene: &Path, bytes: &[u8]) -> Result<PathBuf, Problem> {
    let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
    let beside = scene.parent().unwrap_or(Path::new(""));
    let free = |folder: &Path| {
        let names = (1..).map(|n| folder.join(format!("{stem}-{n}.png")));
        names.into_iter().find(|file| file.symlink_metadata().is_err()).expect("there are more numbers than files")
    };
    let file = free(beside);
    match write_file(&file, bytes) {
        Ok(()) => Ok(file),
        Err(_) => {
            let file = free(Path::new(""));
            write_file(&file, bytes).map(|()| file)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_written_beside_their_scene_and_never_over_another() {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("a.b.ron");
        let first = write_beside(&scene, b"1").unwrap();
        let second = write_beside(&scene, b"2").unwrap();
        assert_eq!(
            (first.as_path(), second.as_path()),
            (&*folder.path().join("a.b-1.png"), &*folder.path().join("a.b-2.png"))
        );
        assert_eq!(std::fs::read(first).unwrap(), b"1");
    }
}
