/* Shared by transport_nodes.comp and transport_sums.comp. Reads the places of Gaussians, and the flux
   that a light brings to each. 64 Gaussians are a node: training leaves neighbours together. After these
   nodes come the nodes above them, of 64 nodes each, all of one object. */

layout(std430, binding = 4) readonly buffer fluxes { float all_flux[]; };
struct node {
    vec4 middle; /* of the flux; w: its sum */
    vec4 radius;
};
uint light, o;
uint first_node() { return light * (blocks + above); }
uint first_of() { return uint(objects[o].place.x); }
uint end_of() { return first_of() + uint(objects[o].place.y); }
vec4 source(uint g) {
    float scale = objects[o].shape.x, area = lamps[light].place.w > 0 ? scale * scale : 1;
    return vec4(planes_of(o, 0u, g - first_of()), all_flux[light * count + g] / area);
}
/* Does light scatter in the object by true transport, and does the light bring some? */
bool is_asked() {
    return lamps[light].intensity.w > 0 && (objects[o].of.x & has_transport) != 0 &&
        (objects[o].of.x & is_lit) != 0 && reaches(int(light), o);
}
