/* Raw planes of models, one after the other. */

layout(std430, binding = 3) readonly buffer models { float model[]; };
float plane_of(uint o, uint which, uint own) {
    return model[uint(objects[o].place.z) + which * uint(objects[o].place.w) + own];
}
vec3 planes_of(uint o, uint which, uint own) {
    return vec3(plane_of(o, which, own), plane_of(o, which + 1u, own), plane_of(o, which + 2u, own));
}
