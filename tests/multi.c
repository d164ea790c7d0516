/* One of two translation units: sees the interface only; the other is library.c. */
#include "../ssdgs.h"
#include "test.h"

int main(void) {
    ssdgs_context *context = NULL;
    ssdgs_model *model = NULL;
    CHECK(ssdgs_context_create(NULL, &context) == SSDGS_OK);
    CHECK(ssdgs_model_create(context, NULL, 3, &model) == SSDGS_OK);
    CHECK(model && ssdgs_model_settings(model)->terms == SSDGS_ALL_TERMS);
    CHECK(!strcmp(ssdgs_result_string(SSDGS_OK), "ok"));
    ssdgs_model_destroy(model);
    ssdgs_context_destroy(context);
    TEST_END();
}
