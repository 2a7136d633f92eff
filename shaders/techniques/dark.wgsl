// Nothing comes from here.

#include "lib/fullscreen.wgsl"

@fragment
fn fragment() -> @location(0) vec4f {
    return vec4f(0.0, 0.0, 0.0, 1.0);
}
