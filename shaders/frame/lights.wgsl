// Lights as samples: one for a directional or a point light, a 4 x 4 grid for an area light.

struct Light {
    // Eye space; of a directional light the direction to it.
    position: vec3f,
    kind: u32,
    // Irradiance, intensity or radiance.
    power: vec3f,
    // Its layer in the visibility map, -1 when it casts no shadow.
    visibility: i32,
    // Half-edges of an area light.
    u: vec3f,
    v: vec3f,
}

const DIRECTIONAL: u32 = 0u;
const POINT: u32 = 1u;
const RECT: u32 = 2u;

struct Incident {
    direction: vec3f,
    // On a plane that faces the light.
    irradiance: vec3f,
    distance: f32,
    // Half the longer side of the sample's cell, seen from the point, in radians.
    spread: f32,
}

fn light_samples(light: Light) -> i32 {
    return select(1, 16, light.kind == RECT);
}

fn light_sample(light: Light, i: i32) -> vec3f {
    let at = (vec2f(f32(i & 3), f32(i >> 2)) - 1.5) * 0.5;
    return light.position + select(vec3f(0.0), at.x * light.u + at.y * light.v, light.kind == RECT);
}

fn incident(light: Light, i: i32, point: vec3f) -> Incident {
    if light.kind == DIRECTIONAL {
        return Incident(light.position, light.power, 1.0, 0.0);
    }
    let to_light = light_sample(light, i) - point;
    let distance = length(to_light);
    // A lamp at the point itself shines along no direction.
    if distance == 0.0 {
        return Incident(vec3f(0.0), vec3f(0.0), 0.0, 0.0);
    }
    let direction = to_light / distance;
    if light.kind == POINT {
        return Incident(direction, light.power / (distance * distance), distance, 0.0);
    }
    let normal = cross(light.u, light.v); // its length is a quarter of the area
    let seen = max(0.0, -dot(normal, direction)) * 0.25 / (distance * distance);
    let size = 0.25 * max(length(light.u), length(light.v));
    return Incident(direction, light.power * seen, distance, size / distance);
}
