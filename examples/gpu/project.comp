/* PROJECT: eq. 1, a thread a Gaussian. Reads the model. Writes a record and a depth of each; depth -1 says
   that it is not drawn. */
#version 430
#include "common.glsl"
#include "rotation.glsl"

layout(std140, binding = 0) uniform parameters {
    vec4 view[3];
    float fx, fy, cx, cy, near_plane, log2_threshold, variance;
    uint count, stride, width, height, orthographic, by_distance, compensate, floored;
};
layout(std430, binding = 0) readonly buffer model { float gaussian[]; };
layout(std430, binding = 1) writeonly buffer records { splat record[]; };
layout(std430, binding = 2) writeonly buffer depths { float depth[]; };

float channel(uint which, uint i) { return gaussian[which * stride + i]; }
vec3 channels(uint which, uint i) {
    return vec3(channel(which, i), channel(which + 1u, i), channel(which + 2u, i));
}

/* a b - c d, its rounding error put back. */
float difference(float a, float b, float c, float d) {
    precise float product = c * d;
    precise float first = fma(a, b, -product), error = fma(-c, d, product);
    return first + error;
}

/* The splat's covariance is C = m m' + h, m = J W R S. Opacity fades near the eye. Beside the picture it
   fades of what reaches far back along z: the affine projection of that would cover the picture. */
void main() {
    uint i = item();
    if (i >= count) return;
    vec3 position = channels(0u, i);
    vec4 raw = vec4(channel(3u, i), channels(4u, i));
    vec3 log_scale = channels(7u, i);
    float logit = channel(10u, i);
    bool drawn = is_finite(position) && is_finite(raw.xyz) && is_finite(raw.w) &&
        is_number(log_scale.x) && is_number(log_scale.y) && is_number(log_scale.z) && is_number(logit);
    vec3 scale = exp(clamp(log_scale, -20.0, 20.0));
    float opacity = 1 / (1 + exp(-clamp(logit, -20.0, 20.0)));
    vec3 t = vec3(dot(view[0].xyz, position) + view[0].w, dot(view[1].xyz, position) + view[1].w,
                  dot(view[2].xyz, position) + view[2].w);
    mat3 r = rotation(raw);
    float inverse_z = orthographic != 0u ? 1 : 1 / max(t.z, near_plane);
    vec2 slope = orthographic != 0u ? vec2(0) : t.xy * inverse_z;
    vec3 m0 = scale * (fx * inverse_z * (view[0].xyz - slope.x * view[2].xyz) * r);
    vec3 m1 = scale * (fy * inverse_z * (view[1].xyz - slope.y * view[2].xyz) * r);
    float a = dot(m0, m0), b = dot(m0, m1), c = dot(m1, m1);
    vec3 across = vec3(difference(m0.y, m1.z, m0.z, m1.y), difference(m0.z, m1.x, m0.x, m1.z),
                       difference(m0.x, m1.y, m0.y, m1.x));
    float det0 = dot(across, across), h = variance;
    if (floored != 0u) {
        float mean = 0.5 * (a + c), half_difference = 0.5 * (a - c);
        float largest = mean + sqrt(half_difference * half_difference + b * b);
        h = max(0.0, variance - det0 / max(largest, 1e-30));
    }
    float det = det0 + h * (a + c + h);
    if (orthographic == 0u) {
        vec3 axis = scale * inverse_z * (view[2].xyz * r);
        vec2 low = -vec2(cx, cy) / vec2(fx, fy), high = (vec2(width, height) - vec2(cx, cy)) / vec2(fx, fy);
        vec2 edge = clamp(slope, max(min(low, -1.0), -1e9), min(max(high, 1.0), 1e9));
        vec2 ratio = (1 + edge * edge) / (1 + slope * slope);
        float beside = ratio.x * ratio.y * ratio.x * ratio.y;
        float deep = clamp((dot(axis, axis) - 0.02) / 0.04, 0.0, 1.0);
        float inverse_near = near_plane > 1e-30 ? 1 / near_plane : 1e30;
        opacity *= clamp((t.z - near_plane) * inverse_near, 0.0, 1.0) * (1 - deep * (1 - beside));
    }
    if (compensate != 0u) opacity *= sqrt(det0 / det);
    float log2_opacity = log2(max(opacity, 1e-30));
    vec2 centre = vec2(fx * t.x, fy * t.y) * inverse_z + vec2(cx, cy);
    float reach = max(0.0, 2 * 0.69314718055994531 * (log2_opacity - log2_threshold));
    vec2 extent = vec2(sqrt(reach * (a + h)), sqrt(reach * (c + h)));
    drawn = drawn && log2_opacity >= log2_threshold && near_plane < t.z && t.z < 1e30;
    drawn = drawn && extent.x + extent.y < 1e9 && 0 < det && det < 1e37;
    drawn = drawn && centre.x + extent.x >= 0.5 && float(width) - 0.5 >= centre.x - extent.x;
    drawn = drawn && centre.y + extent.y >= 0.5 && float(height) - 0.5 >= centre.y - extent.y;
    depth[i] = drawn ? (by_distance != 0u ? length(t) : t.z) : -1;
    float ux = sqrt(0.5 * log2e * ((c + h) / det)), uy = -ux * (b / (c + h)),
        wy = sqrt(0.5 * log2e / (c + h));
    if (drawn) record[i] = splat(centre.x, centre.y, ux, uy, wy, log2_opacity, extent.x, extent.y);
}
