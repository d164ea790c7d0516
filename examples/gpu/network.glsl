/* A network, for so many columns at once. Reads weights: of each layer (inputs, neurons), then biases,
   with neurons padded to 4. Reads and writes `row`: inputs, then what each layer makes of them, in place.
   A thread sums 4 neurons of 4 columns. Its columns lie apart, so that neighbouring threads read
   neighbouring values. A hidden value that is NaN becomes 0, as on the CPU. */

layout(std430, binding = 4) readonly buffer weight_block { vec4 weight[]; }; /* the models' */
int columns;
shared float row[4096];
void run_network(ivec4 net, int at) {
    int apart = columns / 4;
    int column = int(lane()) % apart;
    int first = int(lane()) / apart * 4;
    int depth = net.y;
    for (int layer = 1; layer <= net.x; layer++) {
        int neurons = layer < net.x ? net.z : net.w;
        int stride = (neurons + 3) / 4;
        int from = at + first / 4;
        vec4 sum0 = vec4(0);
        vec4 sum1 = vec4(0);
        vec4 sum2 = vec4(0);
        vec4 sum3 = vec4(0);
        barrier();
        if (first < neurons) {
            int x = column;
            for (int k = 0; k < depth; k++, from += stride, x += columns) {
                vec4 w = weight[from];
                vec4 v = vec4(row[x], row[x + apart], row[x + 2 * apart], row[x + 3 * apart]);
                sum0 += w.x * v;
                sum1 += w.y * v;
                sum2 += w.z * v;
                sum3 += w.w * v;
            }
            vec4 bias = weight[from];
            sum0 += bias.x;
            sum1 += bias.y;
            sum2 += bias.z;
            sum3 += bias.w;
        }
        barrier();
        if (layer < net.x) {
            sum0 = mix(vec4(0), sum0, greaterThan(sum0, vec4(0)));
            sum1 = mix(vec4(0), sum1, greaterThan(sum1, vec4(0)));
            sum2 = mix(vec4(0), sum2, greaterThan(sum2, vec4(0)));
            sum3 = mix(vec4(0), sum3, greaterThan(sum3, vec4(0)));
        }
        if (first < neurons) {
            for (int i = 0; i < 4; i++) {
                int to = first * columns + column + i * apart;
                row[to] = sum0[i];
                row[to + columns] = sum1[i];
                row[to + 2 * columns] = sum2[i];
                row[to + 3 * columns] = sum3[i];
            }
        }
        at += (depth + 1) * stride;
        depth = neurons;
    }
    barrier();
}
int put(int at, float x) {
    row[at * columns + int(lane())] = x;
    return at + 1;
}
float answer_of(int at) { return row[at * columns + int(lane())]; }
/* pi / 2 in three parts, good to 1e5 */
void sine_cosine(float x, out float s, out float c) {
    float n = round(x * 0.636619772);
    precise float r = x - n * 1.5703125;
    r = r - n * 4.83751296997070e-4;
    r = r - n * 7.54978995489188e-8;
    float r2 = r * r;
    float ps = ((-1.9515295891e-4 * r2 + 8.3321608736e-3) * r2 - 1.6666654611e-1) * r2 * r + r;
    float pc = ((2.4433157118e-5 * r2 - 1.3887316255e-3) * r2 + 4.1666645683e-2) * (r2 * r2) - 0.5 * r2 + 1.0;
    int quadrant = int(n) & 3;
    s = (quadrant & 1) == 0 ? ps : pc;
    c = (quadrant & 1) == 0 ? pc : ps;
    s = quadrant > 1 ? -s : s;
    c = quadrant == 1 || quadrant == 2 ? -c : c;
}
/* x, its sines, its cosines, each row after `dims` others'; one sine and cosine, the others by doubling the
   angle. */
void encode(int at, int dims, float x, int levels) {
    float s;
    float c;
    put(at, x);
    sine_cosine(clamp(x, -1e5, 1e5), s, c);
    for (int i = 1; i <= levels; i++) {
        float twice = s + s;
        put(at + dims * i, s);
        put(at + dims * (levels + i), c);
        s = twice * c;
        c = 1.0 - twice * (0.5 * twice);
    }
}
int encode(int at, vec3 x, int levels) {
    for (int i = 0; i < 3; i++) encode(at + i, 3, x[i], levels);
    return at + 3 + 6 * levels;
}
