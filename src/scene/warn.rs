//! What will render but will disappoint.

use crate::scene::meaning::Judge;
use crate::scene::outside::Texture;
use crate::scene::reader::Reader;
use crate::scene::{Material, MeshSource, Object, Scene, Substance, Varying};
use glam::DVec3;

/// Below this reduced albedo light is absorbed before it diffuses, and every profile overestimates it: the dipole's
/// own derivation asks for sigma_s' well above sigma_a [Jensen2001].
const DIFFUSIVE: f64 = 0.5;
const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// What can be said of a material by itself.
pub fn material(material: &Material, judge: &mut Judge<'_>) {
    order(material, judge);
    let Substance::Translucent(medium) = &material.medium else { return };
    let albedo = medium.albedo_prime().to_array();
    let (worst, value) = (0..3).map(|c| (c, albedo[c])).fold((0, 1.0), |a, b| if b.1 < a.1 { b } else { a });
    if medium.sigma_t_prime() == DVec3::ZERO {
        judge.warn(
            "medium",
            "this medium neither scatters nor absorbs: nothing of it will be seen",
            "give it some sigma_s",
        );
    } else if value < DIFFUSIVE {
        judge.warn(
            "medium",
            format!(
                "the reduced albedo in {} is {value:.2}: light there is absorbed before it diffuses",
                CHANNELS[worst]
            ),
            format!(
                "diffusion holds above {DIFFUSIVE}; compare with the reference, or use Layered, which does not diffuse"
            ),
        );
    }
}

/// Layers that end above the one outside them, somewhere in their maps: there they are not.
fn order(material: &Material, judge: &mut Judge<'_>) {
    // Finer than this nobody looks for a mistake.
    const MOST: u32 = 256;
    let maps = || material.layers.iter().filter_map(|layer| layer.depth.map());
    let side = |side: fn(&Texture) -> u32| maps().map(|map| side(&map.texture)).max().unwrap_or(1).clamp(1, MOST);
    let (width, height) = (side(|texture| texture.width), side(|texture| texture.height));
    let mut above = vec![0u32; material.layers.len()];
    for i in 0..width * height {
        let mut deepest = 0.0;
        for (layer, above) in material.layers.iter().zip(&mut above) {
            let depth = match &layer.depth {
                Varying::Constant(depth) => *depth,
                Varying::Texture(map) => {
                    let place = |i: u32, to: u32, of: u32| (u64::from(i) * u64::from(of) / u64::from(to)) as u32;
                    let (x, y) =
                        (place(i % width, width, map.texture.width), place(i / width, height, map.texture.height));
                    map.as_number().of(map.texture.texels[(y * map.texture.width + x) as usize].map(f64::from))
                }
            };
            *above += u32::from(depth < deepest);
            deepest = f64::max(deepest, depth);
        }
    }
    for (i, above) in above.iter().enumerate().filter(|(_, above)| **above > 0) {
        let share = 100.0 * f64::from(*above) / f64::from(width * height);
        judge.warn(
            &format!("layers[{i}].depth"),
            format!(
                "over {} % of its map `{}` ends above a layer outside it: there it is not",
                digits(share),
                material.layers[i].name
            ),
            "layers go from the outside inwards, and each ends at the deepest depth so far; paint it deeper there",
        );
    }
}

/// What can be said of a scene once its materials are known.
pub fn scene(scene: &Scene, reader: &Reader, judge: &mut Judge<'_>) {
    for (i, object) in scene.objects.iter().enumerate() {
        if judge.full() {
            break;
        }
        let Some(medium) = object.material.medium.medium().filter(|_| object.visible) else { continue };
        if let MeshSource::File { key, .. } = &object.mesh
            && !reader.is_closed(key)
        {
            judge.warn(
                &format!("objects[{i}].mesh"),
                "the mesh is not closed, so that it has no inside: thickness will be wrong where it is open",
                "close its holes, or give it an Opaque material",
            );
        }
        let path = format!("objects[{i}].material");
        let extent = extent(object, reader) * scene.mm_per_unit;
        // The longest way that light gets: at most 1/sigma_tr, and at least one step.
        let step = medium.sigma_t_prime().map(|s| 1.0 / s);
        let far = step.max(medium.sigma_tr().map(|s| if s > 0.0 { 1.0 / s } else { 0.0 }));
        if step.min_element() > extent {
            judge.warn(
                &path,
                format!(
                    "light goes {} mm between scattering events, beyond the {} mm of the object: it will look empty",
                    digits(step.min_element()),
                    digits(extent)
                ),
                "a denser medium, a larger object, or a larger mm_per_unit",
            );
        }
        let pixel = pixel(scene, object) * scene.mm_per_unit;
        if far.max_element() < pixel {
            judge.warn(
                &path,
                format!(
                    "light spreads {} mm, less than a pixel of the camera's view ({} mm): it will look opaque",
                    digits(far.max_element()),
                    digits(pixel)
                ),
                "a smaller mm_per_unit, a nearer camera, or a less dense medium",
            );
        }
    }
}

fn digits(value: f64) -> String {
    if value == 0.0 {
        return "0".to_string();
    }
    let decimals = (1 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    if (1e-9..1e9).contains(&value) { format!("{value:.decimals$}") } else { format!("{value:.1e}") }
}

/// The longest side of the object, scene units.
fn extent(object: &Object, reader: &Reader) -> f64 {
    let own = match &object.mesh {
        MeshSource::File { key, .. } => reader.extent(key),
        MeshSource::Sphere { radius, .. } => 2.0 * radius,
        MeshSource::Box { size } | MeshSource::Slab { size, .. } => size.max_element(),
        MeshSource::Torus { radius, tube, .. } | MeshSource::TorusKnot { radius, tube, .. } => 2.0 * (radius + tube),
        MeshSource::Sculpture { height, .. } => *height,
    };
    own * object.transform.scale.max_element()
}

/// How wide a pixel is at the object, scene units.
fn pixel(scene: &Scene, object: &Object) -> f64 {
    let camera = &scene.camera;
    let distance = (object.transform.translate - camera.eye).length();
    2.0 * distance * (0.5 * camera.fov_y_deg.to_radians()).tan() / f64::from(scene.view.size.1)
}
