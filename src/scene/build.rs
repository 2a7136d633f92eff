//! What a scene file means: ranges, names, directions, and the files that it names. Everything wrong is reported at once.

use crate::scene::meaning::Judge;
use crate::scene::outside::Encoding;
use crate::scene::path::join;
use crate::scene::reader::Reader;
use crate::scene::scene_file::{EnvironmentSpec, LightSpec, MeshSpec, ObjectSpec, SceneFile};
use crate::scene::{
    Camera, Deform, Light, LightKind, Material, MeshSource, Normals, Object, Scene, Sky, TechniqueText, TextureMap,
    Transform, Varying, ViewSettings,
};
use glam::DVec3;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Neither a picture nor a mesh may ask for more memory than machines have.
const MAX_SIDE: u32 = 16_384;
const MAX_CELLS: u64 = 4 << 20;

/// The scene that `file` spells, when it means something; `judge` holds what is wrong.
pub fn build(file: &SceneFile, reader: &Reader, judge: &mut Judge<'_>) -> Option<Scene> {
    judge.all("mm_per_unit", &[file.mm_per_unit], |v| v > 0.0, "mm, above 0: how long one scene unit is");
    camera("camera", &file.camera, judge);
    for (name, bookmark) in &file.bookmarks {
        let path = format!("bookmarks[{name:?}]");
        if name.trim().is_empty() {
            judge.wrong(&path, "a bookmark needs a name", "\"left side\": (eye: …)");
        }
        camera(&path, bookmark, judge);
    }
    let mut names = BTreeSet::new();
    let lights: Vec<_> =
        file.lights.iter().enumerate().map(|(i, light)| self::light(i, light, reader, &mut names, judge)).collect();
    let surroundings = |spec: &LightSpec| matches!(spec, LightSpec::Environment(l) if l.enabled);
    for (i, _) in file.lights.iter().enumerate().filter(|(_, spec)| surroundings(spec)).skip(1) {
        let hint = "switch one of them off with `enabled: false`, or paint both into one image";
        judge.wrong(&format!("lights[{i}]"), "a second environment is switched on: there is one sky", hint);
    }
    let mut names = BTreeSet::new();
    let objects: Vec<_> =
        file.objects.iter().enumerate().map(|(i, object)| self::object(i, object, reader, &mut names, judge)).collect();
    let view = view(file, judge);
    let reference = file.reference;
    judge.all(
        "reference.max_error",
        &[reference.max_error],
        |v| v > 0.0,
        "a relative standard error above 0, like 0.02",
    );
    judge.all("reference.max_spp", &[reference.max_spp.into()], |v| v >= 1.0, "1 or more");
    judge.all("reference.max_depth", &[reference.max_depth.into()], |v| v >= 1.0, "1 or more");
    Some(Scene {
        mm_per_unit: file.mm_per_unit,
        camera: file.camera,
        bookmarks: file.bookmarks.clone(),
        lights: lights.into_iter().collect::<Option<_>>()?,
        objects: objects.into_iter().collect::<Option<_>>()?,
        view: view?,
        reference,
    })
}

fn camera(path: &str, camera: &Camera, judge: &mut Judge<'_>) {
    let (view, up) = (camera.target - camera.eye, camera.up);
    judge.all(&join(path, "fov_y_deg"), &[camera.fov_y_deg], |v| v > 0.0 && v < 180.0, "degrees between 0 and 180");
    if view == DVec3::ZERO {
        judge.wrong(&join(path, "target"), "the eye and its target are the same point", "move one of them");
    } else if up == DVec3::ZERO {
        judge.wrong(&join(path, "up"), "up has no direction", "(0, 1, 0) is the usual one");
    } else if up.is_finite() && view.is_finite() {
        // The sine of the angle between them, safe from overflow.
        let (view, up) = (view / view.abs().max_element(), up / up.abs().max_element());
        if view.normalize().cross(up.normalize()).length() < 1e-6 {
            judge.wrong(
                &join(path, "up"),
                "up is parallel to the view",
                "turn it: it says which way is up in the picture",
            );
        }
    }
}

fn light(
    i: usize,
    spec: &LightSpec,
    reader: &Reader,
    names: &mut BTreeSet<String>,
    judge: &mut Judge<'_>,
) -> Option<Light> {
    if judge.full() {
        return None;
    }
    let path = format!("lights[{i}]");
    let at = |field: &str| join(&path, field);
    const AMOUNT: &str = "0 or more in each channel";
    let (name, shadow, enabled) = match spec {
        LightSpec::Directional(l) => (&l.name, l.shadow, l.enabled),
        LightSpec::Point(l) => (&l.name, l.shadow, l.enabled),
        LightSpec::Rect(l) => (&l.name, l.shadow, l.enabled),
        LightSpec::Environment(l) => (&l.name, l.shadow, l.enabled),
    };
    let name = name.clone().unwrap_or_else(|| light_name(i));
    judge.name(&path, &name, names);
    let kind = match spec {
        LightSpec::Directional(l) => {
            judge.all(&at("irradiance"), &l.irradiance.0, |v| v >= 0.0, AMOUNT);
            if l.direction == DVec3::ZERO {
                judge.wrong(
                    &at("direction"),
                    "this is no direction",
                    "the way the light travels: (0, -1, 0) shines down",
                );
            }
            let direction = (l.direction / l.direction.abs().max_element()).normalize();
            LightKind::Directional { direction, irradiance: l.irradiance.0.into() }
        }
        LightSpec::Point(l) => {
            judge.all(&at("intensity"), &l.intensity.0, |v| v >= 0.0, AMOUNT);
            LightKind::Point { position: l.position, intensity: l.intensity.0.into() }
        }
        LightSpec::Rect(l) => {
            judge.all(&at("radiance"), &l.radiance.0, |v| v >= 0.0, AMOUNT);
            let flat = |d: DVec3| d / d.abs().max_element();
            if l.u == DVec3::ZERO || l.v == DVec3::ZERO {
                let edge = if l.u == DVec3::ZERO { "u" } else { "v" };
                judge.wrong(&at(edge), "this edge has no length", "half of an edge of the rectangle: (1, 0, 0)");
            } else if l.u.is_finite() && l.v.is_finite() && flat(l.u).cross(flat(l.v)).length() < 1e-9 {
                judge.wrong(&at("v"), "u and v are parallel: the light has no area", "turn one of them");
            }
            LightKind::Rect { center: l.center, u: l.u, v: l.v, radiance: l.radiance.0.into() }
        }
        LightSpec::Environment(l) => {
            judge.all(&at("scale"), &[l.scale], |v| v >= 0.0, "0 or more");
            let sky = sky(&path, l, reader, judge)?;
            LightKind::Environment { sky, scale: l.scale, rotation_deg: l.rotation_deg }
        }
    };
    Some(Light { name, shadow, enabled, kind })
}

fn sky(path: &str, spec: &EnvironmentSpec, reader: &Reader, judge: &mut Judge<'_>) -> Option<Sky> {
    if let Some(radiance) = spec.radiance {
        judge.all(&join(path, "radiance"), &radiance.0, |v| v >= 0.0, "0 or more in each channel");
    }
    let image_path = join(path, "image");
    match (&spec.image, spec.radiance) {
        (Some(_), Some(_)) => {
            judge.wrong(&image_path, "an environment has an image or a radiance, not both", "take one of them away");
            None
        }
        (None, radiance) => Some(Sky::Constant(radiance.map_or(DVec3::ONE, |r| r.0.into()))),
        (Some(image), None) => match reader.texture(judge.node(&image_path), image, Encoding::Srgb) {
            Ok((texture, file, warnings)) => {
                warnings.into_iter().for_each(|w| judge.found(&image_path, w));
                let (path, key, encoding) = (file.path, file.key, Encoding::Srgb);
                let (channel, range, invert) = (Default::default(), (0.0, 1.0), false);
                Some(Sky::Image(Arc::new(TextureMap { path, key, encoding, channel, range, invert, texture })))
            }
            Err(problem) => {
                judge.found(&image_path, problem);
                None
            }
        },
    }
}

fn object(
    i: usize,
    spec: &ObjectSpec,
    reader: &Reader,
    names: &mut BTreeSet<String>,
    judge: &mut Judge<'_>,
) -> Option<Object> {
    if judge.full() {
        return None;
    }
    let path = format!("objects[{i}]");
    let at = |field: &str| join(&path, field);
    let name = spec.name.clone().unwrap_or_else(|| object_name(i));
    judge.name(&path, &name, names);

    let mesh = match &spec.mesh {
        Some(mesh) => self::mesh(&at("mesh"), mesh, reader, judge),
        None => {
            judge.warn(
                &path,
                "the object has no mesh: a sphere stands in",
                "mesh: File(\"x.obj\"), or Sphere(radius: 1)",
            );
            self::mesh(&at("mesh"), &default_mesh(), reader, judge)
        }
    };
    let material = match &spec.material {
        Some(file) => reader.material_named(&at("material"), file, judge),
        None => {
            judge.warn(&path, "the object has no material: marble stands in", "material: \"x.ron\"");
            Some(reader.default_material())
        }
    };
    if let (Some(mesh), Some(material)) = (&mesh, &material)
        && let Some(layer) = material.layers.iter().find(|layer| matches!(layer.depth, Varying::Texture(_)))
        && !has_uvs(mesh)
    {
        let what =
            format!("this mesh has no texture coordinates, but an image says how deep its `{}` reaches", layer.name);
        judge.wrong(&at("mesh"), what, "give every face of the mesh texture coordinates, or the layer one depth");
    }
    let scale = DVec3::from(spec.transform.scale.0);
    judge.all(
        &at("transform.scale"),
        &spec.transform.scale.0,
        |v| v > 0.0,
        "above 0; turn the object instead of mirroring it",
    );
    if let Normals::Smooth { crease_deg } = spec.normals {
        judge.all(&at("normals.crease_deg"), &[crease_deg], |v| (0.0..=180.0).contains(&v), "degrees from 0 to 180");
    }
    for (k, Deform::Twist { axis, .. }) in spec.deform.iter().enumerate() {
        if *axis == DVec3::ZERO {
            judge.wrong(&format!("{path}.deform[{k}].axis"), "this axis has no direction", "(0, 1, 0) is upwards");
        }
    }
    let technique = match &spec.technique {
        Some(_) => Some(technique(&at("technique"), judge)?),
        None => None,
    };
    if technique.as_ref().is_some_and(|t| t.name == "Reference") {
        let hint = "the reference traces the whole scene: name it in the view";
        judge.wrong(&at("technique"), "an object cannot be rendered by the reference alone", hint);
    }
    let transform = Transform { translate: spec.transform.translate, rotate_deg: spec.transform.rotate_deg, scale };
    Some(Object {
        name,
        mesh: mesh?,
        material: material?,
        transform,
        normals: spec.normals,
        visible: spec.visible,
        deform: spec.deform.clone(),
        technique,
    })
}

fn mesh(path: &str, spec: &MeshSpec, reader: &Reader, judge: &mut Judge<'_>) -> Option<MeshSource> {
    let at = |field: &str| join(path, field);
    let mut positive = |field: &str, values: &[f64]| judge.all(&at(field), values, |v| v > 0.0, "scene units, above 0");
    const CLOSED: (u32, u32) = (3, 4096);
    let source = match *spec {
        MeshSpec::File(ref file) => return reader.mesh_named(path, file, judge),
        MeshSpec::Sphere(ref m) => {
            positive("radius", &[m.radius]);
            judge.all(&at("subdivisions"), &[m.subdivisions.into()], |v| v <= 8.0, "from 0 to 8");
            MeshSource::Sphere { radius: m.radius, subdivisions: m.subdivisions }
        }
        MeshSpec::Box(ref m) => {
            positive("size", &m.size.0);
            MeshSource::Box { size: m.size.0.into() }
        }
        MeshSpec::Torus(ref m) => {
            positive("radius", &[m.radius]);
            positive("tube", &[m.tube]);
            if m.tube >= m.radius && m.tube.is_finite() && m.radius > 0.0 {
                judge.wrong(
                    &at("tube"),
                    "the tube is as thick as the ring: the torus cuts itself",
                    "less than the radius",
                );
            }
            segments(&at("segments"), m.segments, CLOSED, judge);
            MeshSource::Torus { radius: m.radius, tube: m.tube, segments: m.segments }
        }
        MeshSpec::TorusKnot(ref m) => {
            positive("radius", &[m.radius]);
            positive("tube", &[m.tube]);
            for (field, turns) in [("p", m.p), ("q", m.q)] {
                judge.all(&at(field), &[turns.into()], |v| (1.0..=64.0).contains(&v), "from 1 to 64");
            }
            if divisor(m.p, m.q) > 1 {
                judge.wrong(
                    &at("q"),
                    format!("p and q share the divisor {}", divisor(m.p, m.q)),
                    "take 2 and 3, or 3 and 5",
                );
            }
            segments(&at("segments"), m.segments, CLOSED, judge);
            MeshSource::TorusKnot { p: m.p, q: m.q, radius: m.radius, tube: m.tube, segments: m.segments }
        }
        MeshSpec::Slab(ref m) => {
            positive("size", &m.size.0);
            segments(&at("segments"), m.segments, (1, 4096), judge);
            MeshSource::Slab { size: m.size.0.into(), segments: m.segments }
        }
        MeshSpec::Sculpture(ref m) => {
            positive("height", &[m.height]);
            judge.all(
                &at("detail"),
                &[m.detail.into()],
                |v| (32.0..=512.0).contains(&v),
                "cells along the height, from 32 to 512",
            );
            MeshSource::Sculpture { figure: m.figure, height: m.height, detail: m.detail }
        }
    };
    Some(source)
}

fn has_uvs(mesh: &MeshSource) -> bool {
    match mesh {
        MeshSource::File { mesh, .. } => !mesh.uvs.is_empty(),
        MeshSource::Sculpture { .. } => false,
        _ => true,
    }
}

fn divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { divisor(b, a % b) }
}

fn segments(path: &str, (along, around): (u32, u32), (least, most): (u32, u32), judge: &mut Judge<'_>) {
    let range = format!("(along, around), each from {least} to {most}");
    judge.all(path, &[along.into(), around.into()], |v| (f64::from(least)..=f64::from(most)).contains(&v), &range);
    if along <= most && around <= most && u64::from(along) * u64::from(around) > MAX_CELLS {
        judge.wrong(path, format!("{along} × {around} cells are too many"), format!("at most {MAX_CELLS} in all"));
    }
}

fn technique(path: &str, judge: &mut Judge<'_>) -> Option<TechniqueText> {
    TechniqueText::of(judge.node(path), path).map_err(|problem| judge.add(problem)).ok()
}

fn view(file: &SceneFile, judge: &mut Judge<'_>) -> Option<ViewSettings> {
    let view = &file.view;
    let size = [view.size.0.into(), view.size.1.into()];
    judge.all(
        "view.size",
        &size,
        |v| (1.0..=f64::from(MAX_SIDE)).contains(&v),
        "(width, height), each from 1 to 16384 pixels",
    );
    judge.all("view.exposure_ev", &[view.exposure_ev], |v| v.abs() <= 64.0, "stops, from -64 to 64");
    judge.all(
        "view.antialias",
        &[view.antialias.into()],
        |v| [1.0, 2.0, 4.0].contains(&v),
        "1, 2 or 4 samples per axis",
    );
    let technique = match judge.root.get("view.technique") {
        Some(_) => technique("view.technique", judge)?,
        None => TechniqueText::from_flag("default", "FilteredNormals()").expect("a name is a technique"),
    };
    Some(ViewSettings {
        technique,
        size: view.size,
        exposure_ev: view.exposure_ev,
        tone: view.tone,
        time_s: view.time_s,
        antialias: view.antialias,
    })
}

fn default_mesh() -> MeshSpec {
    MeshSpec::Sphere(Default::default())
}
fn light_name(i: usize) -> String {
    format!("light {i}")
}
fn object_name(i: usize) -> String {
    format!("object {i}")
}

/// The file with what it leaves to others filled in: `diaphane check --defaults`.
pub fn complete(file: &SceneFile, root: &crate::scene::tree::Node) -> SceneFile {
    let mut file = file.clone();
    for (i, light) in file.lights.iter_mut().enumerate() {
        match light {
            LightSpec::Directional(l) => l.name.get_or_insert(light_name(i)),
            LightSpec::Point(l) => l.name.get_or_insert(light_name(i)),
            LightSpec::Rect(l) => l.name.get_or_insert(light_name(i)),
            LightSpec::Environment(l) => {
                if l.image.is_none() {
                    l.radiance.get_or_insert(crate::scene::Triple::all(1.0));
                }
                l.name.get_or_insert(light_name(i))
            }
        };
    }
    for (i, object) in file.objects.iter_mut().enumerate() {
        object.name.get_or_insert(object_name(i));
        object.mesh.get_or_insert_with(default_mesh);
        if let (Some(raw), Some(node)) = (&mut object.technique, root.get(&format!("objects[{i}].technique"))) {
            raw.0 = node.unwrapped().canonical();
        }
    }
    if let Some(node) = root.get("view.technique") {
        file.view.technique.0 = node.unwrapped().canonical();
    }
    file
}

/// Shared by every object that names no material.
pub fn default_material(reader: &Reader) -> Material {
    let root = crate::scene::document::parse(&crate::scene::tree::Source::of_flag(
        "default",
        std::path::Path::new(""),
        "Material(version: 1)".to_string(),
    ))
    .expect("this is RON");
    crate::scene::material::build(&Default::default(), reader, &mut Judge::new(&root)).expect("the defaults are sound")
}
