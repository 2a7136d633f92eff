// What every pass of the frame may read. Positions are in eye space: the world's axes and unit, with the eye at the
// origin, so that a scene may lie anywhere.

struct Camera {
    clip_from_eye: mat4x4f,
    // A pixel's centre at unit depth is forward + x right + y up, for x and y in pixels from the centre.
    forward: vec3f,
    width: f32,
    right: vec3f,
    height: f32,
    up: vec3f,
    // The world's width of a pixel at unit depth.
    pixel: f32,
}

struct Object {
    eye_from_object: mat4x4f, // a rotation and a translation
    color: vec3f,
    roughness: f32,
    // Scattered radiance per transmitted irradiance, but for the Fresnel transmittance on the way out.
    scatter: vec3f,
    eta: f32,
    emission: vec3f,
    // How far above the surface shadows are looked up, for techniques that let light in around an edge.
    entry: f32,
    sigma_t: vec3f,
    // Places in the texture array, -1 for none.
    color_layer: i32,
    roughness_layer: i32,
    // What the object does, as the flags below.
    flags: u32,
    // From the eye to its middle.
    distance: f32,
}

const TRANSLUCENT: u32 = 1u;
const EMITTER: u32 = 2u;

fn eye_from_object(object: Object, p: vec3f) -> vec3f {
    return (object.eye_from_object * vec4f(p, 1.0)).xyz;
}

// Where a point of eye space lies in the picture. Passes that draw on exactly the G-buffer's surfaces need it to the bit.
fn project(camera: Camera, p: vec3f) -> vec4f {
    return camera.clip_from_eye * vec4f(p, 1.0);
}

fn turned(object: Object, n: vec3f) -> vec3f {
    return (object.eye_from_object * vec4f(n, 0.0)).xyz;
}

// The direction from the eye through a pixel, not normalised: its component along the view is 1.
fn ray_through(camera: Camera, pixel: vec2f) -> vec3f {
    let from_centre = pixel - 0.5 * vec2f(camera.width, camera.height);
    return camera.forward + camera.pixel * (from_centre.x * camera.right - from_centre.y * camera.up);
}
