/* What tests/images.sh compares with other programs' readings:

   pixels --bytes FILE
       the stored bytes as PPM
   pixels FILE [MASK]
       the image as a photograph of a dataset beside it, whose name is FILE.json: lines of x, y, and red,
   green, blue as linear sRGB light, and alpha; before them the notes */
#define SSDGS_IMPLEMENTATION
#include "../ssdgs.h"
#include "../examples/olat.h"

static int failed(const char *message) {
    fprintf(stderr, "pixels: %s\n", message);
    return 1;
}

static int print_bytes(const char *path) {
    olat__found found;
    char error[512];
    int width, height;
    ssdgs_pixels format;
    void *pixels;
    memset(&found, 0, sizeof found);
    if (olat__image_file(path, 1, &width, &height, &format, &pixels, &found, error)) return failed(error);
    if (format != SSDGS_PIXELS_RGBA8) return failed("not of bytes");
    printf("P6\n%d %d\n255\n", width, height);
    for (size_t i = 0; i < (size_t)width * (size_t)height; i++)
        fwrite((unsigned char *)pixels + 4 * i, 1, 3, stdout);
    free(pixels);
    return 0;
}

int main(int argc, char **argv) {
    olat_dataset set;
    char error[512], json[4096], folder[4096];
    if (argc == 3 && !strcmp(argv[1], "--bytes")) return print_bytes(argv[2]);
    if (argc < 2 || argc > 3 || strlen(argv[1]) > 2000)
        return failed("usage: pixels FILE [MASK], both in one folder");
    const char *slash = strrchr(argv[1], '/'), *name = slash ? slash + 1 : argv[1];
    const char *mask = argc < 3 ? NULL : strrchr(argv[2], '/') ? strrchr(argv[2], '/') + 1 : argv[2];
    snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - argv[1]) : 1, slash ? argv[1] : ".");
    snprintf(json, sizeof json, "%s.json", argv[1]);
    FILE *file = fopen(json, "w");
    if (!file) return failed("FILE.json cannot be written");
    fprintf(file,
            "{\"camera_angle_x\": 1, \"frames\": [{\"img_path\": \"%s\", \"pl_pos\": [0, 0, 1],%s%s%s"
            " \"transform_matrix\": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]}]}\n",
            name, mask ? " \"mask_path\": \"" : "", mask ? mask : "", mask ? "\"," : "");
    if (fclose(file)) return failed("FILE.json cannot be written");
    snprintf(json, sizeof json, "%s.json", name);
    if (olat_load(folder, json, 0, &set, error)) return failed(error);
    const char *line = set.notes;
    for (int length; *line; line += length + (line[length] == '\n')) {
        length = (int)strcspn(line, "\n");
        printf("note: %.*s\n", length, line);
    }
    const olat_frame *frame = set.frames;
    for (int y = 0; y < frame->camera.height; y++)
        for (int x = 0; x < frame->camera.width; x++) {
            const size_t i = 4 * ((size_t)y * (size_t)frame->camera.width + (size_t)x);
            double v[4];
            for (size_t c = 0; c < 4; c++) {
                const ssdgs_real number = olat__number(frame->pixels, frame->format, i + c);
                const int coded = c < 3 && !olat__is_light(frame->format);
                v[c] = (double)(coded ? ssdgs_srgb_decode(number) : number);
            }
            printf("%d %d %.6f %.6f %.6f %.6f\n", x, y, v[0], v[1], v[2], v[3]);
        }
    olat_free(&set);
    return 0;
}
