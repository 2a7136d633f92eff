//! The straight line from scene to image. Start reading at `line`.

use crate::frame::{self, Frame, Part, Surface, Thing, View};
use crate::gpu::{Images, Shaders};
use crate::image::{Display, Image};
use crate::problem::{Problem, Problems};
use crate::reference::film::{Film, Level};
use crate::reference::{self, Develop, Judge};
use crate::scene::{Scene, Substance, TechniqueText};
use crate::store::{Plan, Slot};
use crate::techniques::{self, Technique, Way};

/// What somebody wants to see: a scene holds the physics, this holds the method.
#[derive(Clone, Debug)]
pub struct Look {
    pub view: View,
    /// For every object that names none of its own.
    pub technique: TechniqueText,
}

impl Look {
    /// As the scene's file says.
    pub fn of(scene: &Scene) -> Look {
        Look {
            view: View {
                camera: scene.camera,
                size: scene.view.size,
                antialias: scene.view.antialias,
                time_s: scene.view.time_s,
                part: Part::Full,
                skip: true,
            },
            technique: scene.view.technique.clone(),
        }
    }
}

/// A plan for a picture that stays on the device, as a display is sent it.
pub struct Shown {
    pub plan: Plan,
    pub picture: Slot<Images>,
    /// Of a picture that is traced, how far it is.
    pub traced: Option<Traced>,
}

/// A traced picture gets better as long as one waits.
pub struct Traced {
    pub now: Exposure,
    /// With twice as many paths; None: there are as many as there may be.
    pub next: Option<Exposure>,
    /// The relative standard error that is good enough.
    pub max_error: f64,
}

/// So many paths per pixel.
#[derive(Clone, Copy)]
pub struct Exposure {
    /// Linear.
    pub image: Slot<Image>,
    pub level: Slot<Level>,
}

/// The plan for one picture: a plain list of steps, made without a device, in the order in which light would have it.
pub fn plan(scene: &Scene, look: &Look, shaders: &Shaders) -> Result<(Plan, Slot<Image>), Problem> {
    let mut plan = Plan::default();
    let picture = match picture(&mut plan, scene, look, shaders)? {
        Picture::Drawn(picture) => frame::read_back(&mut plan, picture),
        Picture::Traced(films, _) => {
            let film = *films.last().expect("there is a first path");
            plan.add(Develop { film, part: look.view.part })
        }
    };
    Ok((plan, picture))
}

/// The plan for one picture in a window. Of what is traced `choose` is told all doublings of the paths per pixel, and gives
/// the place of the one that is to be shown; the plan has the next one, too.
pub fn plan_shown(
    scene: &Scene,
    look: &Look,
    display: Display,
    shaders: &Shaders,
    choose: impl FnOnce(&Plan, &[Slot<Film>]) -> usize,
) -> Result<Shown, Problem> {
    let mut plan = Plan::default();
    let (picture, traced) = match picture(&mut plan, scene, look, shaders)? {
        Picture::Drawn(picture) => (picture, None),
        Picture::Traced(films, max_error) => {
            let part = look.view.part;
            let chosen = choose(&plan, &films);
            let mut expose = |film: Slot<Film>| Exposure {
                image: plan.add(Develop { film, part }),
                level: plan.add(Judge { film, part }),
            };
            let now = expose(films[chosen]);
            let next = films.get(chosen + 1).copied().map(expose);
            (frame::to_device(&mut plan, now.image), Some(Traced { now, next, max_error }))
        }
    };
    let picture = frame::display(&mut plan, shaders, look.view.size, picture, display)?;
    Ok(Shown { plan, picture, traced })
}

/// The plan for what stands at the first pixel: an object's place in the scene.
pub fn plan_seen(scene: &Scene, look: &Look, shaders: &Shaders) -> Result<(Plan, Slot<Option<usize>>), Problem> {
    let mut plan = Plan::default();
    let frame = Frame::new(scene, &look.view, shaders, &mut plan);
    let gbuffer = frame.gbuffer(&mut plan)?;
    let seen = frame.seen(&mut plan, gbuffer);
    Ok((plan, seen))
}

/// A picture in linear light, and where it is.
enum Picture {
    /// On the device.
    Drawn(Slot<Images>),
    /// In films of ever more paths per pixel, until the relative standard error is so small.
    Traced(Vec<Slot<Film>>, f64),
}

fn picture(plan: &mut Plan, scene: &Scene, look: &Look, shaders: &Shaders) -> Result<Picture, Problem> {
    Ok(match techniques::way(&look.technique)? {
        Way::Drawn(_) => Picture::Drawn(line(plan, scene, look, shaders)?),
        Way::Traced(truth) => {
            let settings = truth.settings(scene, &look.view);
            let films = reference::doublings(plan, scene, &settings, truth.max_spp(scene));
            Picture::Traced(films, truth.max_error(scene))
        }
    })
}

/// The line itself.
fn line(plan: &mut Plan, scene: &Scene, look: &Look, shaders: &Shaders) -> Result<Slot<Images>, Problem> {
    // Who is in the picture, and which technique is whose.
    let mut frame = Frame::new(scene, &look.view, shaders, plan);
    let groups = assign(&mut frame, look, plan)?;

    // What is seen.
    let gbuffer = frame.gbuffer(plan)?;

    // Light that went through: each technique for its own objects.
    let mut scattered = Vec::new();
    for Group { technique, items, .. } in groups {
        let surface = Surface { frame: &frame, items, gbuffer };
        scattered.push(technique.plan(plan, &surface)?);
    }
    let scattered = frame.merge(plan, &scattered)?;

    // Light that did not, and the sum.
    let glossy = frame.gloss(plan, gbuffer)?;
    let composed = frame.compose(plan, gbuffer, scattered, glossy)?;
    frame.resolve(plan, composed)
}

/// Objects that share a technique with the same settings.
struct Group {
    ron: String,
    technique: Box<dyn Technique>,
    items: Vec<usize>,
}

/// Which technique renders which of the frame's items. Opaque things are rendered as such whatever the view names.
fn assign(frame: &mut Frame, look: &Look, plan: &mut Plan) -> Result<Vec<Group>, Problem> {
    let mut groups: Vec<Group> = Vec::new();
    for place in 0..frame.items.len() {
        let Thing::Object(i) = frame.items[place].thing else { continue };
        let object = &frame.scene.objects[i];
        let text = match object.material.medium {
            Substance::Opaque { .. } => &TechniqueText::from_flag("opaque", "Opaque()")?,
            Substance::Translucent(_) => object.technique.as_ref().unwrap_or(&look.technique),
        };
        let group = match groups.iter().position(|group| group.ron == text.ron) {
            Some(found) => found,
            None => {
                let technique = techniques::read(text)?;
                groups.push(Group { ron: text.ron.clone(), technique, items: Vec::new() });
                groups.len() - 1
            }
        };
        let entry_mm = groups[group].technique.entry_mm(&object.material);
        frame.set_entry(place, entry_mm);
        if frame.items[place].in_view {
            groups[group].items.push(place);
        }
    }
    groups.retain(|group| !group.items.is_empty());
    // Only now: gloss sees the same shadows whichever part is shown, and where they are looked up is a technique's word.
    if !look.view.part.has(Part::Scattered) {
        plan.skip("scattered light", "the picture shows another part");
        groups.clear();
    }
    Ok(groups)
}

/// What the techniques have to say of their settings and of the materials that they are to render. `technique` is that of
/// every object that names none.
pub fn check(scene: &Scene, technique: &TechniqueText) -> Result<(), Problems> {
    let mut problems = Vec::new();
    let mut known: Vec<(&str, Box<dyn Technique>)> = Vec::new();
    let mut drawn = true;
    match techniques::way(technique) {
        Ok(Way::Drawn(read)) => known.push((&technique.ron, read)),
        Ok(Way::Traced(_)) => drawn = false,
        Err(problem) => problems.push(problem),
    }
    for text in scene.objects.iter().filter_map(|object| object.technique.as_ref()) {
        match techniques::read(text) {
            Ok(read) => known.push((&text.ron, read)),
            Err(problem) => problems.push(problem),
        }
    }
    for object in scene.objects.iter().filter(|object| drawn && object.material.medium.medium().is_some()) {
        let text = object.technique.as_ref().unwrap_or(technique);
        let read = known.iter().find(|(ron, _)| *ron == text.ron);
        problems.extend(read.and_then(|(_, read)| read.refuses(&object.material)));
    }
    // Objects that share a material share its problems.
    let mut told: Vec<Problem> = Vec::new();
    problems.into_iter().for_each(|problem| {
        if !told.contains(&problem) {
            told.push(problem)
        }
    });
    if told.is_empty() { Ok(()) } else { Err(Problems(told)) }
}
