//! The straight line from scene to image. Start reading at `line`.

use crate::frame::{Frame, Part, Surface, Thing, View};
use crate::gpu::{Images, Shaders};
use crate::image::{Display, Image};
use crate::problem::{Problem, Problems};
use crate::reference::{self, Develop};
use crate::scene::{Scene, Substance, TechniqueText};
use crate::store::{Plan, Slot};
use crate::techniques::reference::Reference;
use crate::techniques::{self, Technique};

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

/// The plan for one picture: a plain list of steps, made without a device, in the order in which light would have it.
pub fn plan(scene: &Scene, look: &Look, shaders: &Shaders) -> Result<(Plan, Slot<Image>), Problem> {
    // The truth is traced, not drawn.
    if let Some(truth) = Reference::of(&look.technique)? {
        let mut plan = Plan::default();
        let film = reference::plan(&mut plan, scene, &truth.settings(scene, &look.view), truth.max_spp(scene));
        let picture = plan.add(Develop { film, part: look.view.part });
        return Ok((plan, picture));
    }
    line(scene, look, shaders, |frame, plan, picture| Ok(frame.read_back(plan, picture)))
}

/// The plan for one picture that stays on the device, as a display is sent it.
pub fn plan_shown(
    scene: &Scene,
    look: &Look,
    display: Display,
    shaders: &Shaders,
) -> Result<(Plan, Slot<Images>), Problem> {
    if Reference::of(&look.technique)?.is_some() {
        return Err(look
            .technique
            .problem("", "the window does not show the reference in this version")
            .hint("`diaphane render` and `diaphane watch` do, and `diaphane reference` says how far it is"));
    }
    line(scene, look, shaders, |frame, plan, picture| frame.display(plan, picture, display))
}

/// The plan for what stands at the first pixel: an object's place in the scene.
pub fn plan_seen(scene: &Scene, look: &Look, shaders: &Shaders) -> Result<(Plan, Slot<Option<usize>>), Problem> {
    let mut plan = Plan::default();
    let frame = Frame::new(scene, &look.view, shaders, &mut plan);
    let gbuffer = frame.gbuffer(&mut plan)?;
    let seen = frame.seen(&mut plan, gbuffer);
    Ok((plan, seen))
}

/// The line itself, and what becomes of the picture at its end.
fn line<T>(
    scene: &Scene,
    look: &Look,
    shaders: &Shaders,
    end: impl FnOnce(&Frame, &mut Plan, Slot<Images>) -> Result<Slot<T>, Problem>,
) -> Result<(Plan, Slot<T>), Problem> {
    let mut plan = Plan::default();

    // Who is in the picture, and which technique is whose.
    let mut frame = Frame::new(scene, &look.view, shaders, &mut plan);
    let groups = assign(&mut frame, look, &mut plan)?;

    // What is seen.
    let gbuffer = frame.gbuffer(&mut plan)?;

    // Light that went through: each technique for its own objects.
    let mut scattered = Vec::new();
    for Group { technique, items, .. } in groups {
        let surface = Surface { frame: &frame, items, gbuffer };
        scattered.push(technique.plan(&mut plan, &surface)?);
    }
    let scattered = frame.merge(&mut plan, &scattered)?;

    // Light that did not, and the sum.
    let glossy = frame.gloss(&mut plan, gbuffer)?;
    let composed = frame.compose(&mut plan, gbuffer, scattered, glossy)?;
    let picture = frame.resolve(&mut plan, composed)?;
    let end = end(&frame, &mut plan, picture)?;
    Ok((plan, end))
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
    let named = scene.objects.iter().filter_map(|object| object.technique.as_ref());
    let truth = Reference::of(technique)?;
    let view = std::iter::once(technique).filter(|_| truth.is_none());
    for text in view.chain(named) {
        match techniques::read(text) {
            Ok(read) => known.push((&text.ron, read)),
            Err(problem) => problems.push(problem),
        }
    }
    let drawn = scene.objects.iter().filter(|object| truth.is_none() && object.material.medium.medium().is_some());
    for object in drawn {
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
