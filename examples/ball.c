/* cc -O2 examples/ball.c -o ball -lm -lpthread: where the light was, from its highlight on a ball of chrome.
 */
#define SSDGS_IMPLEMENTATION
#define SSDGS_NO_TRAINER
#include "../ssdgs.h"
#include "olat.h"

static int usage(void) {
    fprintf(
        stderr,
        "usage: ball X Y RADIUS IMAGE [IMAGE ...] [--focal PIXELS]\n"
        "For photographs of a ball of chrome, its outline a circle round (X, Y) in pixels, prints pl_dir, "
        "the\n"
        "direction to the light: x right, y up, z to the viewer. Turned by the camera's rotation, the first\n"
        "three columns of its transform_matrix, that is what a frame needs.\n"
        "  --focal PIXELS   the lens; without it the camera counts as far away\n");
    return 2;
}

/* The middle of the brightest spot within the circle; 0, or what is wrong. */
static const char *highlight(const unsigned char *rgba, int width, int height, const double circle[3],
                             double at[2]) {
    double most = 0, sum = 0, square = 0;
    at[0] = at[1] = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++) {
                const unsigned char *p = rgba + 4 * ((size_t)y * (size_t)width + (size_t)x);
                const double value = (p[0] + p[1] + p[2]) / 765.0, u = x + 0.5, v = y + 0.5;
                if (hypot(u - circle[0], v - circle[1]) > 0.98 * circle[2]) continue;
                if (!pass) most = value > most ? value : most;
                else if (value >= 0.9 * most) {
                    at[0] += u, at[1] += v, sum++;
                    square += u * u + v * v;
                }
            }
    if (most < 0.2) return "nothing bright within the circle";
    at[0] /= sum, at[1] /= sum;
    if (sqrt(fmax(0, square / sum - at[0] * at[0] - at[1] * at[1])) > 0.2 * circle[2])
        return "more than one bright spot within the circle";
    return NULL;
}

/* Where a ray that hits the ball at a pixel is reflected to: x right, y up, z to the viewer. focal 0: the
   camera is far away. 0: the ray misses. */
static int reflected(const double circle[3], const double at[2], double focal, const double centre[2],
                     double direction[3]) {
    double ray[3] = {0, 0, 1}, ball[3] = {0, 0, 0}, normal[3];
    if (focal > 0) { /* a ball at distance 1 whose outline has that angle */
        const double angle = atan(circle[2] / focal);
        for (int c = 0; c < 2; c++)
            ray[c] = (at[c] - centre[c]) / focal, ball[c] = (circle[c] - centre[c]) / focal;
        ball[2] = 1;
        const double to_ray = sqrt(olat__dot(ray, ray)), to_ball = sqrt(olat__dot(ball, ball));
        for (int c = 0; c < 3; c++) ray[c] /= to_ray, ball[c] /= to_ball;
        const double along = olat__dot(ray, ball), left = along * along - 1 + sin(angle) * sin(angle);
        if (left < 0) return 0;
        for (int c = 0; c < 3; c++) normal[c] = (ray[c] * (along - sqrt(left)) - ball[c]) / sin(angle);
    } else {
        for (int c = 0; c < 2; c++) normal[c] = (at[c] - circle[c]) / circle[2];
        const double left = 1 - normal[0] * normal[0] - normal[1] * normal[1];
        if (left < 0) return 0;
        normal[2] = -sqrt(left);
    }
    const double twice = 2 * olat__dot(ray, normal);
    for (int c = 0; c < 3; c++) direction[c] = (ray[c] - twice * normal[c]) * (c ? -1 : 1);
    return 1;
}

int main(int argc, char **argv) {
    double circle[3], focal = 0;
    int numbers = 0, images = 0, failed = 0;
    for (int i = 1; i < argc; i++) {
        double value;
        if (!strcmp(argv[i], "--focal")) {
            if (++i == argc || !olat_argument(argv[i], &focal) || !(focal > 0)) return usage();
        } else if (numbers < 3) {
            if (!olat_argument(argv[i], &value)) return usage();
            circle[numbers++] = value;
        } else if (argv[i][0] == '-') return usage();
        else argv[images++] = argv[i];
    }
    if (numbers < 3 || !images || !(circle[2] > 0)) return usage();
    for (int i = 0; i < images; i++) {
        char error[512];
        int width = 0, height = 0;
        ssdgs_pixels format;
        void *pixels = NULL;
        double at[2], direction[3];
        const char *problem;
        olat__found found;
        memset(&found, 0, sizeof found);
        const int unread = olat__image_file(argv[i], 0, &width, &height, &format, &pixels, &found, error);
        for (int r = 0; r < found.count; r++)
            fprintf(stderr, "ball: note: %s is %s\n", argv[i], found.remarks[r].text);
        unsigned char *bytes = unread ? NULL : (unsigned char *)malloc(4 * (size_t)width * (size_t)height);
        for (size_t p = 0; bytes && p < 4 * (size_t)width * (size_t)height; p++) {
            const ssdgs_real v = olat__number(pixels, format, p);
            bytes[p] = (unsigned char)(v < 1 ? 255 * v + (ssdgs_real)0.5 : 255);
        }
        const double centre[2] = {0.5 * width, 0.5 * height};
        problem = unread ? error : !bytes ? "out of memory" : highlight(bytes, width, height, circle, at);
        if (!problem && !reflected(circle, at, focal, centre, direction))
            problem = "the highlight lies beside the ball";
        if (problem)
            fprintf(stderr, unread ? "ball: %s\n" : "ball: %s: %s\n", unread ? problem : argv[i], problem);
        else
            printf("%s: \"pl_dir\": [%.6f, %.6f, %.6f]\n", argv[i], direction[0], direction[1], direction[2]);
        failed |= problem != NULL;
        free(bytes);
        free(pixels);
    }
    return failed;
}
