/* The equations are those of lgmd-gym, whose page "Neuron" explains them; the numbers are those of the paper.
 *
 * The latency filter of G has one gain for all pixels, so the filtered mean of g replaces a map of G. */
#include "lgmd.h"

#include <string.h>

void lgmd_init(lgmd_state *state)
{
    memset(state, 0, sizeof *state);
    state->k = state->k_hat = LGMD_K_0;
}

/* Return a row or column next to one, replicated at the border. */
static int lower(int i) { return i > 0 ? i - 1 : 0; }
static int upper(int i, int size) { return i < size - 1 ? i + 1 : i; }

#ifdef LGMD_FIXED
typedef int32_t level;
#else
typedef float level;
#endif

/* E of a pixel on a path, 0 ON or 1 OFF (eq. 3). */
static level excitation(const lgmd_state *state, int path, int y, int x)
{
#if defined LGMD_FIXED
    level p = path == 0 ? state->p[y][x] : -state->p[y][x];
    return p > 0 ? p : 0;
#elif LGMD_HAS_RESIDUE
    return state->e[path][y][x];
#else
    level p = path == 0 ? state->p[0][y][x] : -state->p[0][y][x];
    return p > 0.0f ? p : 0.0f;
#endif
}

/* E of a pixel and the sum of those above and below it, ON and OFF. */
typedef struct { level own[2], sides[2]; } column;

static column column_at(const lgmd_state *state, int y, int x)
{
    column result;
    for (int path = 0; path < 2; path++) {
        result.own[path] = excitation(state, path, y, x);
        result.sides[path] = excitation(state, path, lower(y), x)
            + excitation(state, path, upper(y, LGMD_HEIGHT), x);
    }
    return result;
}

#ifdef LGMD_FIXED

/* P has LGMD_FRACTION fraction bits. S has 5, so that S * Ce * 9 fits into 32 bits with S <= S_MAX. */
enum { ONE = 1 << LGMD_FRACTION, S_ONE = 32, S_MAX = 21845, WEIGHT_ONE = 1024, WEIGHT_MAX = 21845 };

static const int32_t taps[2] = LGMD_PERSISTENCE_FIXED;
static const int32_t gains[3] = LGMD_GAIN_DELAY_FIXED;
static const double weights[3] = LGMD_WEIGHTS;

/* Return value * factor / 2^15, rounded; the offset avoids a shift of negative numbers. */
static int32_t scaled(int32_t value, int32_t factor)
{
    return (int32_t)(((uint32_t)(value * factor) + 0x80004000u) >> 15) - 65536;
}

/* A delayed value has 12 bits: whole numbers up to 1023, then 10 significant bits and an exponent. */
static uint32_t encode(int32_t value)
{
    uint32_t shift = 1, v = (uint32_t)value;
    if (value < 1024) return value < 0 ? 0 : v;
    if (value > 65471) return 4095;
    while ((v >> shift) > 1023) shift++;
    return (shift << 9) + ((v + (1u << (shift - 1))) >> shift); /* a carry gives the next exponent */
}

static int32_t decode(uint32_t code)
{
    uint32_t shift = code >> 9;
    return (int32_t)(shift < 2 ? code : (512u + (code & 511u)) << (shift - 1));
}

/* Compute P (eq. 1) and return the sum of |P| in grey levels. */
static double photoreceptors(lgmd_state *state, const uint8_t *frame)
{
    uint64_t total = 0;
    for (int y = 0; y < LGMD_HEIGHT; y++) {
        uint32_t row = 0;
        for (int x = 0; x < LGMD_WIDTH; x++) {
            int32_t light = *frame++ * ONE, old = state->p[y][x];
            int32_t p = light + state->before[y][x] + scaled(old, taps[0]);
            state->before[y][x] = (int16_t)(scaled(old, taps[1]) - light);
            state->p[y][x] = (int16_t)p;
            row += (uint32_t)(p < 0 ? -p : p);
        }
        total += row;
    }
    return (double)total / ONE;
}

/* Store the first frame, which has no predecessor. */
static void start(lgmd_state *state, const uint8_t *frame)
{
    for (int y = 0; y < LGMD_HEIGHT; y++)
        for (int x = 0; x < LGMD_WIDTH; x++) state->before[y][x] = (int16_t)(-*frame++ * ONE);
}

/* Return the delayed E of the ON and the OFF path in three bytes. */
static int32_t delayed_on(const uint8_t *code) { return decode(code[0] | (uint32_t)(code[1] & 15) << 8); }
static int32_t delayed_off(const uint8_t *code) { return decode(code[1] >> 4 | (uint32_t)code[2] << 4); }

/* Delay the mean E of a ring of neighbours on both paths (eq. 4). */
static void delay_ring(uint8_t *code, int32_t on, int32_t off, int32_t gain)
{
    int32_t old_on = delayed_on(code), old_off = delayed_off(code);
    uint32_t new_on = encode(old_on + scaled(on - old_on, gain));
    uint32_t new_off = encode(old_off + scaled(off - old_off, gain));
    code[0] = (uint8_t)(new_on & 255);
    code[1] = (uint8_t)(new_on >> 8 | (new_off & 15) << 4);
    code[2] = (uint8_t)(new_off >> 4);
}

/* Delay E of a row; each ring of neighbours is averaged first, then delayed. */
static void delay_row(lgmd_state *state, int y)
{
    int warm = LGMD_WARM_START && state->age == 1;
    int32_t gain[3];
    for (int i = 0; i < 3; i++) gain[i] = warm ? 32768 : gains[i];
    column left = column_at(state, y, 0), here = left;
    for (int x = 0; x < LGMD_WIDTH; x++) {
        column right = x < LGMD_WIDTH - 1 ? column_at(state, y, x + 1) : here;
        uint8_t *code = state->delayed[y][x];
        int32_t near[2], far[2];
        for (int path = 0; path < 2; path++) {
            near[path] = (here.sides[path] + left.own[path] + right.own[path] + 2) / 4;
            far[path] = (left.sides[path] + right.sides[path] + 2) / 4;
        }
        delay_ring(code, here.own[0], here.own[1], gain[0]);
        delay_ring(code + 3, near[0], near[1], gain[1]);
        delay_ring(code + 6, far[0], far[1], gain[2]);
        left = here;
        here = right;
    }
}

/* Compute S of a row (eq. 7 and 8); the other path and the product of the paths are 0. */
static void sum_row(lgmd_state *state, int y, const uint32_t weight[3])
{
    uint16_t *s = state->s[y % 3];
    for (int x = 0; x < LGMD_WIDTH; x++) {
        const uint8_t *code = state->delayed[y][x];
        int32_t p = state->p[y][x], excitation = p < 0 ? -p : p;
        uint32_t inhibition = 0;
        for (int i = 0; i < 3; i++, code += 3)
            inhibition += weight[i] * (uint32_t)(p < 0 ? delayed_off(code) : delayed_on(code));
        inhibition /= WEIGHT_ONE;
        if (inhibition >= (uint32_t)excitation) {
            s[x] = 0;
        } else {
            uint32_t theta = p < 0 ? LGMD_THETA_OFF_FIXED : LGMD_THETA_ON_FIXED;
            uint32_t sum = (((uint32_t)excitation - inhibition) * theta + 2048) / 4096;
            s[x] = (uint16_t)(sum > S_MAX ? S_MAX : sum);
        }
    }
}

/* Update the largest 9 Ce and S * 9 Ce of a row, and return the sum of the products at or above `least`. */
static uint64_t group_row(const lgmd_state *state, int y, uint32_t least, uint32_t *sum_max, uint32_t *product_max)
{
    const uint16_t *above = state->s[lower(y) % 3], *row = state->s[y % 3];
    const uint16_t *below = state->s[upper(y, LGMD_HEIGHT) % 3];
    uint64_t total = 0;
    uint32_t here = (uint32_t)above[0] + row[0] + below[0], left = here;
    for (int x = 0; x < LGMD_WIDTH; x++) {
        int r = upper(x, LGMD_WIDTH);
        uint32_t right = (uint32_t)above[r] + row[r] + below[r], sum = left + here + right;
        uint32_t product = row[x] * sum;
        if (sum > *sum_max) *sum_max = sum;
        if (product > *product_max) *product_max = product;
        if (product >= least) total += product;
        left = here;
        here = right;
    }
    return total;
}

/* Return the mean of g. S is computed twice, because a map of it would exceed the memory of small robots. */
static double excite(lgmd_state *state, double w)
{
    uint32_t weight[3], largest = 0;
    for (int i = 0; i < 3; i++) {
        double scaled_weight = w * weights[i] * (i > 0 ? 4 : 1) * WEIGHT_ONE + 0.5; /* of means of 4 pixels */
        weight[i] = scaled_weight < WEIGHT_MAX ? (uint32_t)scaled_weight : WEIGHT_MAX;
    }
    for (int y = 0; y <= LGMD_HEIGHT; y++) {
        if (y < LGMD_HEIGHT) {
            delay_row(state, y);
            sum_row(state, y, weight);
            state->best[y] = 0;
        }
        if (y > 0) group_row(state, y - 1, 0, &largest, &state->best[y - 1]);
    }
    double omega = LGMD_DELTA_C + largest / (9.0 * S_ONE) / LGMD_C_W, unit = 9.0 * S_ONE * S_ONE * omega;
    double threshold = ceil(LGMD_T_G * unit);
    if (threshold > 4294967295.0) return 0.0;
    uint32_t least = (uint32_t)threshold;
    uint64_t total = 0;
    int last = -1; /* last row of S that is present */
    for (int y = 0; y < LGMD_HEIGHT; y++) {
        if (state->best[y] == 0 || state->best[y] < least) continue;
        for (int row = last >= lower(y) ? last + 1 : lower(y); row <= upper(y, LGMD_HEIGHT); row++)
            sum_row(state, row, weight);
        last = upper(y, LGMD_HEIGHT);
        total += group_row(state, y, least, &largest, &state->best[y]);
    }
    return (double)total / unit / ((double)LGMD_HEIGHT * LGMD_WIDTH);
}

#else

static const double persistence[] = LGMD_PERSISTENCE;
static const float gains[3] = LGMD_GAIN_DELAY;
static const float weights[3] = LGMD_WEIGHTS;

/* Compute P (eq. 1) and return the sum of |P|. */
static double photoreceptors(lgmd_state *state, const uint8_t *frame)
{
    double total = 0.0;
    for (int y = 0; y < LGMD_HEIGHT; y++) {
        for (int x = 0; x < LGMD_WIDTH; x++, frame++) {
            double p = (double)*frame - state->luminance[y][x];
            for (int i = 0; i < LGMD_N_P; i++) p += persistence[i] * state->p[i][y][x];
            for (int i = LGMD_N_P - 1; i > 0; i--) state->p[i][y][x] = state->p[i - 1][y][x];
            state->p[0][y][x] = (float)p;
            state->luminance[y][x] = *frame;
            total += fabs(p);
        }
    }
    return total;
}

/* Store the first frame, which has no predecessor. */
static void start(lgmd_state *state, const uint8_t *frame)
{
    memcpy(state->luminance, frame, sizeof state->luminance);
}

#if LGMD_HAS_RESIDUE
static void keep_residue(lgmd_state *state)
{
    for (int y = 0; y < LGMD_HEIGHT; y++) {
        for (int x = 0; x < LGMD_WIDTH; x++) {
            float p = state->p[0][y][x];
            state->e[0][y][x] = (p > 0.0f ? p : 0.0f) + (float)LGMD_RESIDUE * state->e[0][y][x];
            state->e[1][y][x] = (p < 0.0f ? -p : 0.0f) + (float)LGMD_RESIDUE * state->e[1][y][x];
        }
    }
}
#endif

/* Return what remains of E of a path (eq. 4 to 7), given the sums over the rings of neighbours. */
static float remaining(lgmd_state *state, int path, int y, int x, const float now[3], float w)
{
    int warm = LGMD_WARM_START && state->age == 1;
    float inhibition = 0.0f;
    for (int ring = 0; ring < 3; ring++) {
        float *memory = &state->delayed[path][ring][y][x];
        float value = *memory + (warm ? 1.0f : gains[ring]) * (now[ring] - *memory);
        *memory = LGMD_TWO_TAP ? now[ring] : value;
        inhibition += weights[ring] * value;
    }
    float rest = now[0] - w * inhibition;
    return rest > 0.0f ? rest : 0.0f;
}

/* Compute S of a row (eq. 8); each ring of neighbours is summed first, then delayed. */
static void sum_row(lgmd_state *state, int y, float w)
{
    column left = column_at(state, y, 0), here = left;
    for (int x = 0; x < LGMD_WIDTH; x++) {
        column right = x < LGMD_WIDTH - 1 ? column_at(state, y, x + 1) : here;
        float rest[2];
        for (int path = 0; path < 2; path++) {
            const float now[3] = { here.own[path], here.sides[path] + left.own[path] + right.own[path],
                left.sides[path] + right.sides[path] };
            rest[path] = remaining(state, path, y, x, now, w);
        }
        state->s[y][x] = (float)LGMD_THETA_ON * rest[0] + (float)LGMD_THETA_OFF * rest[1]
            + (float)LGMD_THETA_PRODUCT * rest[0] * rest[1];
        left = here;
        here = right;
    }
}

/* Return Ce of a pixel. */
static float local_mean(const lgmd_state *state, int y, int x)
{
    int rows[3] = { lower(y), y, upper(y, LGMD_HEIGHT) }, columns[3] = { lower(x), x, upper(x, LGMD_WIDTH) };
    float total = 0.0f;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) total += state->s[rows[i]][columns[j]];
    return total / 9.0f;
}

/* Return the mean of g. */
static double excite(lgmd_state *state, double w)
{
    float largest = 0.0f;
    double total = 0.0;
#if LGMD_HAS_RESIDUE
    keep_residue(state);
#endif
    for (int y = 0; y < LGMD_HEIGHT; y++) sum_row(state, y, (float)w);
    for (int y = 0; y < LGMD_HEIGHT; y++)
        for (int x = 0; x < LGMD_WIDTH; x++) largest = fmaxf(largest, local_mean(state, y, x));
    double omega = LGMD_DELTA_C + largest / LGMD_C_W;
    for (int y = 0; y < LGMD_HEIGHT; y++) {
        for (int x = 0; x < LGMD_WIDTH; x++) {
            if (state->s[y][x] == 0.0f) continue;
            float g = (float)(state->s[y][x] * local_mean(state, y, x) / omega);
            if (g >= LGMD_T_G) total += g;
        }
    }
    return total / ((double)LGMD_HEIGHT * LGMD_WIDTH);
}

#endif

/* Return the gain of the latency filter of G (eq. 9). */
static double latency_gain(double f)
{
    double fraction = 1.0 - f / LGMD_T_F;
    int limited = LGMD_LATENCY_JUMPS ? fraction < 0.0 : fraction < LGMD_SIGMA_2;
    return LGMD_DT / (LGMD_DT + LGMD_TAU_G * (limited ? LGMD_SIGMA_2 : fraction));
}

/* Update K, its adaptation and the spikes (eq. 10 to 12). */
static void fire(lgmd_state *state)
{
    double k = 1.0 / (1.0 + exp(-state->g_mean / LGMD_SIGMA_3));
    if (state->f >= LGMD_T_FFI) k = 0.5;
    double rise = k - state->k;
    double adapted = LGMD_KEEP * (rise <= LGMD_T_SFA ? state->k_hat + rise : k);
    state->k = k;
    state->k_hat = adapted > 0.5 ? adapted : 0.5;
    double potential = LGMD_SPIKES_FROM_K ? state->k : state->k_hat;
    state->slot = (state->slot + 1) % LGMD_WINDOW;
    state->spikes[state->slot] = (int32_t)floor(exp(LGMD_SIGMA_4 * (potential - LGMD_T_SP)));
}

lgmd_output lgmd_step(lgmd_state *state, const uint8_t *frame)
{
    double w = LGMD_SIGMA_1;
    if (state->age == 0) {
        start(state, frame);
        state->age = 1;
    } else {
        double f = photoreceptors(state, frame) / ((double)LGMD_HEIGHT * LGMD_WIDTH);
        int warm = LGMD_WARM_START && state->age == 1;
        state->f = warm ? f : state->f + LGMD_GAIN_F * (f - state->f); /* eq. 2 */
        if (state->f / LGMD_T_F > w) w = state->f / LGMD_T_F;          /* eq. 9 */
        state->g_mean += latency_gain(state->f) * (excite(state, w) - state->g_mean);
        fire(state);
        state->age = 2;
    }
    int32_t count = 0;
    for (int i = 0; i < LGMD_WINDOW; i++) count += state->spikes[i];
    lgmd_output output = { count * LGMD_RATE, state->spikes[state->slot], state->k, state->k_hat, state->f, w, 0 };
    output.alert = output.spike_frequency >= LGMD_T_SF;
    return output;
}
