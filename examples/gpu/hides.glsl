/* Where the picture's scene depth hides what lies behind it. */

shared vec3 fronts[window]; /* of the window's entries: slope, depth */
float behind; /* of the pixel: what is not nearer is hidden */
void find_behind() {
    behind = 3.4028235e38;
    if (hides == 0u || !inside()) return;
    uint row = scene_raw != 0u ? height - 1u - pixel().y : pixel().y;
    float at = outside[scene_at + row * width + pixel().x];
    if (scene_raw != 0u) at = 1 / dot(unseen, vec4(pixel(), at, 1));
    if (is_number(at) && at > 0) behind = at; /* what is none hides nothing */
}
void load_front(uint place, uint gaussian) {
    vec2 own = hides + median > 0u ? slope[gaussian] : vec2(0);
    fronts[place] = vec3(own, depth[base + gaussian]);
}
/* An entry's mean depth at a pixel, above 0. */
float depth_at(uint i, vec2 at) {
    uint some = i % window;
    vec2 d = at - splats[some].xy;
    vec2 uw = vec2(splats[some].z * d.x + splats[some].w * d.y, spreads[some].x * d.y);
    return max(0.001 * fronts[some].z, fronts[some].z + dot(fronts[some].xy, uw));
}
bool is_open(uint i) { return hides == 0u || depth_at(i, centre()) < behind; }
