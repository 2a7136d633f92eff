// Which element a compute invocation works on, or a workgroup: workgroups of 64, 32768 side by side.

fn element(id: vec3u) -> u32 {
    return id.x + id.y * (32768u * 64u);
}

fn element_of_group(id: vec3u) -> u32 {
    return id.x + id.y * 32768u;
}
