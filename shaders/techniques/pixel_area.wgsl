// How much surface a pixel stands for.

#include "frame/scene.wgsl"

// Pixels that see the surface at a steeper angle stand for none of it: few of them would stand for much.
const STEEPEST: f32 = 0.1;

fn pixel_area(camera: Camera, point: vec3f, flat_normal: vec3f) -> f32 {
    let distance = length(point);
    let depth = dot(point, camera.forward);
    let facing = abs(dot(point, flat_normal)) / distance;
    let across = depth * camera.pixel;
    return select(0.0, across * across * (depth / distance) / facing, facing > STEEPEST);
}
