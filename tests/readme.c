/* Runs the example in README.md, which the Makefile extracts. */
#include "test.h"
int readme_main(void);
#define main readme_main
#include "readme_example.c"
#undef main

int main(void) {
    CHECK(readme_main() == 0);
    TEST_END();
}
