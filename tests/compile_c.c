/* Every function of the interface, by its address: the header alone compiles, and a definition of each
   exists. */
#ifndef SSDGS_STAGES
#define SSDGS_STAGES
#endif
#include "../ssdgs.h"
#include "test.h"

typedef void (*any_function)(void);
#define ADDRESS(function) (any_function) function
static const any_function functions[] = {ADDRESS(ssdgs_context_create),
                                         ADDRESS(ssdgs_context_destroy),
                                         ADDRESS(ssdgs_error_message),
                                         ADDRESS(ssdgs_result_string),
                                         ADDRESS(ssdgs_isa_string),
                                         ADDRESS(ssdgs_context_isa),
                                         ADDRESS(ssdgs_context_threads),
                                         ADDRESS(ssdgs_context_trim),
                                         ADDRESS(ssdgs_context_run),
                                         ADDRESS(ssdgs_settings_default),
                                         ADDRESS(ssdgs_settings_published),
                                         ADDRESS(ssdgs_model_create),
                                         ADDRESS(ssdgs_model_destroy),
                                         ADDRESS(ssdgs_model_arrays),
                                         ADDRESS(ssdgs_model_peek),
                                         ADDRESS(ssdgs_gaussian_default),
                                         ADDRESS(ssdgs_model_set),
                                         ADDRESS(ssdgs_model_get),
                                         ADDRESS(ssdgs_model_settings),
                                         ADDRESS(ssdgs_model_count),
                                         ADDRESS(ssdgs_model_sort),
                                         ADDRESS(ssdgs_model_save),
                                         ADDRESS(ssdgs_model_write),
                                         ADDRESS(ssdgs_model_load),
                                         ADDRESS(ssdgs_model_load_memory),
                                         ADDRESS(ssdgs_camera_look_at),
                                         ADDRESS(ssdgs_render_options_default),
                                         ADDRESS(ssdgs_render),
                                         ADDRESS(ssdgs_render_ex),
                                         ADDRESS(ssdgs_object_default),
                                         ADDRESS(ssdgs_scene_create),
                                         ADDRESS(ssdgs_scene_destroy),
                                         ADDRESS(ssdgs_scene_render),
                                         ADDRESS(ssdgs_scene_occlude),
                                         ADDRESS(ssdgs_scene_light),
                                         ADDRESS(ssdgs_scene_shadow),
                                         ADDRESS(ssdgs_scene_light_map),
                                         ADDRESS(ssdgs_camera_from_matrices),
                                         ADDRESS(ssdgs_depth_from_buffer),
                                         ADDRESS(ssdgs_light_point),
                                         ADDRESS(ssdgs_light_directional),
                                         ADDRESS(ssdgs_light_spot),
                                         ADDRESS(ssdgs_gaussian_mirror),
                                         ADDRESS(ssdgs_srgb_encode),
                                         ADDRESS(ssdgs_srgb_decode),
                                         ADDRESS(ssdgs_to_bytes),
                                         ADDRESS(ssdgs_train_options_default),
                                         ADDRESS(ssdgs_train_options_published),
                                         ADDRESS(ssdgs_trainer_create),
                                         ADDRESS(ssdgs_trainer_destroy),
                                         ADDRESS(ssdgs_trainer_step),
                                         ADDRESS(ssdgs_trainer_run),
                                         ADDRESS(ssdgs_trainer_refined),
                                         ADDRESS(ssdgs_trainer_save),
                                         ADDRESS(ssdgs_trainer_load),
                                         ADDRESS(ssdgs_compare),
                                         ADDRESS(ssdgs_evaluate),
                                         ADDRESS(ssdgs_refine_photo),
                                         ADDRESS(ssdgs_stage_cpu),
                                         ADDRESS(ssdgs_context_fail),
                                         ADDRESS(ssdgs_render_options_exact),
                                         ADDRESS(ssdgs_render_options_fast),
                                         ADDRESS(ssdgs_render_options_preview),
                                         ADDRESS(ssdgs_compose),
                                         ADDRESS(ssdgs_to_pixels),
                                         ADDRESS(ssdgs_blend_pixels),
                                         ADDRESS(ssdgs_model_bounds),
                                         ADDRESS(ssdgs_model_move),
                                         ADDRESS(ssdgs_checkpoint_iteration)};

int main(void) {
    for (size_t i = 0; i < sizeof functions / sizeof functions[0]; i++) CHECK(functions[i] != NULL);
    TEST_END();
}
