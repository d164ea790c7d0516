/* COMPOSITE of colour and layers; blend.glsl says what it reads and writes. */
#version 430
#include "common.glsl"
#include "walk.glsl"
const uint window = 128u, windows = 1u;
#include "window.glsl"
#include "fours.glsl"
const uint at_once = 8u;
#include "blend.glsl"
