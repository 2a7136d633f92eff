//! The panel beside the picture: what is chosen, what it takes, what is left out.

use super::Subject;
use super::pace::Times;
use super::stage::{Drawn, Viewing};
use crate::image::{Display, Tone};
use crate::problem::Problem;
use crate::scene::{Camera, Deform, Scene};
use crate::techniques;
use egui::{CollapsingHeader, ComboBox, Grid, RichText, ScrollArea, Slider, Ui};

/// Points.
pub const WIDTH: f32 = 300.0;
/// A window narrower than this is all picture.
pub const FITS: f32 = 560.0;

/// What a hand wants. Drags are in pixels of the picture's height.
#[derive(Clone, Debug, PartialEq)]
pub enum Wish {
    Orbit(glam::DVec2),
    Pan(glam::DVec2),
    Zoom(f64),
    /// The object in the middle of the view of this camera becomes the chosen one, and is looked at if that is asked.
    Pick(glam::DVec2, bool),
    /// The place of an object in the scene, or all of them.
    Frame(Option<usize>),
    Choose(Option<usize>),
    Camera(Camera),
    Technique(String),
    Display(Display),
    Time(f64),
    Play(bool),
    Screenshot,
    Panel,
}

/// What the panel keeps.
pub struct Panel {
    pub shown: bool,
    /// The share of a side's pixels that is drawn even at rest.
    pub quality: f64,
    /// Whether each pass is waited for, so that its time is its own.
    pub timed: bool,
    /// The object that was chosen last, by its place in the scene.
    pub chosen: Option<usize>,
}

impl Default for Panel {
    fn default() -> Panel {
        Panel { shown: true, quality: 1.0, timed: false, chosen: None }
    }
}

/// What there is to show.
pub struct Facts<'a> {
    pub subject: &'a Subject,
    /// As the file says.
    pub home: Camera,
    pub viewing: &'a Viewing,
    pub drawn: Option<&'a Drawn>,
    pub times: &'a Times,
    /// What is to be said of the scene, though it can be drawn.
    pub warnings: &'a [Problem],
    pub adapter: String,
    pub playing: bool,
}

/// Whether anything in a scene moves by itself.
pub fn moves(scene: &Scene) -> bool {
    let turns = |deform: &Deform| matches!(deform, Deform::Twist { speed_hz, .. } if *speed_hz != 0.0);
    scene.objects.iter().any(|object| object.visible && object.deform.iter().any(turns))
}

impl Panel {
    pub fn ui(&mut self, ui: &mut Ui, facts: &Facts, wishes: &mut Vec<Wish>) {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.spacing_mut().slider_width = 120.0;
            self.method(ui, facts, wishes);
            self.places(ui, facts, wishes);
            if moves(&facts.subject.scene) {
                time(ui, facts, wishes);
            }
            self.cost(ui, facts);
            if !facts.warnings.is_empty() {
                let title = format!("{} warning(s)", facts.warnings.len());
                CollapsingHeader::new(title).id_salt("warnings").show(ui, |ui| {
                    for warning in facts.warnings {
                        ui.label(RichText::new(warning.to_string()).small());
                    }
                });
            }
            ui.add_space(6.0);
            if ui.button("Write a picture (P)").clicked() {
                wishes.push(Wish::Screenshot);
            }
            ui.add_space(6.0);
            ui.label(RichText::new(HANDS).weak());
        });
    }

    fn method(&mut self, ui: &mut Ui, facts: &Facts, wishes: &mut Vec<Wish>) {
        heading(ui, "Method");
        Grid::new("method").num_columns(2).show(ui, |ui| {
            let technique = &facts.subject.look.technique;
            ui.label("technique");
            ComboBox::from_id_salt("technique").width(180.0).selected_text(&technique.name).show_ui(ui, |ui| {
                for entry in techniques::REGISTRY {
                    let chosen = entry.name == technique.name;
                    if ui.selectable_label(chosen, entry.name).on_hover_text(entry.summary()).clicked() && !chosen {
                        wishes.push(Wish::Technique(format!("{}()", entry.name)));
                    }
                }
            });
            ui.end_row();
            let mut display = facts.viewing.display;
            ui.label("tone curve");
            ComboBox::from_id_salt("tone").width(180.0).selected_text(format!("{:?}", display.tone)).show_ui(
                ui,
                |ui| {
                    for tone in [Tone::Clamp, Tone::Srgb, Tone::Filmic] {
                        ui.selectable_value(&mut display.tone, tone, format!("{tone:?}"));
                    }
                },
            );
            ui.end_row();
            ui.label("exposure");
            ui.add(Slider::new(&mut display.exposure_ev, -6.0..=6.0).step_by(0.1).suffix(" EV"));
            ui.end_row();
            if display != facts.viewing.display {
                wishes.push(Wish::Display(display));
            }
            ui.label("pixels");
            let mut percent = (100.0 * self.quality).round();
            ui.add(Slider::new(&mut percent, 25.0..=100.0).step_by(5.0).suffix(" %"));
            self.quality = percent / 100.0;
            ui.end_row();
        });
    }

    fn places(&mut self, ui: &mut Ui, facts: &Facts, wishes: &mut Vec<Wish>) {
        heading(ui, "Look at");
        ui.horizontal_wrapped(|ui| {
            if ui.button("as in the file").clicked() {
                wishes.push(Wish::Camera(facts.home));
            }
            for (name, camera) in &facts.subject.scene.bookmarks {
                if ui.button(name).on_hover_text("a bookmark of the scene").clicked() {
                    wishes.push(Wish::Camera(*camera));
                }
            }
        });
        ui.horizontal_wrapped(|ui| {
            for (place, object) in facts.subject.scene.objects.iter().enumerate().filter(|(_, o)| o.visible) {
                if ui.selectable_label(self.chosen == Some(place), &object.name).clicked() {
                    wishes.push(Wish::Choose(Some(place)));
                    wishes.push(Wish::Frame(Some(place)));
                }
            }
        });
    }

    fn cost(&mut self, ui: &mut Ui, facts: &Facts) {
        heading(ui, "What it takes");
        ui.label(&facts.adapter);
        let Some(drawn) = facts.drawn else { return };
        let (width, height) = (drawn.picture.0[0].shape.width, drawn.picture.0[0].shape.height);
        let ms = 1e3 * drawn.time.as_secs_f64();
        match drawn.level {
            Some(level) => {
                ui.label(format!("{width} x {height} pixels"));
                ui.label(format!("{level}; {}", if drawn.refines { "it goes on" } else { "as good as it was to be" }));
            }
            None => drop(ui.label(format!("{width} x {height} pixels in {ms:.1} ms"))),
        }
        let steps = drawn.steps;
        ui.label(format!("{} steps run, {} reused, {} not needed", steps.ran, steps.reused, steps.unneeded));
        CollapsingHeader::new(format!("{} left out", drawn.skipped.len())).id_salt("skipped").show(ui, |ui| {
            for skipped in &drawn.skipped {
                ui.label(RichText::new(format!("{}: {}", skipped.what, skipped.why)).small());
            }
        });
        let passes = CollapsingHeader::new("time of each pass").id_salt("passes").show(ui, |ui| {
            Grid::new("times").num_columns(3).striped(true).show(ui, |ui| {
                for title in ["", "median", "95 %"] {
                    ui.label(RichText::new(title).small().weak());
                }
                ui.end_row();
                for (name, median, high) in facts.times.rows() {
                    ui.label(RichText::new(name).small());
                    ui.label(RichText::new(format!("{median:.2} ms")).small());
                    ui.label(RichText::new(format!("{high:.2} ms")).small());
                    ui.end_row();
                }
            });
        });
        // Waiting for each pass costs time itself, so only who looks pays for it.
        self.timed = passes.body_response.is_some();
    }
}

fn heading(ui: &mut Ui, text: &str) {
    ui.add_space(8.0);
    ui.label(RichText::new(text).strong());
}

fn time(ui: &mut Ui, facts: &Facts, wishes: &mut Vec<Wish>) {
    heading(ui, "Time");
    ui.horizontal(|ui| {
        let mut time_s = facts.subject.look.view.time_s;
        if ui.button(if facts.playing { "pause" } else { "play" }).clicked() {
            wishes.push(Wish::Play(!facts.playing));
        }
        let end = 10.0_f64.max(time_s);
        if ui.add(Slider::new(&mut time_s, 0.0..=end).suffix(" s").fixed_decimals(2)).changed() {
            wishes.push(Wish::Play(false));
            wishes.push(Wish::Time(time_s));
        }
    });
}

const HANDS: &str = "\
drag: turn; with shift or the middle button: shift
wheel: nearer or farther
click: choose; double click: look at it
F: look at what is chosen, or at all
R: as in the file
space: play      P: write a picture
H: hide this panel";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Look;
    use crate::scene::Reader;
    use std::sync::Arc;

    const SCENE: &str = r#"Scene(
        version: 1,
        mm_per_unit: 10,
        camera: (eye: (0, 0, 6)),
        objects: [(name: "tower", mesh: Box(size: (1, 2, 1)), material: "stone.ron",
                   deform: [Twist(deg_per_unit: 40, speed_hz: SPEED)])],
    )"#;

    /// What is wanted when all of the panel's places are clicked, one after another.
    fn clicked(speed: &str) -> Vec<Wish> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.ron");
        std::fs::write(&path, SCENE.replace("SPEED", speed)).unwrap();
        std::fs::write(folder.path().join("stone.ron"), "Material(version: 1, medium: Opaque(albedo: 0.5))").unwrap();
        let (scene, _) = Reader::new(Arc::default()).scene(&path, &[]).unwrap();
        let subject = Subject { look: Look::of(&scene), scene: Arc::new(scene) };
        let home = subject.look.view.camera;
        let viewing = Viewing { camera: home, size: (1, 1), display: Display::default(), moving: false };
        let facts = Facts {
            subject: &subject,
            home,
            viewing: &viewing,
            drawn: None,
            times: &Times::default(),
            warnings: &[],
            adapter: String::new(),
            playing: true,
        };
        let (context, mut panel, mut all) = (egui::Context::default(), Panel::default(), Vec::new());
        for y in (0..600).step_by(4) {
            // Right of where sliders begin, and within every button.
            let pos = egui::pos2(100.0, y as f32);
            let button = |pressed| {
                let (button, modifiers) = (egui::PointerButton::Primary, egui::Modifiers::NONE);
                egui::Event::PointerButton { pos, button, pressed, modifiers }
            };
            for event in [egui::Event::PointerMoved(pos), button(true), button(false)] {
                let size = egui::vec2(WIDTH, 600.0);
                let screen_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size));
                let input = egui::RawInput { screen_rect, events: vec![event], ..Default::default() };
                let mut wishes = Vec::new();
                let mut output = context.run_ui(input, |ui| {
                    wishes.clear();
                    panel.ui(ui, &facts, &mut wishes);
                });
                output.textures_delta.clear();
                all.extend(wishes);
            }
        }
        all
    }

    #[test]
    fn the_slider_of_time_sets_it_and_stops_play_and_only_what_moves_has_one() {
        let wishes = clicked("0.5");
        let set = wishes.windows(2).any(|pair| match pair {
            [Wish::Play(false), Wish::Time(time_s)] => *time_s > 0.0,
            _ => false,
        });
        assert!(set && wishes.contains(&Wish::Screenshot), "{wishes:?}");
        let still = clicked("0");
        assert!(!still.iter().any(|wish| matches!(wish, Wish::Time(_) | Wish::Play(_))), "{still:?}");
    }
}
