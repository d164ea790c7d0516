/* json.h - reads and writes JSON. MIT, see ssdgs.h.

   #include "json.h"
   ...
   olat__json j; double angle; char error[512];
   memset(&j, 0, sizeof j);
   j.path = path; j.text = text; j.end = text + size; j.error = error;  (path and text from malloc, *j.end 0)
   olat__json_parse(&j);
   if (!j.failed && olat__get(&j, j.nodes, "angle", 1, &angle)) printf("%g\n", angle);
   if (j.failed) puts(error);
   olat__json_close(&j);

   CONTENTS  failures; numbers, strings, values; the parser; members of objects; the writer.

   ERRORS  The first one is kept in `error`: file, line, keys from the root on. Readers then return 0 and may
   be called on.

   MEMORY  Strings are decoded in place, in the text. All values are one array of nodes, which grows;
   olat__json_close frees path, text and nodes. A writer's text grows until olat__writer_end.

   HOSTILE  Every byte may be wrong. Values nest up to 64 deep, and there are up to 2^24 of them. */

#ifndef OLAT_JSON_H
#define OLAT_JSON_H

#include "files.h"
#include <math.h>

enum { OLAT__MAX_DEPTH = 64, OLAT__MAX_NODES = 1 << 24, OLAT__MAX_STRING = 1 << 20 };

/* ==== reading ==== */

typedef enum olat__type {
    OLAT__NULL,
    OLAT__FALSE,
    OLAT__TRUE,
    OLAT__NUMBER,
    OLAT__STRING,
    OLAT__ARRAY,
    OLAT__OBJECT
} olat__type;

typedef struct olat__node {
    const char *key,
        *text; /* key of a member, value of a string; decoded in place, NUL appended; NULL if none */
    double number;
    size_t key_length, text_length;
    olat__type type;
    int line, parent, child, next, index,
        size; /* child: the first; next: the sibling; 0 = none, since node 0 is the root */
} olat__node;

typedef struct olat__json {
    char *path, *error, *text, *at, *end;
    olat__node *nodes;
    int count, capacity, line, where,
        failed; /* where: the node being parsed; failed: error holds a message, the first one */
} olat__json;

/* Records the first failure: file, line, keys from the root to the node, message. Returns 0, which callers
   pass on. */
OLAT__PRINTF(3, 4)
static int olat__json_fail(olat__json *j, const olat__node *node, const char *format, ...) {
    char keys[160] = "";
    int depth = 0;
    if (j->failed) return 0;
    va_list list;
    va_start(list, format);
    char what[240];
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    const olat__node *chain[OLAT__MAX_DEPTH + 1];
    for (const olat__node *n = node; n->parent >= 0; n = &j->nodes[n->parent]) chain[depth++] = n;
    while (depth-- > 0) {
        const olat__node *n = chain[depth];
        if (j->nodes[n->parent].type == OLAT__OBJECT)
            olat__append(keys, sizeof keys, "%s%.60s", *keys ? "." : "", n->key);
        else olat__append(keys, sizeof keys, "[%d]", n->index);
    }
    j->failed = olat__fail(j->error, "%s: line %d: %s%s%s", olat__tail(j->path), node->line, keys,
                           *keys ? ": " : "", what);
    return 0;
}

static int olat__is_digit(char c) { return c >= '0' && c <= '9'; }

/* Reads the JSON number at text; returns its length, 0 if there is none. strtod is given whole digits and an
   exponent, which read the same in every locale, and today's C libraries round them correctly. 767 digits
   decide every double: of those beyond 780 it matters only whether one is not zero. */
static size_t olat__parse_number(const char *text, double *value) {
    enum { KEPT = 780 };
    const char *p = text + (*text == '-');
    int kept = 0, sticky = 0, point = 0;
    int64_t exponent = 0, written = 0;
    if (!olat__is_digit(*p) || (*p == '0' && olat__is_digit(p[1]))) return 0;
    char digits[KEPT + 32];
    for (; olat__is_digit(*p) || (*p == '.' && !point && olat__is_digit(p[1])); p++) {
        if (*p == '.') point = 1;
        else if (kept < KEPT) {
            if (kept || *p != '0') digits[kept++] = *p;
            exponent -= point;
        } else {
            sticky |= *p != '0';
            exponent += !point;
        }
    }
    if (*p == '.') return 0;
    if (*p == 'e' || *p == 'E') {
        const int negative = p[1] == '-';
        p += p[1] == '-' || p[1] == '+' ? 2 : 1;
        if (!olat__is_digit(*p)) return 0;
        for (; olat__is_digit(*p); p++)
            written = written < 1000000000000 ? 10 * written + (*p - '0') : written;
        exponent += negative ? -written : written;
    }
    exponent = exponent > 99999 ? 99999 : exponent < -99999 ? -99999 : exponent;
    if (kept == 0) digits[kept++] = '0';
    snprintf(digits + kept, sizeof digits - (size_t)kept, "%se%d", sticky ? "1" : "", (int)exponent - sticky);
    *value = strtod(digits, NULL);
    if (*text == '-') *value = -*value;
    return (size_t)(p - text);
}

/* Reads an argument of a program; 0 unless all of it is a number below 1e30. */
OLAT__API int olat_argument(const char *text, double *value) {
    const size_t used = olat__parse_number(text, value);
    return used && !text[used] && fabs(*value) < 1e30;
}

/* Length of the UTF-8 sequence at p, 0 if it is malformed. A NUL ends every text, so nothing beyond it is
   read. */
static int olat__utf8_length(const char *p) {
    unsigned c = (unsigned char)p[0], code;
    int i, n = c < 0x80 ? 1 : c < 0xC2 ? 0 : c < 0xE0 ? 2 : c < 0xF0 ? 3 : c < 0xF5 ? 4 : 0;
    for (i = 1, code = c & (0xFFu >> (n + 1)); i < n; i++) {
        if (((unsigned char)p[i] & 0xC0) != 0x80) return 0;
        code = code << 6 | ((unsigned char)p[i] & 0x3F);
    }
    if (n == 3 && (code < 0x800 || (code >= 0xD800 && code <= 0xDFFF))) return 0;
    return n == 4 && (code < 0x10000 || code > 0x10FFFF) ? 0 : n;
}

/* The value of "\uXXXX" at p, 0xFFFFFFFF if there is none. */
static uint32_t olat__hex_escape(const char *p) {
    uint32_t code = 0;
    if (p[0] != '\\' || p[1] != 'u') return 0xFFFFFFFFu;
    for (int i = 2; i < 6; i++) {
        char letter = (char)(p[i] | 32);
        if (!olat__is_digit(p[i]) && (letter < 'a' || letter > 'f')) return 0xFFFFFFFFu;
        code = code << 4 | (uint32_t)(olat__is_digit(p[i]) ? p[i] - '0' : letter - 'a' + 10);
    }
    return code;
}

/* Decodes the escape at p, surrogate pairs included; returns its length, 0 if it is malformed. */
static int olat__escape(const char *p, uint32_t *code) {
    static const char names[] = "\"\\/bfnrt", values[] = "\"\\/\b\f\n\r\t";
    const char *name = p[1] ? strchr(names, p[1]) : NULL;
    *code = name ? (uint32_t)values[name - names] : olat__hex_escape(p);
    if (name) return 2;
    if (*code < 0xD800 || (*code > 0xDFFF && *code <= 0xFFFF)) return 6;
    uint32_t low;
    if (*code > 0xDBFF || (low = olat__hex_escape(p + 6)) < 0xDC00 || low > 0xDFFF) return 0;
    *code = 0x10000 + ((*code - 0xD800) << 10) + (low - 0xDC00);
    return 12;
}

/* Decodes the string at j->at in place: no escape is shorter than what it stands for. */
static const char *olat__json_string(olat__json *j, const char **text, size_t *length) {
    char *start = ++j->at, *out = start;
    while (*j->at != '"') {
        uint32_t code = 0;
        int n = *j->at == '\\' ? olat__escape(j->at, &code) : olat__utf8_length(j->at);
        if (j->at == j->end) return "the file ends inside a string";
        if ((unsigned char)*j->at < 32) return "a control character inside a string";
        if (n == 0) return *j->at == '\\' ? "a bad escape inside a string" : "a string is not UTF-8";
        if (out - start > OLAT__MAX_STRING) return "a string is longer than 2^20 bytes";
        if (*j->at != '\\') {
            for (; n > 0; n--) *out++ = *j->at++;
            continue;
        }
        j->at += n;
        n = code < 0x80 ? 0 : code < 0x800 ? 1 : code < 0x10000 ? 2 : 3; /* bytes after the first */
        *out++ = (char)(unsigned char)(n ? (0xF80u >> n & 0xFF) | code >> 6 * n : code);
        while (n-- > 0) *out++ = (char)(unsigned char)(0x80 | (code >> 6 * n & 0x3F));
    }
    j->at++;
    *out = 0;
    *text = start;
    *length = (size_t)(out - start);
    return NULL;
}

static const char *olat__json_scalar(olat__json *j, olat__node *node) {
    static const char *const words[] = {"null", "false", "true"};
    const char *letters = j->at + (*j->at == '-');
    node->type = OLAT__STRING;
    if (*j->at == '"') return olat__json_string(j, &node->text, &node->text_length);
    for (size_t i = 0; i < 3; i++) {
        if (strncmp(j->at, words[i], strlen(words[i])) != 0) continue;
        node->type = (olat__type)i;
        j->at += strlen(words[i]);
        return NULL;
    }
    node->type = OLAT__NUMBER;
    size_t length;
    if ((length = olat__parse_number(j->at, &node->number)) > 0) {
        j->at += length;
        uint64_t bits;
        memcpy(&bits, &node->number, sizeof bits); /* -ffast-math takes infinity for impossible */
        return (bits >> 52 & 0x7ff) == 0x7ff ? "the number is too large" : NULL;
    }
    if (olat__same_letters(letters, "nan", 3) || olat__same_letters(letters, "inf", 3)) {
        return "NaN and Infinity are not JSON: whatever wrote this file computed a number that is not finite";
    }
    return j->at == j->end ? "the file ends early" : "a value was expected";
}

static void olat__skip_space(olat__json *j) {
    for (; *j->at == ' ' || *j->at == '\t' || *j->at == '\n' || *j->at == '\r'; j->at++)
        j->line += *j->at == '\n';
}

/* Appends a node to the container, after its child `last` (0: none yet); returns its index, -1 when no more
   fit. */
static int olat__json_add(olat__json *j, int container, int last) {
    if (j->count == j->capacity) {
        int capacity = j->capacity ? 2 * j->capacity : 256;
        olat__node *node = capacity > OLAT__MAX_NODES
                               ? NULL
                               : (olat__node *)realloc(j->nodes, (size_t)capacity * sizeof *node);
        if (!node) return -1;
        j->nodes = node;
        j->capacity = capacity;
    }
    olat__node *node = &j->nodes[j->count];
    memset(node, 0, sizeof *node);
    node->parent = container;
    if (container >= 0) node->index = j->nodes[container].size++;
    if (last) j->nodes[last].next = j->count;
    else if (container >= 0) j->nodes[container].child = j->count;
    return j->count++;
}

/* Parses everything into j->nodes; returns NULL or what is wrong at j->where. */
static const char *olat__json_values(olat__json *j) {
    int last[OLAT__MAX_DEPTH + 1] = {0}, depth = 0,
                               container = -1; /* last: the newest child of every open container */
    for (;;) {                                 /* a value each time */
        int is_member = container >= 0 && j->nodes[container].type == OLAT__OBJECT;
        if (is_member && *j->at != '"') return "a key was expected";
        const int self = olat__json_add(j, container, last[depth]);
        if (self < 0) return "out of memory, or more than 2^24 values";
        last[depth] = self;
        olat__node *node = &j->nodes[self];
        const char *problem;
        if (is_member) {
            j->where = container;
            if ((problem = olat__json_string(j, &node->key, &node->key_length)) != NULL) return problem;
            olat__skip_space(j);
            if (*j->at != ':') return "':' was expected";
            j->at++;
            olat__skip_space(j);
        }
        j->where = self;
        node->line = j->line;
        if (*j->at == '[' || *j->at == '{') {
            node->type = *j->at == '[' ? OLAT__ARRAY : OLAT__OBJECT;
            if (depth == OLAT__MAX_DEPTH) return "more than 64 levels";
            last[++depth] = 0;
            container = self;
            j->at++;
            olat__skip_space(j);
            if (*j->at != (node->type == OLAT__ARRAY ? ']' : '}')) continue;
        } else if ((problem = olat__json_scalar(j, node)) != NULL) return problem;
        for (;; j->at++) { /* then closing brackets, up to a comma or the end */
            olat__skip_space(j);
            if (depth == 0) return j->at == j->end ? NULL : "text after the end of the value";
            if (*j->at == ',') break;
            if (j->at == j->end) return "the file ends early";
            if (*j->at != (j->nodes[container].type == OLAT__ARRAY ? ']' : '}'))
                return "a comma or closing bracket was expected";
            j->where = container;
            container = j->nodes[container].parent;
            depth--;
        }
        j->at++;
        olat__skip_space(j);
    }
}

/* Parses j->text .. j->end, NUL-terminated; j->failed tells. */
OLAT__API void olat__json_parse(olat__json *j) {
    const unsigned char *text = (const unsigned char *)j->text;
    j->line = 1;
    j->at = j->text +
            (strncmp(j->text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0); /* some editors write a byte order mark */
    olat__skip_space(j);
    const char *problem;
    if (j->end - j->text > 1 &&
        (text[0] + text[1] == 0xFF + 0xFE || !text[0] != !text[1])) { /* a mark, or a letter */
        problem = "the file is UTF-16: save it as UTF-8";
    } else if ((problem = olat__json_values(j)) == NULL) return;
    if (!j->nodes) j->failed = olat__fail(j->error, "%s: %s", olat__tail(j->path), problem);
    else {
        j->nodes[j->where].line = j->line;
        olat__json_fail(j, &j->nodes[j->where], "%s", problem);
    }
}

/* ---- members: after a failure they return 0 and go on, since only the first one is reported ---- */

/* The member `key`: the last one where there are several, as for Python's json. */
static const olat__node *olat__find(const olat__json *j, const olat__node *object, const char *key) {
    const olat__node *found = NULL, *node;
    size_t length = strlen(key);
    for (int i = object->child; i; i = node->next) {
        node = &j->nodes[i];
        if (node->key_length == length && !memcmp(node->key, key, length)) found = node;
    }
    return found;
}

/* Reads an array of count numbers; a single one may stand without brackets. Their limit keeps float
   arithmetic finite. */
static int olat__numbers(olat__json *j, const olat__node *node, int count, double *out) {
    const olat__node *n = node->type == OLAT__ARRAY && node->child ? &j->nodes[node->child] : node;
    if (node->type == OLAT__ARRAY ? node->size != count : count != 1) {
        return olat__json_fail(j, node, "%d number%s expected", count,
                               count == 1 ? " was" : "s in an array were");
    }
    for (int i = 0; i < count; i++, n = &j->nodes[n->next]) {
        if (n->type != OLAT__NUMBER) return olat__json_fail(j, n, "a number was expected");
        if (fabs(n->number) > 1e15) return olat__json_fail(j, n, "the number is out of range");
        out[i] = n->number;
    }
    return 1;
}

/* The same for the member `key`; 0 if it is absent. */
OLAT__API int olat__get(olat__json *j, const olat__node *object, const char *key, int count, double *out) {
    const olat__node *node = olat__find(j, object, key);
    return node && olat__numbers(j, node, count, out);
}

/* Is the string that word, given in small letters? */
OLAT__API int olat__is_word(const olat__node *node, const char *word) {
    return node->text_length == strlen(word) && olat__same_letters(node->text, word, node->text_length);
}

/* Is there anything in it but 0, false, null and empty texts? */
OLAT__API int olat__nonzero(const olat__json *j, const olat__node *node) {
    int found = node->type == OLAT__TRUE || node->text_length > 0 || fabs(node->number) > 0;
    for (int i = node->child; i && !found; i = j->nodes[i].next) found = olat__nonzero(j, &j->nodes[i]);
    return found;
}

OLAT__API void olat__json_close(olat__json *j) {
    free(j->nodes);
    free(j->text);
    free(j->path);
}

/* ==== writing ==== */

/* A text file that grows in memory; text is NULL once out of it. */
typedef struct olat__writer {
    char *text;
    size_t size, room;
} olat__writer;

OLAT__API void olat__writer_start(olat__writer *w) {
    w->size = 0;
    w->room = 256;
    w->text = (char *)malloc(w->room);
}

static void olat__write(olat__writer *w, const char *text) {
    const size_t size = strlen(text);
    if (w->text && w->room - w->size < size) {
        char *grown = (char *)realloc(w->text, w->room = 2 * (w->room + size));
        if (!grown) free(w->text);
        w->text = grown;
    }
    if (!w->text) return;
    memcpy(w->text + w->size, text, size);
    w->size += size;
}

/* Puts the text where it belongs, and frees it. */
OLAT__API int olat__writer_end(olat__writer *w, const char *path, char *error) {
    const int failed = w->text ? olat__write_file(path, (const unsigned char *)w->text, w->size, error)
                               : olat__fail(error, "%s: out of memory", olat__tail(path));
    free(w->text);
    return failed;
}

/* A JSON string, with its quotes. */
OLAT__API void olat__write_string(olat__writer *w, const char *text) {
    olat__write(w, "\"");
    char escape[8];
    for (; *text; text++) {
        if ((unsigned char)*text < 32) snprintf(escape, sizeof escape, "\\u%04x", (unsigned)*text);
        else snprintf(escape, sizeof escape, "%s%c", *text == '"' || *text == '\\' ? "\\" : "", *text);
        olat__write(w, escape);
    }
    olat__write(w, "\"");
}

/* The numbers, with so many digits and a point in every locale, between two texts. */
OLAT__API void olat__write_numbers(olat__writer *w, const char *before, const double *v, int count,
                                   int digits, const char *after) {
    olat__write(w, before);
    for (int i = 0; i < count; i++) {
        char text[64];
        snprintf(text, sizeof text, "%s%.*g", i ? ", " : "", digits, v[i]);
        for (int k = i ? 2 : 0; text[k]; k++) {
            if (!strchr("+-.0123456789einfa", text[k])) text[k] = '.';
        }
        olat__write(w, text);
    }
    olat__write(w, after);
}

#endif /* OLAT_JSON_H */
