/* PROJECT: eq. 1, a thread a Gaussian in a view. Reads models and tables. Writes a record and a depth of
   each; depth -1 says that it is not drawn. All but depths is in the object's space, where a length is 1
   / scale of the world's. */
#version 430
#include "common.glsl"
#include "rotation.glsl"
#include "frame.glsl"
#include "model.glsl"

layout(std430, binding = 4) writeonly buffer records { splat record[]; };
layout(std430, binding = 5) writeonly buffer depths { float depth[]; };

/* a b - c d, its rounding error put back. */
float difference(float a, float b, float c, float d) {
    precise float product = c * d;
    precise float first = fma(a, b, -product), error = fma(-c, d, product);
    return first + error;
}

/* The splat's covariance is C = m m' + h, m = J W R S. Opacity fades near the eye. Beside the picture it
   fades of what reaches far back along z: the affine projection of that would cover the picture. */
void main() {
    uint slot = part_of(groups_of(count)), i = item_of(groups_of(count)), at = slot * count + i;
    if (slot >= slots || i >= count) return;
    uint o = object_at(i), own = i - uint(objects[o].place.x);
    projection v = views[view_at_work[slot]];
    if (own >= uint(objects[o].place.y) || !reaches(v.of.x, o)) {
        depth[at] = -1;
        return;
    }
    vec3 position = planes_of(o, 0u, own);
    vec4 raw = vec4(plane_of(o, 3u, own), planes_of(o, 4u, own));
    vec3 log_scale = planes_of(o, 7u, own);
    float logit = plane_of(o, 10u, own), scale_of = objects[o].shape.x, presence = objects[o].shape.y;
    bool parallel = v.kind.y > 0, of_light = v.of.x >= 0;
    bool floored = of_light && (objects[o].of.x & blur_floor) != 0;
    float variance = of_light ? floored ? 0.2 : 0.3 : objects[o].shape.z, near_plane = v.kind.x / scale_of;
    vec2 focal = v.lens.xy * (parallel ? scale_of : 1), middle = v.lens.zw, edges = vec2(v.size.xy);
    vec4 view[3];
    for (int k = 0; k < 3; k++)
        view[k] = vec4(turned_back(o, v.view[k].xyz),
                       (dot(v.view[k].xyz, offset_of(o)) + v.view[k].w) / scale_of);
    bool drawn = is_finite(position) && is_finite(raw.xyz) && is_finite(raw.w) &&
        is_number(log_scale.x) && is_number(log_scale.y) && is_number(log_scale.z) && is_number(logit);
    vec3 scale = exp(clamp(log_scale, -20.0, 20.0));
    float clear = exp(-clamp(logit, -20.0, 20.0)), opacity = 1 / (1 + clear);
    if (presence < 1) opacity = 1 - exp(presence * log(max(clear * opacity, 1e-30)));
    vec3 t = vec3(dot(view[0].xyz, position) + view[0].w, dot(view[1].xyz, position) + view[1].w,
                  dot(view[2].xyz, position) + view[2].w);
    mat3 r = rotation(raw);
    float inverse_z = parallel ? 1 : 1 / max(t.z, near_plane);
    vec2 slant = parallel ? vec2(0) : t.xy * inverse_z;
    vec3 m0 = scale * (focal.x * inverse_z * (view[0].xyz - slant.x * view[2].xyz) * r);
    vec3 m1 = scale * (focal.y * inverse_z * (view[1].xyz - slant.y * view[2].xyz) * r);
    float a = dot(m0, m0), b = dot(m0, m1), c = dot(m1, m1);
    vec3 across = vec3(difference(m0.y, m1.z, m0.z, m1.y), difference(m0.z, m1.x, m0.x, m1.z),
                       difference(m0.x, m1.y, m0.y, m1.x));
    float det0 = dot(across, across), h = variance;
    if (floored) {
        float mean = 0.5 * (a + c), half_difference = 0.5 * (a - c);
        float largest = mean + sqrt(half_difference * half_difference + b * b);
        h = max(0.0, variance - det0 / max(largest, 1e-30));
    }
    float det = det0 + h * (a + c + h);
    if (!parallel) {
        vec3 axis = scale * inverse_z * (view[2].xyz * r);
        vec2 low = -middle / focal, high = (edges - middle) / focal;
        vec2 edge = clamp(slant, max(min(low, -1.0), -1e9), min(max(high, 1.0), 1e9));
        vec2 ratio = (1 + edge * edge) / (1 + slant * slant);
        float beside = ratio.x * ratio.y * ratio.x * ratio.y;
        float deep = clamp((dot(axis, axis) - 0.02) / 0.04, 0.0, 1.0);
        float inverse_near = near_plane > 1e-30 ? 1 / near_plane : 1e30;
        opacity *= clamp((t.z - near_plane) * inverse_near, 0.0, 1.0) * (1 - deep * (1 - beside));
    }
    if (of_light ? floored : v.more.x != 0) opacity *= sqrt(det0 / det);
    float log2_opacity = log2(max(opacity, 1e-30));
    vec2 centre = focal * t.xy * inverse_z + middle;
    float reach = max(0.0, 2 * 0.69314718055994531 * (log2_opacity - log2_threshold));
    vec2 extent = vec2(sqrt(reach * (a + h)), sqrt(reach * (c + h)));
    drawn = drawn && log2_opacity >= log2_threshold && near_plane < t.z && t.z < 1e30;
    drawn = drawn && extent.x + extent.y < 1e9 && 0 < det && det < 1e37;
    drawn = drawn && centre.x + extent.x >= 0.5 && edges.x - 0.5 >= centre.x - extent.x;
    drawn = drawn && centre.y + extent.y >= 0.5 && edges.y - 0.5 >= centre.y - extent.y;
    depth[at] = drawn ? scale_of * (v.kind.z > 0 ? length(t) : t.z) : -1;
    float ux = sqrt(0.5 * log2e * ((c + h) / det)), uy = -ux * (b / (c + h)),
        wy = sqrt(0.5 * log2e / (c + h));
    if (!of_light && hides + median > 0u) {
        vec3 along = scale * scale_of * (view[2].xyz * r);
        float by_x = dot(m0, along), by_y = dot(m1, along);
        slope[i] = vec2(ux * by_x + uy * by_y, wy * by_y) / (0.5 * log2e);
    }
    if (drawn) record[at] = splat(centre.x, centre.y, ux, uy, wy, log2_opacity, extent.x, extent.y);
}
