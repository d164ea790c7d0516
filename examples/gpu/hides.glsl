/* Where the picture's scene depth hides what lies behind it. */

shared float fronts[window]; /* depths of the window's entries */
float behind; /* of the pixel: what is not nearer is hidden */
void find_behind() {
    behind = 3.4028235e38;
    if (hides == 0u || !inside()) return;
    uint row = scene_raw != 0u ? height - 1u - pixel().y : pixel().y;
    float at = outside[scene_at + row * width + pixel().x];
    if (scene_raw != 0u) at = 1 / dot(unseen, vec4(pixel(), at, 1));
    if (is_number(at) && at > 0) behind = at; /* what is none hides nothing */
}
void load_front(uint place, uint gaussian) { fronts[place] = depth[base + gaussian]; }
bool is_open(uint i) { return hides == 0u || fronts[i % window] < behind; }
