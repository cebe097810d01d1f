/* Learns what boards of 2048 are worth: the tables of `dmplay/problems/game_2048/ntuple_network.npz`.

   Games are played by the slide that promises most, and then gone through from their end: a board
   that a slide left is worth the points that came after it (TD(lambda) of boards after slides;
   Szubert and Jaskowski, 2014). A number that is moved to and fro is moved less (temporal coherence
   learning; Beal and Smith, 1999). Most games begin in the middle of the one before, so that the
   ends of games are seen often (Matsuzaki, 2021). At first all stages of a game have the tables in
   common, then each goes on with its own (Jaskowski, 2018). Boards with the largest tiles count as
   like ones with smaller tiles (Guei, Chen and Wu, 2021), as in `expectimax_2048.halved`. Threads
   share the tables and take no locks.

       cc -O3 -march=native -o learn_2048 learn_2048.c -lpthread -lm
       ./learn_2048 TABLES COMMON SECONDS THREADS

   learns for SECONDS, the first COMMON of these in common, tells how it goes, and writes TABLES
   every minute: for each pattern and stage a 32-bit number for each way to fill the pattern.

   The tables that are kept learned from 3,050 million slides, in two hours of two cores, by what this
   program grew from: 390 million in common and 850 million in two stages, without and with a tile of
   8192, nearly each game begun in the middle of the one before and large tiles taken as they are;
   then 1,810 million as here. */

#include <immintrin.h>
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

typedef uint64_t Board; /* four bits a cell, as in `dmplay/tiles.py` */

enum { PATTERNS = 8, STAGES = 4, WAYS = 1 << 20, FACING = 8, LONGEST = 400000, LARGE = 14, SMALL = 5 };
static const double P_TWO = 0.8, LAMBDA = 0.5, AGAIN = 0.7, FRESH = 0.02;
static const Board ONES = 0x1111111111111111, FIRST_ROW = 0xFFFF;
static const char *PICTURES[PATTERNS] = { /* those of `worth_2048.PATTERNS` */
    "xxxxx", "xxxx.x", "....xxxxx", "....xxxx.x", "xxx.xx", ".xx.xxx", "....xxx.xx", ".....xxx.xx"};

static Board mask[PATTERNS];
static float *number[PATTERNS];             /* [STAGES][WAYS] points */
static struct { float sum, size; } *moved[PATTERNS]; /* the same, of all that they were moved by */
static uint16_t to_first[65536], to_last[65536]; /* what a slide makes of each line, */
static float pays[65536];                        /* and what it pays */
static volatile int staged, over;
static __thread uint64_t dice[2];

static struct Seen { volatile long slides, games; volatile double points; } seen[64]; /* a thread's */

static uint64_t drawn(void) { /* xoroshiro128+ (Blackman and Vigna) */
    uint64_t a = dice[0], b = dice[1], found = a + b;
    b ^= a;
    dice[0] = (a << 24 | a >> 40) ^ b ^ b << 16;
    dice[1] = b << 37 | b >> 27;
    return found;
}

static double uniform(void) { return (drawn() >> 11) * 0x1p-53; }

static int cell(Board b, int at) { return b >> 4 * at & 15; }

static Board transposed(Board b) {
    Board differ = (b ^ b >> 12) & 0x0000F0F00000F0F0;
    b ^= differ ^ differ << 12;
    differ = (b ^ b >> 24) & 0x00000000FF00FF00;
    return b ^ differ ^ differ << 24;
}

static Board mirrored(Board b) {
    return (b & 0x000F000F000F000F) << 12 | (b & 0x00F000F000F000F0) << 4 |
           (b >> 4 & 0x00F000F000F000F0) | (b >> 12 & 0x000F000F000F000F);
}

static Board flipped(Board b) {
    return b << 48 | (b & FIRST_ROW << 16) << 16 | (b >> 16 & FIRST_ROW << 16) | b >> 48;
}

static Board empty(Board b) { /* the lowest bit of each cell that is */
    b |= b >> 2;
    return ~(b | b >> 1) & ONES;
}

static void make_lines(void) {
    for (int line = 0; line < 65536; line++) {
        int filled = 0, last = 0, slid[4] = {0};
        for (int at = 0; at < 4; at++) {
            int tile = line >> 4 * at & 15;
            if (tile && tile == last) {
                slid[filled - 1] = tile < 15 ? tile + 1 : 15;
                pays[line] += 2 << tile;
                last = 0;
            } else if (tile)
                slid[filled++] = last = tile;
        }
        for (int at = 0; at < 4; at++) to_first[line] |= slid[at] << 4 * at;
    }
    for (int line = 0; line < 65536; line++)
        to_last[line] = mirrored(to_first[mirrored(line) & FIRST_ROW]) & FIRST_ROW;
}

static Board slid(Board b, const uint16_t *line, float *pay) {
    Board after = 0;
    *pay = 0;
    for (int row = 0; row < 64; row += 16) {
        after |= (Board)line[b >> row & FIRST_ROW] << row;
        *pay += pays[b >> row & FIRST_ROW];
    }
    return after;
}

static void slides(Board b, Board after[4], float pay[4]) {
    Board columns = transposed(b);
    after[0] = slid(b, to_first, pay);
    after[1] = slid(b, to_last, pay + 1);
    after[2] = transposed(slid(columns, to_first, pay + 2));
    after[3] = transposed(slid(columns, to_last, pay + 3));
}

static Board tiled(Board b) {
    Board bare = empty(b), at = _pdep_u64(1ull << drawn() % _mm_popcnt_u64(bare), bare);
    return b | at << (uniform() >= P_TWO);
}

static Board halved(Board b) { /* as `expectimax_2048.halved` */
    for (;;) {
        int has = 0, gap = LARGE;
        for (int at = 0; at < 16; at++) has |= 1 << cell(b, at);
        if (has < 1 << LARGE) return b;
        if (has >> (LARGE + 1)) gap = LARGE + 1;
        for (gap--; has >> gap & 1; gap--) {}
        if (gap <= SMALL) return b;
        for (int at = 0; at < 16; at++)
            if (cell(b, at) > gap) b -= 1ull << 4 * at;
    }
}

static int stage(Board b) { /* as `worth_2048._stage` */
    if (!staged) return 0;
    int large = (b >> 3 & b >> 2 & (b | b >> 1) & ONES) != 0;
    return 2 * large + (empty(b ^ 12 * ONES) != 0);
}

static float worth(Board b, uint32_t index[PATTERNS][FACING]) {
    Board facing[FACING] = {b, mirrored(b), flipped(b), flipped(mirrored(b))};
    for (int k = 0; k < 4; k++) facing[4 + k] = transposed(facing[k]);
    uint32_t first = (uint32_t)stage(b) * WAYS;
    float found = 0;
    for (int i = 0; i < PATTERNS; i++)
        for (int k = 0; k < FACING; k++) {
            index[i][k] = first + _pext_u64(facing[k], mask[i]);
            found += number[i][index[i][k]];
        }
    return found;
}

static void learn(Board b, float target) {
    uint32_t index[PATTERNS][FACING];
    float by = (target - worth(b, index)) / (PATTERNS * FACING);
    for (int i = 0; i < PATTERNS; i++)
        for (int k = 0; k < FACING; k++) {
            uint32_t at = index[i][k];
            float sum = moved[i][at].sum, size = moved[i][at].size;
            number[i][at] += size > 0 ? by * fabsf(sum) / size : by;
            moved[i][at].sum = sum + by;
            moved[i][at].size = size + fabsf(by);
        }
}

static void *play(void *given) {
    struct Seen *mine = given;
    static __thread Board before[LONGEST], after[LONGEST];
    static __thread float pay[LONGEST];
    uint32_t index[PATTERNS][FACING];
    Board start = 0;
    dice[0] = 0x9E3779B97F4A7C15 * (mine - seen + 1), dice[1] = 0xD1B54A32D192ED03;
    while (!over) {
        Board b = start ? start : tiled(tiled(0));
        double points = 0;
        int turns = 0;
        for (; turns < LONGEST; turns++) {
            Board way[4];
            float pays_now[4], best = -INFINITY;
            int a = -1;
            slides(b, way, pays_now);
            for (int k = 0; k < 4; k++) {
                if (way[k] == b) continue;
                float value = pays_now[k] + worth(way[k], index);
                if (value > best) best = value, a = k;
            }
            if (a < 0) break;
            before[turns] = b, after[turns] = way[a], pay[turns] = pays_now[a];
            points += pays_now[a];
            b = halved(tiled(way[a]));
        }
        float target = 0;
        for (int turn = turns - 1; turn >= 0; turn--) {
            learn(after[turn], target);
            target = pay[turn] + LAMBDA * target + (1 - LAMBDA) * worth(after[turn], index);
        }
        if (!start) mine->games++, mine->points += points;
        mine->slides += turns;
        start = turns > 20 && uniform() < AGAIN ? before[turns / 2] : 0;
    }
    return 0;
}

static void part(void) { /* each stage goes on with what all have learned, and soon learns more */
    for (int i = 0; i < PATTERNS; i++) {
        for (int at = 0; at < WAYS; at++) moved[i][at].sum *= FRESH, moved[i][at].size *= FRESH;
        for (int k = 1; k < STAGES; k++) {
            memcpy(number[i] + k * WAYS, number[i], WAYS * sizeof *number[i]);
            memcpy(moved[i] + k * WAYS, moved[i], WAYS * sizeof *moved[i]);
        }
    }
    staged = 1;
}

static void write_tables(const char *path) {
    FILE *file = fopen(path, "wb");
    if (!file) perror(path), exit(1);
    for (int i = 0; i < PATTERNS; i++) fwrite(number[i], sizeof *number[i], STAGES * WAYS, file);
    if (fclose(file)) perror(path), exit(1);
}

static void *room(size_t bytes) {
    void *found = mmap(0, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    madvise(found, bytes, MADV_HUGEPAGE);
    return found;
}

int main(int count, char **given) {
    if (count != 5) return fprintf(stderr, "%s TABLES COMMON SECONDS THREADS\n", given[0]), 2;
    int common = atoi(given[2]), seconds = atoi(given[3]), threads = atoi(given[4]);
    make_lines();
    for (int i = 0; i < PATTERNS; i++) {
        for (int at = 0; PICTURES[i][at]; at++)
            if (PICTURES[i][at] == 'x') mask[i] |= 15ull << 4 * at;
        number[i] = room(STAGES * WAYS * sizeof *number[i]);
        moved[i] = room(STAGES * WAYS * sizeof *moved[i]);
    }
    pthread_t thread[64];
    for (int k = 0; k < threads; k++) pthread_create(&thread[k], 0, play, &seen[k]);
    long told = 0;
    double points = 0;
    for (int second = 1; second <= seconds; second++) {
        sleep(1);
        if (second == common) part();
        if (second % 60 && second < seconds) continue;
        long slides = 0, games = 0;
        double all = 0;
        for (int k = 0; k < threads; k++)
            slides += seen[k].slides, games += seen[k].games, all += seen[k].points;
        printf("%d s: %.1f million slides, %ld games, the last %ld with %.0f points\n", second,
               slides / 1e6, games, games - told, (all - points) / fmax(games - told, 1));
        fflush(stdout);
        told = games, points = all;
        write_tables(given[1]);
    }
    over = 1;
    for (int k = 0; k < threads; k++) pthread_join(thread[k], 0);
    write_tables(given[1]);
}
