//! The picture, what hands do on it, and what is said over it.

use super::panel::Wish;
use super::worker::Progress;
use crate::problem::Problems;
use crate::reference::film::Level;
use egui::{
    Align2, Area, Color32, CornerRadius, CursorIcon, Frame, Key, Layout, Margin, PointerButton, ProgressBar, Rect,
    Response, RichText, ScrollArea, Sense, TextureId, Ui, UiBuilder, Vec2, pos2,
};
use glam::DVec2;

/// Points of a wheel's notch.
const NOTCH: f32 = 40.0;

/// What there is to say.
pub struct Said<'a> {
    pub problems: &'a Problems,
    /// What the picture waits for, if it is older than what is wanted.
    pub waits: Option<Waits>,
    /// How far the picture is, if a better one is on its way.
    pub refines: Option<Level>,
    pub note: Option<&'a str>,
}

pub enum Waits {
    ForFiles,
    /// And whether an older picture is in view meanwhile.
    ForStep(Option<Progress>, bool),
}

/// The picture fills what is left of the window. Gives its place.
pub fn picture(ui: &mut Ui, picture: TextureId, said: &Said, wishes: &mut Vec<Wish>) -> Rect {
    let rect = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(rect, Sense::click_and_drag());
    ui.painter().image(picture, rect, Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)), Color32::WHITE);
    hands(ui, &response, rect, wishes);
    let inside = rect.shrink(8.0);
    if inside.is_positive() {
        top(ui, inside, said);
        bottom(ui, inside, said);
    }
    rect
}

fn hands(ui: &Ui, response: &Response, rect: Rect, wishes: &mut Vec<Wish>) {
    let drag = response.drag_delta();
    let drag = DVec2::new(drag.x.into(), drag.y.into());
    if drag != DVec2::ZERO {
        let shift = ui.input(|input| input.modifiers.shift);
        if response.dragged_by(PointerButton::Middle) || response.dragged_by(PointerButton::Primary) && shift {
            wishes.push(Wish::Pan(drag));
        } else if response.dragged_by(PointerButton::Primary) {
            wishes.push(Wish::Orbit(drag));
        }
    }
    if response.dragged() {
        ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
    }
    let wheel = ui.input(|input| input.smooth_scroll_delta().y);
    if response.hovered() && wheel != 0.0 {
        wishes.push(Wish::Zoom((wheel / NOTCH).into()));
    }
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.clicked() || response.double_clicked()) {
        let from_middle = (at - rect.center()) * 2.0 / rect.height();
        let place = DVec2::new(from_middle.x.into(), (-from_middle.y).into());
        wishes.push(Wish::Pick(place, response.double_clicked()));
    }
}

/// What the keys say, when nobody types.
pub fn keys(ui: &Ui, home: Option<Wish>, chosen: Option<usize>, playing: bool, wishes: &mut Vec<Wish>) {
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    ui.input(|input| {
        let of_keys = [
            (Key::F, Some(Wish::Frame(chosen))),
            (Key::R, home),
            (Key::P, Some(Wish::Screenshot)),
            (Key::H, Some(Wish::Panel)),
            (Key::Space, Some(Wish::Play(!playing))),
        ];
        let pressed = of_keys.into_iter().filter(|(key, _)| input.key_pressed(*key) && !input.modifiers.any());
        wishes.extend(pressed.filter_map(|(_, wish)| wish));
    });
}

fn plate(colour: Color32) -> Frame {
    Frame::new().fill(colour).corner_radius(CornerRadius::same(4)).inner_margin(Margin::symmetric(10, 6))
}

fn top(ui: &mut Ui, rect: Rect, said: &Said) {
    let mut ui = ui.new_child(UiBuilder::new().max_rect(rect).layout(Layout::top_down(egui::Align::Min)));
    let dark = Color32::from_black_alpha(200);
    if let Some(waits) = &said.waits {
        plate(dark).show(&mut ui, |ui| {
            ui.visuals_mut().override_text_color = Some(Color32::WHITE);
            match waits {
                Waits::ForFiles => drop(ui.label("reading the files")),
                Waits::ForStep(progress, older) => {
                    ui.label(match older {
                        true => "this is an older picture; the new one waits for",
                        false => "the picture waits for",
                    });
                    let (about, share) = progress.as_ref().map_or(("its turn", 0.0), |p| (&p.about, p.share));
                    ui.label(RichText::new(about).strong());
                    let width = rect.width().min(260.0) - 20.0;
                    ui.add(ProgressBar::new(share as f32).desired_width(width).desired_height(6.0));
                }
            }
        });
    }
    if let Some(level) = &said.refines {
        plate(dark).show(&mut ui, |ui| ui.label(RichText::new(level.to_string()).color(Color32::WHITE)));
    }
    if let Some(note) = said.note {
        plate(dark).show(&mut ui, |ui| ui.label(RichText::new(note).color(Color32::WHITE)));
    }
}

fn bottom(ui: &Ui, rect: Rect, said: &Said) {
    if said.problems.0.is_empty() {
        return;
    }
    let wrong = said.problems.0.iter().any(|problem| problem.is_error());
    let colour = if wrong { Color32::from_rgb(110, 20, 24) } else { Color32::from_rgb(95, 75, 10) };
    let area = Area::new(egui::Id::unique("problems"))
        .fixed_pos(rect.left_bottom())
        .pivot(Align2::LEFT_BOTTOM)
        .default_size(rect.size());
    area.show(ui.ctx(), |ui| {
        plate(colour).show(ui, |ui| {
            let room = Vec2::new(rect.width() - 20.0, 0.5 * rect.height());
            ScrollArea::both().max_width(room.x).max_height(room.y).show(ui, |ui| {
                // A line of source stands over its marks, so nothing may wrap.
                let text = RichText::new(said.problems.to_string()).monospace().color(Color32::WHITE);
                ui.add(egui::Label::new(text).extend().selectable(true));
            });
        });
    });
}
