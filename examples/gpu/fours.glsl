/* Takes a micro-tile's entries by four, so that no weight waits for another. The program says what
   becomes of one: meet(). */

/* What a program does with an entry of the window, or with `none`, whose weight is 0. */
void meet(float weight, uint i);
float weight_at(uint i, vec2 at) {
    uint some = i % window;
    float weight = weight_of(splats[some], spreads[some], at);
    return i == none ? 0 : weight;
}
/* The next four of these bits, which are a word of the list. */
void meet_four(inout uint rest, uint word, vec2 at) {
    uint a = take(rest, word), b = take(rest, word), c = take(rest, word), d = take(rest, word);
    float of_a = weight_at(a, at), of_b = weight_at(b, at), of_c = weight_at(c, at), of_d = weight_at(d, at);
    meet(of_a, a);
    meet(of_b, b);
    meet(of_c, c);
    meet(of_d, d);
}
