/* Locust looming neuron (LGMD) after Fu et al. (AIAI 2019) for frames of ${width} x ${height} px at ${fps} Hz.
 *
 * Written by lgmd-gym ${version}. C99 without allocation; all state is in `lgmd_state`. By default the maps are
 * float. Define LGMD_FIXED for 16-bit integer maps: then only some scalars per frame are floating point.
 *
 *     static lgmd_state neuron;
 *     lgmd_init(&neuron);
 *     for (;;) if (lgmd_step(&neuron, frame).alert) brake();
 */
#ifndef LGMD_H
#define LGMD_H

#include <math.h>
#include <stdint.h>

#define LGMD_HEIGHT ${height} /* [px] */
#define LGMD_WIDTH ${width}   /* [px] */
#define LGMD_FPS ${fps}       /* frame rate on which the filter gains below depend [Hz] */

/* Parameters; the comments have the names in lgmd-gym. */
#define LGMD_N_P ${n_p}                         /* n_p: persistent frames in P */
#define LGMD_PERSISTENCE { ${persistence} }     /* a_i of n_p and u */
#define LGMD_GAIN_F ${gain_f}                   /* tau_1 */
#define LGMD_WARM_START ${warm_start}           /* warm_start */
#define LGMD_GAIN_DELAY { ${gain_delay} }       /* tau_2: centre, nearest, diagonal */
#define LGMD_TWO_TAP ${two_tap}                 /* delay */
#define LGMD_WEIGHTS { ${weights} }             /* weights: centre, nearest, diagonal */
#define LGMD_RESIDUE ${on_off_residue}          /* on_off_residue */
#define LGMD_HAS_RESIDUE ${has_residue}
#define LGMD_THETA_ON ${theta_1}                /* theta_1 */
#define LGMD_THETA_OFF ${theta_2}               /* theta_2 */
#define LGMD_THETA_PRODUCT ${theta_3}           /* theta_3 */
#define LGMD_DELTA_C ${delta_c}                 /* delta_c */
#define LGMD_C_W ${c_w}                         /* c_w */
#define LGMD_T_G ${t_g}                         /* t_de / c_de */
#define LGMD_T_F ${t_f}                         /* t_f [grey levels] */
#define LGMD_SIGMA_1 ${sigma_1}                 /* sigma_1 */
#define LGMD_SIGMA_2 ${sigma_2}                 /* sigma_2 */
#define LGMD_LATENCY_JUMPS ${latency_jumps}     /* latency */
#define LGMD_TAU_G ${tau_g}                     /* tau_g [ms] */
#define LGMD_DT ${dt}                           /* frame interval [ms] */
#define LGMD_T_FFI ${t_ffi}                     /* t_ffi [grey levels] */
#define LGMD_SIGMA_3 ${sigma_3}                 /* sigma_3 */
#define LGMD_K_0 ${k_0}                         /* k_0 */
#define LGMD_KEEP ${keep}                       /* tau_s */
#define LGMD_T_SFA ${t_sfa}                     /* t_sfa */
#define LGMD_SIGMA_4 ${sigma_4}                 /* sigma_4 */
#define LGMD_T_SP ${t_sp}                       /* t_sp */
#define LGMD_SPIKES_FROM_K ${from_k}            /* spikes_from */
#define LGMD_WINDOW ${window}                   /* n_ts and extra_frame: terms of the sum [frames] */
#define LGMD_RATE ${rate}                       /* factor from spikes in the window to the frequency [Hz] */
#define LGMD_T_SF ${t_sf}                       /* t_sf [spikes/s] */

#ifdef LGMD_FIXED
#if ${has_residue} || ${two_tap} || LGMD_N_P > 2
#error "LGMD_FIXED requires on_off_residue = 0, delay = recursive and n_p <= 2"
#elif ${theta_on_fixed} > 131071u || ${theta_off_fixed} > 131071u
#error "LGMD_FIXED requires smaller theta_1 and theta_2"
#endif
#define LGMD_FRACTION ${fraction}                     /* fraction bits of P */
#define LGMD_PERSISTENCE_FIXED { ${persistence_fixed} } /* in 1 / 32768 */
#define LGMD_GAIN_DELAY_FIXED { ${gain_delay_fixed} }   /* in 1 / 32768 */
#define LGMD_THETA_ON_FIXED ${theta_on_fixed}
#define LGMD_THETA_OFF_FIXED ${theta_off_fixed}
#endif

/* Outputs of a frame. */
typedef struct {
    double spike_frequency;    /* [spikes/s] */
    int32_t spikes;            /* of this frame */
    double membrane_potential; /* K */
    double adapted_potential;  /* K after adaptation */
    double ffi;                /* feed-forward inhibition F [grey levels] */
    double inhibition_weight;  /* w */
    int alert;                 /* whether spike_frequency >= LGMD_T_SF */
} lgmd_output;

/* State of a neuron; its fields are private to lgmd.c. */
typedef struct {
    uint32_t age; /* number of frames so far, at most 2: the first two are special */
    double f, g_mean, k, k_hat;
    int32_t spikes[LGMD_WINDOW];
    int32_t slot;
#ifdef LGMD_FIXED
    int16_t p[LGMD_HEIGHT][LGMD_WIDTH];         /* P of the last frame */
    int16_t before[LGMD_HEIGHT][LGMD_WIDTH];    /* a_2 P of the frame before it, minus the luminance */
    uint8_t delayed[LGMD_HEIGHT][LGMD_WIDTH][9]; /* delayed E: 3 rings x (ON, OFF), 12 bits each */
    uint16_t s[3][LGMD_WIDTH];                  /* three rows of S */
    uint32_t best[LGMD_HEIGHT];                 /* largest S * Ce of each row */
#else
    uint8_t luminance[LGMD_HEIGHT][LGMD_WIDTH];
    float p[LGMD_N_P > 0 ? LGMD_N_P : 1][LGMD_HEIGHT][LGMD_WIDTH]; /* newest first */
    float delayed[2][3][LGMD_HEIGHT][LGMD_WIDTH];
    float s[LGMD_HEIGHT][LGMD_WIDTH];
#if LGMD_HAS_RESIDUE
    float e[2][LGMD_HEIGHT][LGMD_WIDTH];
#endif
#endif
} lgmd_state;

/* Set a state to that before the first frame. */
void lgmd_init(lgmd_state *state);

/* Process the next frame: LGMD_HEIGHT rows of LGMD_WIDTH grey levels, 0 black to 255 white, top row first. */
lgmd_output lgmd_step(lgmd_state *state, const uint8_t *frame);

#endif
