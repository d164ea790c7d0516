/* examples/ball.c: highlights of lights that are known, on balls anywhere in the picture. cc -o build/t_ball
   tests/t_ball.c -lm -lpthread && build/t_ball */
int ball_main(int argc, char **argv);
#define main ball_main
#include "../examples/ball.c"
#undef main
#include "test.h"

enum { W = 200, H = 160 };
static unsigned char rgba[W * H * 4];

/* Where a pixel's ray is reflected to, by Newton: the ball's own formulas are not used. 0: it misses. */
static int mirror(const double ball[3], double radius, const double ray[3], double out[3]) {
    double t = 0, from[3] = {0, 0, 0};
    if (ray[2] == 0) return 0;
    for (int step = 0; step < 200; step++) { /* a march to the surface */
        double gap = 0;
        for (int c = 0; c < 3; c++)
            gap += (from[c] + t * ray[c] - ball[c]) * (from[c] + t * ray[c] - ball[c]);
        gap = sqrt(gap) - radius;
        t += gap;
        if (t > 100) return 0;
        if (fabs(gap) < 1e-12) break;
    }
    double normal[3], along = 0;
    for (int c = 0; c < 3; c++) normal[c] = (t * ray[c] - ball[c]) / radius, along += normal[c] * ray[c];
    for (int c = 0; c < 3; c++) out[c] = ray[c] - 2 * along * normal[c];
    return 1;
}

/* Draws the ball under a light in a direction (x right, y down, z forward): bright where it is seen. */
static void draw(const double ball[3], double radius, double focal, const double light[3]) {
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            double ray[3] = {(x + 0.5 - W / 2) / focal, (y + 0.5 - H / 2) / focal, 1}, out[3];
            const double length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + 1);
            for (int c = 0; c < 3; c++) ray[c] /= length;
            int value = 20;
            if (mirror(ball, radius, ray, out)) {
                const double cosine = out[0] * light[0] + out[1] * light[1] + out[2] * light[2];
                value = cosine > cos(0.12) ? 255 : 40;
            }
            for (int c = 0; c < 4; c++) rgba[4 * (y * W + x) + c] = (unsigned char)(c < 3 ? value : 255);
        }
}

int main(void) {
    static const double places[3][2] = {{0, 0}, {0.12, -0.1}, {-0.15, 0.08}};
    double worst = 0, worst_far = 0;
    for (int place = 0; place < 3; place++)
        for (int i = 0; i < 40; i++) {
            const double focal = 300, z = -0.2 - 0.8 * (i + 0.5) / 40, turn = 2.4 * i,
                         across = sqrt(1 - z * z);
            const double light[3] = {across * cos(turn), across * sin(turn), z},
                         ball[3] = {places[place][0], places[place][1], 1};
            const double centre[2] = {W / 2.0, H / 2.0},
                         circle[3] = {W / 2.0 + focal * ball[0], H / 2.0 + focal * ball[1],
                                      focal *
                                          tan(asin(0.15 / sqrt(1 + ball[0] * ball[0] + ball[1] * ball[1])))};
            double at[2], got[3];
            draw(ball, 0.15, focal, light);
            if (!CHECK(!highlight(rgba, W, H, circle, at) && reflected(circle, at, focal, centre, got)))
                continue;
            const double cosine = got[0] * light[0] - got[1] * light[1] - got[2] * light[2];
            worst = test_most(worst, acos(cosine < 1 ? cosine : 1));
            if (place) continue;
            CHECK(reflected(circle, at, 0, centre, got)); /* a lens so long hardly matters */
            worst_far =
                fmax(worst_far, acos(fmin(1, got[0] * light[0] - got[1] * light[1] - got[2] * light[2])));
        }
    printf("figure ball_worst_degrees %.2f\n", 57.3 * worst);
    CHECK(worst < 0.035); /* 2 degrees: half a pixel at the rim is one */
    CHECK(worst_far < 0.35 && worst_far > worst);
    const double circle[3] = {100, 80, 40};
    double at[2], direction[3];
    memset(rgba, 0, sizeof rgba);
    memset(rgba + 4 * (5 * W + 5), 255, 4); /* beside the ball */
    CHECK(!strcmp(highlight(rgba, W, H, circle, at), "nothing bright within the circle"));
    rgba[4 * (80 * W + 70)] = rgba[4 * (80 * W + 70) + 1] = rgba[4 * (80 * W + 70) + 2] = 255;
    CHECK(!highlight(rgba, W, H, circle, at) && fabs(at[0] - 70.5) < 1e-9 && fabs(at[1] - 80.5) < 1e-9);
    memcpy(rgba + 4 * (80 * W + 130), rgba + 4 * (80 * W + 70), 4);
    CHECK(!strcmp(highlight(rgba, W, H, circle, at), "more than one bright spot within the circle"));
    const double middle[2] = {100, 80}, outside[2] = {150, 80};
    CHECK(reflected(circle, middle, 0, middle, direction) && fabs(direction[0]) < 1e-12 &&
          fabs(direction[2] - 1) < 1e-12);
    CHECK(!reflected(circle, outside, 0, middle, direction) &&
          !reflected(circle, outside, 300, middle, direction));
    TEST_END();
}
