//! Light that leaves where it entered, for a normal that may be any: one raster pass on the G-buffer's surfaces.

use crate::frame::{Member, Surface};
use crate::gpu::{Bind, Blend, Buffer, Draw, Format, Layer, Raster};
use crate::problem::{Problem, counted};
use crate::store::{Plan, Slot};

use super::Scattered;

/// The normals that gather a member's light.
pub(super) enum Normals {
    Same(Slot<Buffer>),
    /// One per colour channel: red, green, blue.
    Each([Slot<Buffer>; 3]),
}

/// Scatters the irradiance that each member's `normals` gather. Whatever the normals are, the steps are the same, but that
/// normals per channel gather the surroundings' light three times.
pub(super) fn scatter(
    plan: &mut Plan,
    surface: &Surface,
    mut normals: impl FnMut(&mut Plan, &Member) -> Result<Normals, Problem>,
) -> Result<Scattered, Problem> {
    let mut flags = Vec::new();
    let mut binds: Vec<(&'static str, Bind)> =
        vec![("camera", surface.camera()), ("objects", surface.objects()), ("packed_map", surface.packed())];
    if let Some(lights) = surface.lights() {
        flags.push("LIGHTS");
        binds.push(("lights", lights));
    }
    if let Some(visibility) = surface.visibility(plan)? {
        flags.push("SHADOWS");
        binds.push(("visibility", visibility));
    }
    let mut gathered = Vec::new();
    for member in surface.members() {
        let normals = normals(plan, &member)?;
        gathered.push((member, normals));
    }
    // A pass has one shader: where one member has three normals, all have.
    let channels = gathered.iter().any(|(_, normals)| matches!(normals, Normals::Each(_)));
    if channels {
        flags.push("CHANNELS");
    }
    let mut draws = Vec::new();
    let mut environment = false;
    for (member, normals) in &gathered {
        let mut streams = match normals {
            Normals::Each(each) => each.to_vec(),
            Normals::Same(same) if channels => vec![*same; 3],
            Normals::Same(same) => vec![*same],
        };
        for normals in streams.clone() {
            if let Some(sky) = surface.environment(plan, member, normals)? {
                environment = true;
                streams.push(sky);
            }
        }
        draws.push(surface.draw(plan, member, streams));
    }
    if environment {
        flags.push("ENVIRONMENT");
    }
    pass(plan, surface, &flags, binds, draws)
}

/// Scatters irradiance that is known at each member's vertices (`vec4f`), shadows and all. Where a filter of it rang below
/// nothing there is none.
pub(super) fn scatter_known(
    plan: &mut Plan,
    surface: &Surface,
    mut irradiance: impl FnMut(&mut Plan, &Member) -> Result<Slot<Buffer>, Problem>,
) -> Result<Scattered, Problem> {
    let binds = vec![("camera", surface.camera()), ("objects", surface.objects()), ("packed_map", surface.packed())];
    let mut draws = Vec::new();
    for member in surface.members() {
        let streams = vec![surface.normals(plan, &member), irradiance(plan, &member)?];
        draws.push(surface.draw(plan, &member, streams));
    }
    pass(plan, surface, &["ENVIRONMENT"], binds, draws)
}

fn pass(
    plan: &mut Plan,
    surface: &Surface,
    flags: &[&str],
    binds: Vec<(&'static str, Bind)>,
    draws: Vec<Draw>,
) -> Result<Scattered, Problem> {
    Ok(plan.add(Raster {
        name: "technique.local",
        about: format!("light that {} scattered where it entered", counted(draws.len(), "thing")),
        shader: surface.shader("techniques/local.wgsl", flags)?,
        size: surface.size(),
        targets: vec![(Format::Rgba32Float, Blend::Replace)],
        depth: surface.depth(),
        layers: vec![Layer::meshes(draws)],
        array: false,
        binds,
    }))
}
