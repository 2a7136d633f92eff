// The mean of a medium's profiles over a disk, from its table; `src/optics/profile/disk.rs` says what and how.

struct Kernel {
    // Lengths of the table per scene unit.
    scale: f32,
    // Rows per e.
    density: f32,
    // On either side of the middle one, and how they crowd there.
    columns: u32,
    crowding: f32,
    // 1 / (c pi): from irradiance that leaves to radiance, but for Fresnel.
    spread: f32,
}

@group(0) @binding(24) var<uniform> kernel: Kernel;
// ln rho of the first row, the number of rows, and the radius that holds nearly all light; then the rows.
@group(0) @binding(25) var<storage, read> disk_means: array<vec4f>;

// The radius beyond which hardly any light leaves, scene units.
fn kernel_reach() -> f32 {
    return disk_means[0].z / kernel.scale;
}

// Per area, for a disk of radius `a` whose middle lies at the distance `r`; scene units. One of the two is above 0.
fn disk_mean(r: f32, a: f32) -> vec3f {
    let rho = sqrt(r * r + a * a);
    let s = clamp((r - a) / rho, -1.0, 1.0);
    let turn = asin(min(1.0, pow(abs(s), 1.0 / kernel.crowding))) / 1.5707963;
    let half_width = f32(kernel.columns);
    let column = half_width * (1.0 + select(turn, -turn, s < 0.0));
    let left = min(u32(column), 2u * kernel.columns - 1u);
    let across = column - f32(left);
    let steps = (log(rho * kernel.scale) - disk_means[0].x) * kernel.density;
    let below = clamp(floor(steps), 0.0, disk_means[0].y - 2.0);
    let t = steps - below;
    // Straight in rho between two rows, a power beyond them.
    let straight = (exp(t / kernel.density) - 1.0) / (exp(1.0 / kernel.density) - 1.0);
    let along = select(t, straight, t >= 0.0 && t <= 1.0);
    let width = 2u * kernel.columns + 1u;
    let low = 1u + u32(below) * width + left;
    let lower = mix(disk_means[low].rgb, disk_means[low + 1u].rgb, across);
    let upper = mix(disk_means[low + width].rgb, disk_means[low + width + 1u].rgb, across);
    return kernel.scale * kernel.scale * exp(mix(lower, upper, along));
}

// Per area, for a disk that may lie at any angle: `offset` leads from its middle to where light leaves. What the disk
// extends along that line counts as in a plane; what it extends across makes its points farther away, all alike.
fn disk_mean_across(offset: vec3f, normal: vec3f, a: f32) -> vec3f {
    let squared = max(dot(offset, offset), 1e-6 * a * a);
    let height = dot(offset, normal);
    let level = sqrt(max(0.0, 1.0 - height * height / squared));
    let across = 0.5 * a * a * (1.0 - level * level);
    return disk_mean(sqrt(squared + across), max(a * level, 1e-3 * a));
}
