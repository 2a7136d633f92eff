//! One frame of the window: what moves by itself, what is laid out, the picture, and both on the screen.

use super::overlay::{self, Said, Waits};
use super::panel::{self, Facts, Wish};
use super::screen::{Painting, Screen};
use super::stage::Drawn;
use super::window::Preview;
use crate::problem::{Cause, Problem};
use crate::store::Origin;
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;

/// How long a note stays.
const NOTE: Duration = Duration::from_secs(5);

impl Preview {
    /// One frame, if the window has pixels.
    pub fn redraw(&mut self, event_loop: &ActiveEventLoop) {
        let Some(mut screen) = self.screen.take() else { return };
        if screen.size().is_none() {
            self.screen = Some(screen);
            return;
        }
        let drawn = self.frame(&mut screen);
        let lost = screen.gpu.is_lost();
        self.screen = Some(screen);
        match drawn {
            Ok(()) if !lost => self.tell_problems(),
            Ok(()) => self.rebuild(event_loop, Problem::new(Cause::Unfinished, "the device was lost")),
            Err(problem) => self.rebuild(event_loop, problem),
        }
    }

    fn frame(&mut self, screen: &mut Screen) -> Result<(), Problem> {
        // The device says only to those who ask that it is gone.
        screen.gpu.device.poll(wgpu::PollType::Poll).ok();
        screen.gpu.check("the window")?;
        self.frames += 1;
        let now = Instant::now();
        self.play(now);
        let (mut painting, wishes, repaint) = self.lay_out(screen);
        wishes.into_iter().for_each(|wish| self.grant(wish, screen));
        screen.gpu.timed = self.panel.timed && self.panel.shown;
        // A small picture may take longer than the quiet after which the whole one is due.
        let small = self.pace.share(now) < 1.0;
        self.draw(screen, now);
        let rest = small.then(|| self.pace.rest(Instant::now()).unwrap_or_else(Instant::now));
        self.next = [rest, repaint].into_iter().flatten().min();
        if !screen.present(&mut painting)? {
            self.next = Some(now + Duration::from_millis(50));
        }
        if let Some(file) = self.capture.take() {
            self.write_capture(screen, &painting, file);
        }
        Ok(())
    }

    fn play(&mut self, now: Instant) {
        let Some((began, from)) = self.playing else { return };
        // A frame that is on its way is finished first, or none ever would be.
        if self.drawn.as_ref().is_none_or(|drawn| drawn.current)
            && let Some(subject) = self.stage.subject()
        {
            let mut subject = subject.clone();
            subject.look.view.time_s = from + (now - began).as_secs_f64();
            self.pace.moved(now);
            self.want(subject);
            self.redraw_soon();
        }
    }

    /// Panel, picture and what is said over it: what to paint, what hands want, and when to do this again by itself.
    fn lay_out(&mut self, screen: &mut Screen) -> (Painting, Vec<Wish>, Option<Instant>) {
        self.note.take_if(|(since, _)| since.elapsed() > NOTE);
        let problems = self.problems();
        let Some(state) = &mut self.input else { unreachable!("a screen comes with its input") };
        let input = state.take_egui_input(&screen.window);
        let current = self.drawn.as_ref().is_some_and(|drawn| drawn.current);
        let waits = match (current && !self.reads, self.stage.subject()) {
            (true, _) => None,
            (false, Some(_)) if !self.reads && problems.0.is_empty() => {
                Some(Waits::ForStep(self.stage.progress(), self.drawn.is_some()))
            }
            (false, None) if problems.0.is_empty() => Some(Waits::ForFiles),
            _ => None,
        };
        let said = Said {
            problems: &problems,
            waits,
            refines: self.drawn.as_ref().filter(|drawn| drawn.refines).and_then(|drawn| drawn.level),
            note: self.note.as_ref().map(|(_, note)| note.as_str()),
        };
        let home = self.base.as_ref().map(|base| base.camera);
        let subject = self.stage.subject().cloned();
        let gpu = &screen.gpu;
        let adapter = format!("{}{}", gpu.adapter.name, if gpu.is_software() { " (draws on the CPU)" } else { "" });
        let facts = subject.as_ref().zip(home).map(|(subject, home)| Facts {
            subject,
            home,
            viewing: &self.viewing,
            drawn: self.drawn.as_ref(),
            times: &self.times,
            warnings: &self.warnings,
            adapter,
            playing: self.playing.is_some(),
        });
        let panel = &mut self.panel;
        let mut wishes = Vec::new();
        let mut place = egui::Rect::NOTHING;
        let (playing, picture) = (self.playing.is_some(), screen.picture);
        let output = self.egui.run_ui(input, |ui| {
            wishes.clear();
            overlay::keys(ui, home.map(Wish::Camera), panel.chosen, playing, &mut wishes);
            if let Some(facts) = &facts
                && panel.shown
                && ui.available_width() >= panel::FITS
            {
                egui::Panel::right("panel").exact_size(panel::WIDTH).resizable(false).show(ui, |ui| {
                    panel.ui(ui, facts, &mut wishes);
                });
            }
            egui::CentralPanel::no_frame().show(ui, |ui| {
                place = overlay::picture(ui, picture, &said, &mut wishes);
            });
        });
        state.handle_platform_output(&screen.window, output.platform_output);
        let pixels = place.size() * output.pixels_per_point;
        self.place = (pixels.x.round().max(1.0) as u32, pixels.y.round().max(1.0) as u32);
        let again = output.viewport_output.values().map(|viewport| viewport.repaint_delay).min();
        let repaint = again.and_then(|delay| Instant::now().checked_add(delay));
        let note = self.note.as_ref().map(|(since, _)| *since + NOTE);
        let jobs = self.egui.tessellate(output.shapes, output.pixels_per_point);
        let painting = Painting { jobs, textures: output.textures_delta, pixels_per_point: output.pixels_per_point };
        (painting, wishes, [repaint, note].into_iter().flatten().min())
    }

    /// The newest picture that can be had.
    fn draw(&mut self, screen: &mut Screen, now: Instant) {
        let share = self.pace.share(now) * self.panel.quality;
        let side = |pixels: u32| ((pixels as f64 * share).round() as u32).max(1);
        self.viewing.size = (side(self.place.0), side(self.place.1));
        self.viewing.moving = self.pace.rest(now).is_some();
        let drawn = self.stage.draw(&screen.gpu, &self.viewing);
        let Some(drawn) = drawn else {
            self.drawn.iter_mut().for_each(|drawn| drawn.current = false);
            self.tell_waiting();
            return;
        };
        if !drawn.current {
            self.tell_waiting();
        }
        let old = self.drawn.as_ref().map(|old| (old.key, old.current, old.refines));
        if old != Some((drawn.key, drawn.current, drawn.refines)) {
            self.redraw_soon(); // what was laid out before knew nothing of it
        }
        match &mut self.drawn {
            // The same picture again: what it took is what it took when it was made.
            Some(old) if old.key == drawn.key => (old.current, old.refines) = (drawn.current, drawn.refines),
            _ => self.show(screen, drawn),
        }
    }

    /// A new picture.
    fn show(&mut self, screen: &mut Screen, drawn: Drawn) {
        let made = std::mem::take(&mut self.made);
        let shape = drawn.picture.0[0].shape;
        if let Some(time) = drawn.cost(&made) {
            self.pace.took(time, shape.width as f64 / self.place.0 as f64);
        }
        if drawn.finished.iter().any(|step| step.origin == Origin::Ran) {
            self.times.note(&drawn.finished);
            self.rebuilt = false;
        }
        let whole = (shape.width, shape.height) == self.place;
        screen.show(&drawn.picture, whole);
        if self.channel.open {
            self.tell_picture(screen, &drawn, &made, whole);
        }
        self.drawn = Some(drawn);
    }
}
