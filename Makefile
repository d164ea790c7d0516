# ssdgs.h: `make help` lists what there is. CC=anything, CFLAGS and BUILD can be set; STRICT=1 turns warnings into errors.
CFLAGS ?= -O2
CXX ?= c++
BUILD = build
ITERATIONS = 5000
BENCH =
DATA = data
FUZZ_SECONDS = 1800
FUZZ_TARGETS = render scene train ply checkpoint png jpeg exr unfilter inflate colmap dataset json json_string hooks splats
SCENES = waxcow:black blocks:white anisometal:white
LDLIBS = -lm -lpthread
WINDOWS = $(filter Windows_NT,$(OS))$(findstring mingw,$(CC))
WARNINGS = -Werror -Wall -Wextra -Wpedantic -Wshadow -Wundef -Wconversion -Wdouble-promotion -Wcast-align -Wcast-qual
STRICT_1 = $(WARNINGS) $(if $(findstring ++,$(CC)),,-Wstrict-prototypes -Wmissing-prototypes)
COMPILE = $(CC) $(CFLAGS) $(STRICT_$(STRICT)) -DSSDGS_SCALAR -DSSDGS_STAGES # tests try the scalar kernels and the stages too
# The library is compiled once, and once in double: kernels.o has its kernels, ssdgs.o all else. Programs link both; those that reach
# into the library (ssdgs__) compile what is not kernels as their own, the tests only what they call, and link the kernels.
KERNELS = -DSSDGS_SELF='"tests/kernels.h"'
INSIDE := $(shell grep -li ssdgs__ tests/*.c tests/fuzz/*.c examples/*.c)
OBJECTS = $(BUILD)/kernels.o $(BUILD)/ssdgs.o
PROGRAM = $(COMPILE) $(if $(filter $<,$(INSIDE)),$(KERNELS) $(if $(filter tests/%,$<),-DSSDGS_STATIC),-DSSDGS__IMPLEMENTED)
LINKED = $< $(filter-out $(if $(filter $<,$(INSIDE)),%/ssdgs.o),$(filter %.o,$^)) -o $@ $(LDLIBS)

HEADERS = ssdgs.h $(wildcard examples/*.h tests/*.h)
EXAMPLES = $(BUILD)/train $(BUILD)/relight $(BUILD)/minimal $(BUILD)/engine $(BUILD)/export $(BUILD)/view $(BUILD)/check $(BUILD)/ball $(BUILD)/unbake $(BUILD)/colmap $(BUILD)/bench
SOURCES = $(filter-out tests/t_gpu.c,$(wildcard tests/t_*.c)) # which is `make test-gpu`
IN_DOUBLE = $(if $(SOURCES),$(shell awk 'FNR < 4 && /real64/ { print FILENAME }' $(SOURCES)))
TESTS = $(SOURCES:tests/%.c=$(BUILD)/%) $(IN_DOUBLE:tests/%.c=$(BUILD)/%_64) \
	$(BUILD)/multi $(BUILD)/compile_c $(BUILD)/compile_cpp $(BUILD)/readme $(BUILD)/manual $(BUILD)/fuzz
BUILDS = builds examples shown
RUN =# starts a test program: an emulator
DEMO = $(BUILD)/demo
MODEL = examples/data/waxcow.ply

all: $(EXAMPLES) ## the examples: build/train, build/relight, build/minimal, build/engine, build/export, build/view, build/check, build/ball, build/unbake, build/colmap, build/bench

demo: $(BUILD)/train $(BUILD)/relight ## trains on examples/data/waxcow (ITERATIONS=5000), relights it into build/demo
	@mkdir -p $(DEMO)
	$(BUILD)/train examples/data/waxcow -o $(DEMO)/waxcow.ply --iterations $(ITERATIONS) --background black
	$(BUILD)/relight $(DEMO)/waxcow.ply examples/data/waxcow --split test --background black --components \
	  --out $(DEMO) --sheet $(DEMO)/sheet.png
	@echo "look at $(DEMO)/sheet.png: photographs, the model's pictures of them, and their parts; then make view MODEL=$(DEMO)/waxcow.ply"

view: $(BUILD)/view ## a model in the browser (MODEL=file.ply): prints the address to open
	$(BUILD)/view $(MODEL)

web: $(BUILD)/web.wasm $(MODEL) ## one page that needs no server: build/view.html (MODEL=file.ply); needs emscripten
	{ echo '<script type="text/plain" id="code">'; base64 <$(BUILD)/web.wasm; echo '</script>'; \
	  echo '<script type="text/plain" id="model" data-name="$(notdir $(MODEL))">'; base64 <$(MODEL); echo '</script>'; } >$(BUILD)/web.txt
	sed -e '/<!-- make web/{r $(BUILD)/web.txt' -e 'd;}' examples/view.html >$(BUILD)/view.html
$(BUILD)/web.wasm: examples/web.c $(HEADERS) | $(BUILD)
	emcc -O2 -msimd128 -matomics -mbulk-memory --no-entry -sALLOW_MEMORY_GROWTH=1 -sTOTAL_STACK=1MB $< -o $@ \
	  -Wl,--shared-memory,--max-memory=2147483648,--import-memory,--no-check-features

bench: $(BUILD)/bench $(DEMO)/waxcow.ply $(DEMO)/waxcow_published.ply ## measures speed and shortcuts
	$(BUILD)/bench --models $(DEMO) $(BENCH)
bench-quick: ## the same, coarser: a minute or two
	$(MAKE) bench BENCH=--quick

experiments: $(BUILD)/train $(BUILD)/relight $(BUILD)/show ## the paper's experiments on SCENES in DATA (hours; PARTS="components ..." alone) into tests/EXPERIMENTS.md
	@[ -d "$(DATA)" ] || { echo "no folder $(DATA): make experiments DATA=FOLDER, where FOLDER/$(firstword $(subst :, ,$(SCENES))) and the other SCENES lie"; exit 1; }
	sh tests/experiments.sh $(BUILD) "$(DATA)" $(ITERATIONS) $(SCENES)
	mkdir -p tests/images
	cp $(BUILD)/experiments/EXPERIMENTS.md tests
	cp $(BUILD)/experiments/images/* tests/images
experiments-quick: $(BUILD)/train $(BUILD)/relight $(BUILD)/show ## the same on the scene in examples/data, 300 iterations: minutes
	sh tests/experiments.sh $(BUILD) examples/data 300 waxcow:black

# Models to measure with, trained where there are none; the published networks take longer: fewer iterations.
$(DEMO)/waxcow.ply $(DEMO)/waxcow_published.ply: | $(BUILD)/train
	@mkdir -p $(DEMO)
	$(BUILD)/train examples/data/waxcow -o $@ --background black \
	  $(if $(findstring published,$@),--preset published --iterations 1000,--iterations $(ITERATIONS))

# Each program closes with "N passed, N failed"; one that does not counts as one failed. With make -j they run side by side.
LOGS = $(BUILDS:%=$(BUILD)/%.log) $(TESTS:=.log) # the longest first: nothing waits for them alone at the end
KEEP_LOG = >$@ 2>&1 || echo "exit $$?" >>$@; echo "== $*"; cat $@
test: $(LOGS) $(EXAMPLES) $(BUILD)/show ## every test; SSDGS_GOLDEN=folder reads the golden files there
	@passed=0; failed=0; for log in $(LOGS); do \
	  set -- $$(awk '/^exit / { if (!f) f = 1; next } { p = 0; f = 1 } /^[0-9]+ passed, [0-9]+ failed$$/ { p = $$1; f = $$3 + 0 } \
	    END { print p + 0, f == "" ? 1 : f }' $$log); \
	  [ $$2 -eq 0 ] || echo "failed: $$log"; \
	  passed=$$((passed + $$1)); failed=$$((failed + $$2)); \
	done; echo "$$passed passed, $$failed failed"; [ $$failed -eq 0 ]
$(filter-out %/fuzz.log,$(TESTS:=.log)): %.log: %
	@rm -rf $*_files # an earlier run's
	@$(RUN) $* $(KEEP_LOG)
$(BUILD)/fuzz.log: %.log: %
	@$(RUN) $* tests/fuzz/seeds/*/* $(KEEP_LOG)
$(BUILD)/builds.log: %.log: $(OBJECTS) $(BUILD)/gpu_shaders.h
	@sh tests/builds.sh $(BUILD) $(COMPILE) -O0 $(KEEP_LOG)
$(BUILD)/shown.log: %.log: | $(BUILD)
	@sh tests/shown.sh $(KEEP_LOG)
$(BUILD)/examples.log: %.log: $(BUILD)/view $(BUILD)/train $(BUILD)/relight $(BUILD)/engine $(BUILD)/export $(BUILD)/check $(BUILD)/ball $(BUILD)/unbake $(BUILD)/colmap $(BUILD)/show
	@sh tests/examples.sh $(BUILD) $(KEEP_LOG)

test-browser: $(BUILD)/view $(BUILD)/train $(BUILD)/relight ## examples/view.html in headless Chromium, and make web's page where emscripten is; needs node and chromium
	@if command -v emcc >/dev/null; then $(MAKE) web; fi
	node tests/browser.js $(BUILD)

test-gltf: $(BUILD)/train $(BUILD)/export ## an exported GLB before Khronos' validator; needs node, npm and its registry
	sh tests/gltf.sh $(BUILD)

test-editors: $(BUILD)/relight $(BUILD)/export $(BUILD)/unbake ## models that went through an editor of splats, splat-transform; needs node, npm and its registry
	sh tests/editors.sh $(BUILD)

test-plain: $(BUILD)/relight ## plain splats with spherical harmonics beside Spark in headless Chromium; needs node, npm, its registry and chromium
	sh tests/plain.sh $(BUILD)

test-images: $(BUILD)/pixels ## images that other programs wrote, beside what these make of them; leaves out what is missing
	sh tests/images.sh $(BUILD)

test-capture: $(BUILD)/colmap $(BUILD)/check $(BUILD)/train $(BUILD)/relight ## two phones' photographs, rendered, through COLMAP to a model, beside what is known; needs blender, python3-numpy and colmap (hours)
	sh tests/capture.sh $(BUILD) $(BUILD)/capture

test-gpu: $(BUILD)/t_gpu ## examples/gpu on a GPU or in Mesa's software; needs EGL with OpenGL 4.3
	$(BUILD)/t_gpu full

test-engine: $(BUILD)/engine_gl ## splats among meshes in an engine's window and OpenGL context; needs SDL2, OpenGL 4.3 and a display, or xvfb-run
	$(if $(DISPLAY),,xvfb-run -a) $(BUILD)/engine_gl $(BUILD)/engine_gl.png

test-mpi: $(BUILD)/train_mpi ## training on several processes; needs mpicc
	sh tests/mpi.sh $(BUILD)
test-asan: ## tests under the address sanitizer
	$(MAKE) test BUILD=$(BUILD)/asan CFLAGS="-O1 -g -fsanitize=address -fno-omit-frame-pointer"
test-ubsan: ## tests under the undefined-behaviour sanitizer
	$(MAKE) test BUILD=$(BUILD)/ubsan CFLAGS="-O1 -g -fsanitize=undefined -fno-sanitize-recover=all"
test-tsan: ## tests under the thread sanitizer
	$(MAKE) test BUILD=$(BUILD)/tsan CFLAGS="-O1 -g -fsanitize=thread"
test-cxx: ## tests compiled as C++
	$(MAKE) test BUILD=$(BUILD)/cxx CC="$(CXX)"
test-clang: ## tests with clang
	$(MAKE) test BUILD=$(BUILD)/clang CC=clang CXX=clang++
test-tcc: ## tests with tcc
	$(MAKE) test BUILD=$(BUILD)/tcc CC=tcc CFLAGS=
test-nosimd: ## tests of the scalar kernels alone
	$(MAKE) test BUILD=$(BUILD)/nosimd CFLAGS="$(CFLAGS) -DSSDGS_NO_SIMD"
test-native: ## tests with -march=native
	$(MAKE) test BUILD=$(BUILD)/native CFLAGS="$(CFLAGS) -march=native"
test-fastmath: ## tests with -ffast-math, but for t_accuracy: its references are not to be trusted then, and denormal numbers are 0
	$(MAKE) test BUILD=$(BUILD)/fastmath CFLAGS="$(CFLAGS) -ffast-math" SOURCES="$(filter-out tests/t_accuracy.c,$(SOURCES))"
test-c99: ## tests with -std=c99
	$(MAKE) test BUILD=$(BUILD)/c99 CC="$(CC) -std=c99"

test-matrix: ## tests with every compiler and machine at hand (hours); others are named
	sh tests/matrix.sh $(BUILD)

hashes: $(BUILD)/hashes $(BUILD)/hashes_64 ## bits of training, frames and files: the same before and after code is moved
	@$(BUILD)/hashes $(BUILD); $(BUILD)/hashes_64 $(BUILD)

size: ## what including ssdgs.h costs: seconds of compiling and bytes of code
	bash tests/size.sh $(BUILD)

fuzz: $(BUILD)/fuzzers/all ## fuzzes each target for FUZZ_SECONDS (1800); needs clang's libFuzzer; findings go to build/fuzzers
	sh tests/fuzz/run.sh $(BUILD)/fuzzers $(FUZZ_SECONDS) $(FUZZ_TARGETS)

mutants: ## changes the backward passes in each of the places that tests/mutants.txt lists: do the tests notice (hours)
	sh tests/mutants.sh $(BUILD)

figures: $(TESTS) ## every test at its longest, mutants, fuzzing, coverage, compilers (a day) into tests/FIGURES.md
	-command -v clang >/dev/null && $(MAKE) $(BUILD)/fuzzers/all
	sh tests/figures.sh $(BUILD) $(FUZZ_SECONDS) $(FUZZ_TARGETS)
	cp $(BUILD)/figures/FIGURES.md tests
figures-so-far: ## tests/FIGURES.md from what is measured already
	sh tests/figures.sh $(BUILD) - $(FUZZ_TARGETS)
	cp $(BUILD)/figures/FIGURES.md tests

clean: ## removes build/
	rm -rf $(BUILD)
help: ## this list
	@sed -n 's/^\([a-z0-9-]*\):.*## /\1: /p' Makefile

$(BUILD):
	mkdir -p $(BUILD) build # where tests write
$(BUILD)/ssdgs.o $(BUILD)/ssdgs_64.o: tests/library.c ssdgs.h tests/kernels.h | $(BUILD)
	$(COMPILE) $(KERNELS) $(if $(filter %_64.o,$@),-DSSDGS_REAL64) -c $< -o $@
$(BUILD)/kernels.o $(BUILD)/kernels_64.o: tests/library.c ssdgs.h tests/kernels.h | $(BUILD)
	$(COMPILE) $(KERNELS) -DSSDGS_STATIC -DTEST_KERNELS $(if $(filter %_64.o,$@),-DSSDGS_REAL64) -c $< -o $@
$(EXAMPLES): $(BUILD)/%: examples/%.c $(HEADERS) $(OBJECTS)
	$(PROGRAM) $(LINKED)
$(BUILD)/train_mpi: examples/train_mpi.c $(HEADERS) $(OBJECTS)
	$(PROGRAM:$(CC)%=mpicc%) $(LINKED)
$(BUILD)/%: tests/%.c $(HEADERS) $(OBJECTS)
	$(PROGRAM) $(LINKED)
$(BUILD)/t_ball: examples/ball.c
$(BUILD)/t_colmap: examples/colmap.c
$(BUILD)/train $(BUILD)/view: LDLIBS += $(if $(WINDOWS),-lws2_32)
# What has the GPU's stages
ON_GPU = $(addprefix $(BUILD)/,view engine bench t_gpu engine_gl)
$(ON_GPU): examples/gpu/gpu_gl.c $(BUILD)/gpu_shaders.h
$(ON_GPU): PROGRAM += -I$(BUILD)
$(ON_GPU): LDLIBS += $(if $(WINDOWS),,-ldl)
$(BUILD)/engine_gl: PROGRAM += $(patsubst -I%,-isystem %,$(shell sdl2-config --cflags))
$(BUILD)/engine_gl: LDLIBS += $(shell sdl2-config --libs) -lGL
$(BUILD)/gpu_shaders.h: examples/gpu/shaders.awk $(wildcard examples/gpu/*.comp examples/gpu/*.glsl) | $(BUILD)
	awk -f $(filter-out %.glsl,$^) >$@ || { rm -f $@; exit 1; }
$(BUILD)/t_check: examples/check.c
$(BUILD)/t_relight: examples/relight.c
$(BUILD)/t_options: examples/train.c
$(BUILD)/hashes_64 $(BUILD)/t_scene_64 $(BUILD)/t_material_64 $(BUILD)/t_kept_64: $(BUILD)/ssdgs_64.o
$(BUILD)/%_64: tests/%.c $(HEADERS) $(BUILD)/kernels_64.o
	$(PROGRAM) -DSSDGS_REAL64 $(LINKED)
$(BUILD)/t_gradient: tests/t_gradient.c $(HEADERS) $(BUILD)/kernels_64.o
	$(PROGRAM) $(LINKED)
$(BUILD)/fuzz: tests/fuzz/fuzz.c $(HEADERS) $(OBJECTS)
	$(PROGRAM) $(LINKED)
# What the manuals show is taken from there.
$(BUILD)/readme: tests/readme.c README.md $(HEADERS) $(OBJECTS)
	sed -n '/^\/\* readme example \*\//,/^```/{/^```/d;p;}' README.md >$(BUILD)/readme_example.c
	$(PROGRAM) -I. -I$(BUILD) $(LINKED)
$(BUILD)/manual: tests/manual.c $(HEADERS) $(OBJECTS)
	for e in render train; do \
	  sed -n "/^--- $$e example ---/,/^--- end ---/s/^    //p" ssdgs.h >$(BUILD)/manual_$$e.c; done
	$(PROGRAM) -I. -I$(BUILD) $(LINKED)
# All of it as C++, unoptimised and without AVX-512's kernels, which are those of AVX2 once more: they take long to compile. Without a
# C++ compiler there is nothing to check.
$(BUILD)/compile_cpp: tests/compile_cpp.cpp tests/compile_c.c $(HEADERS) | $(BUILD)
	if command -v $(CXX) >/dev/null; then $(CXX) $(CFLAGS) -O0 -DSSDGS_NO_AVX512 -std=c++11 $< -o $@ $(LDLIBS); \
	else printf '#!/bin/sh\necho "$(CXX) is missing: C++ not tested"\necho "0 passed, 0 failed"\n' >$@; chmod +x $@; fi

# AVX-512 would be the kernels of AVX2 once more, and take long to build.
$(BUILD)/fuzzers/all: tests/fuzz/fuzz.c $(HEADERS)
	mkdir -p $(BUILD)/fuzzers
	clang -O1 -gline-tables-only -DLIBFUZZER -DSSDGS_NO_AVX512 -fsanitize=fuzzer,address,undefined,float-cast-overflow \
	  -fno-sanitize-recover=all $< -o $@ $(LDLIBS)

.PHONY: $(LOGS) all demo view web test-browser test-gltf test-editors test-plain test-capture test-images test-gpu test-engine test-mpi bench bench-quick size hashes experiments experiments-quick test test-asan test-ubsan test-tsan test-cxx test-clang test-tcc test-nosimd test-native test-fastmath \
	test-c99 test-matrix fuzz mutants figures figures-so-far clean help
