/* Read grey frames from stdin as Y4M or as PGM pictures one after the other, and print the neuron's outputs.
 *
 *     cc -std=c99 -O2 -o lgmd main.c lgmd.c -lm
 *     ffmpeg -i clip.mp4 -vf fps=30,scale=99:72 -pix_fmt gray -f yuv4mpegpipe - | ./lgmd
 *
 * `./lgmd --info` prints the size of the frames and of the state. */
#include "lgmd.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static lgmd_state neuron;
static uint8_t frame[LGMD_HEIGHT * LGMD_WIDTH];

static void fail(const char *message)
{
    fprintf(stderr, "lgmd: %s\n", message);
    exit(2);
}

static void check_size(long width, long height)
{
    if (width == LGMD_WIDTH && height == LGMD_HEIGHT) return;
    fprintf(stderr, "lgmd: frames must be %d x %d px, got %ld x %ld; use ffmpeg -vf scale=%d:%d\n", LGMD_WIDTH,
        LGMD_HEIGHT, width, height, LGMD_WIDTH, LGMD_HEIGHT);
    exit(2);
}

static void read_pixels(void)
{
    if (fread(frame, 1, sizeof frame, stdin) != sizeof frame) fail("the last frame is incomplete");
}

static void step(void)
{
    static long number = 0;
    lgmd_output output = lgmd_step(&neuron, frame);
    printf("%ld,%.4f,%.9g,%ld,%.9g,%.9g,%.9g,%.9g,%d\n", number, number / (double)LGMD_FPS, output.spike_frequency,
        (long)output.spikes, output.membrane_potential, output.adapted_potential, output.ffi,
        output.inhibition_weight, output.alert);
    fflush(stdout); /* for a live camera */
    number++;
}

/* Read a line without its end; return 0 at the end of the stream. */
static int read_line(char *line, int size)
{
    int length = 0, c = getchar();
    if (c == EOF) return 0;
    for (; c != EOF && c != '\n'; c = getchar())
        if (length < size - 1) line[length++] = (char)c;
    line[length] = '\0';
    return 1;
}

/* Return the bytes of both chroma planes of a frame; `format` is the C tag, such as 420jpeg or mono. */
static long chroma_bytes(const char *format)
{
    long half_width = (LGMD_WIDTH + 1) / 2, half_height = (LGMD_HEIGHT + 1) / 2;
    if (strncmp(format, "mono", 4) == 0) return 0;
    if (strncmp(format, "444", 3) == 0) return 2L * LGMD_WIDTH * LGMD_HEIGHT;
    if (strncmp(format, "422", 3) == 0) return 2 * half_width * LGMD_HEIGHT;
    if (strncmp(format, "411", 3) == 0) return 2L * ((LGMD_WIDTH + 3) / 4) * LGMD_HEIGHT;
    if (strncmp(format, "420", 3) == 0) return 2 * half_width * half_height;
    fail("the Y4M colour format must be mono, 420, 422, 444 or 411; use ffmpeg -pix_fmt gray");
    return 0;
}

static void read_y4m(void)
{
    char line[512], format[32] = "420";
    long width = 0, height = 0, numerator = 0, denominator = 1;
    int limited = 0;
    read_line(line, sizeof line);
    for (char *tag = strtok(line, " "); tag != NULL; tag = strtok(NULL, " ")) {
        if (tag[0] == 'W') width = strtol(tag + 1, NULL, 10);
        if (tag[0] == 'H') height = strtol(tag + 1, NULL, 10);
        if (tag[0] == 'F') sscanf(tag + 1, "%ld:%ld", &numerator, &denominator);
        if (tag[0] == 'C') sscanf(tag + 1, "%31s", format);
        if (strcmp(tag, "XCOLORRANGE=LIMITED") == 0) limited = 1;
    }
    check_size(width, height);
    if (strstr(format, "p1") != NULL || strncmp(format, "mono1", 5) == 0) fail("pixels must have 8 bits");
    if (denominator > 0 && fabs(numerator / (double)denominator - LGMD_FPS) > 0.01 * LGMD_FPS)
        fprintf(stderr, "lgmd: the frame rate is %ld:%ld Hz, but the neuron is made for %g Hz\n", numerator,
            denominator, (double)LGMD_FPS);
    long skipped = chroma_bytes(format);
    while (read_line(line, sizeof line)) {
        if (strncmp(line, "FRAME", 5) != 0) fail("FRAME is missing before a frame");
        read_pixels();
        for (size_t i = 0; limited && i < sizeof frame; i++) {
            long value = ((frame[i] - 16) * 255L + 109) / 219;
            frame[i] = (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
        }
        for (long i = 0; i < skipped; i++) getchar();
        step();
    }
}

/* Return the next number of a PGM header, behind spaces and comments. */
static long read_number(void)
{
    int c = getchar();
    while (c == '#' || c == ' ' || c == '\t' || c == '\r' || c == '\n') {
        while (c == '#' && c != '\n' && c != EOF)
            do c = getchar();
            while (c != '\n' && c != EOF);
        c = getchar();
    }
    long value = 0;
    if (c < '0' || c > '9') fail("a PGM header must have width, height and maximum");
    for (; c >= '0' && c <= '9' && value < 100000; c = getchar()) value = 10 * value + c - '0';
    return value;
}

static void read_pgm(void)
{
    do {
        if (getchar() != 'P' || getchar() != '5') fail("stdin must be Y4M, or PGM pictures that begin with P5");
        long width = read_number(), height = read_number();
        check_size(width, height);
        if (read_number() != 255) fail("the maximum of a PGM picture must be 255");
        read_pixels();
        step();
        int c = getchar();
        while (c == '\n') c = getchar();
        ungetc(c, stdin);
    } while (!feof(stdin));
}

int main(int count, char **arguments)
{
    if (count > 1 && strcmp(arguments[1], "--info") == 0) {
        printf("%d x %d px, %g Hz, %ld bytes of state, ", LGMD_WIDTH, LGMD_HEIGHT, (double)LGMD_FPS,
            (long)sizeof neuron);
#ifdef LGMD_FIXED
        printf("fixed point\n");
#else
        printf("float\n");
#endif
        return 0;
    }
    if (count > 1) fail("the only argument is --info; frames come from stdin");
    lgmd_init(&neuron);
    int first = getchar();
    if (first == EOF) fail("stdin is empty; send Y4M or PGM");
    ungetc(first, stdin);
    printf("frame,time_s,spike_frequency,spikes,membrane_potential,adapted_potential,ffi,inhibition_weight,alert\n");
    if (first == 'Y') read_y4m();
    else read_pgm();
    return 0;
}
