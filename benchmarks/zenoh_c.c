/* The messages of a lock-step tick by zenoh-pico, Zenoh's own implementation in C.
 *
 *   tick world ENDPOINT ROBOTS BYTES TICKS   sends each robot a state of so many bytes, waits for
 *                                            all commands, and prints the ns that each tick took
 *   tick robot ENDPOINT ROBOT BYTES          answers each state, where it arrives, with a command
 *
 * The world listens, robots connect to it; all sessions are peers, nothing is batched, and who
 * sends waits rather than drop. A robot ends once its standard input does. No message is decoded.
 */

#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "zenoh-pico.h"

enum { MOST_ROBOTS = 16, WARM_UP = 1000, PATIENCE_S = 20, ROUND_S = 1 };

static pthread_mutex_t guard = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t complete = PTHREAD_COND_INITIALIZER;
static int missing; /* commands that the world still awaits */

struct answer {
    z_owned_publisher_t publisher;
    uint8_t *payload;
    size_t size;
};

static void fail(const char *what) {
    fprintf(stderr, "tick: %s\n", what);
    exit(1);
}

static long long now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1000000000LL * now.tv_sec + now.tv_nsec;
}

/* As the processes of a team: round robin in real time, if that is permitted. */
static void take_priority(void) {
    struct sched_param first = {.sched_priority = 1};
    if (sched_setscheduler(0, SCHED_RR, &first) != 0) fprintf(stderr, "tick: an ordinary process\n");
}

/* Who is connected to may still be starting. */
static void open_session(z_owned_session_t *session, uint8_t role, const char *endpoint) {
    long long deadline = now_ns() + 1000000000LL * PATIENCE_S;
    for (;;) {
        z_owned_config_t config;
        z_config_default(&config);
        zp_config_insert(z_loan_mut(config), Z_CONFIG_MODE_KEY, "peer");
        zp_config_insert(z_loan_mut(config), role, endpoint);
        if (z_open(session, z_move(config), NULL) >= 0) return;
        if (now_ns() > deadline) fail("no session");
        z_sleep_ms(20);
    }
}

static void declare(const z_loaned_session_t *session, z_owned_publisher_t *publisher,
                    const char *key) {
    z_view_keyexpr_t name;
    z_publisher_options_t options;
    z_publisher_options_default(&options);
    options.congestion_control = Z_CONGESTION_CONTROL_BLOCK;
    options.is_express = true;
    if (z_view_keyexpr_from_str(&name, key) < 0) fail("no such key");
    if (z_declare_publisher(session, publisher, z_loan(name), &options) < 0) fail("no publisher");
}

static void subscribe(const z_loaned_session_t *session, const char *key,
                      void (*take)(z_loaned_sample_t *, void *), void *context) {
    z_view_keyexpr_t name;
    z_owned_closure_sample_t closure;
    if (z_view_keyexpr_from_str(&name, key) < 0) fail("no such key");
    z_closure(&closure, take, NULL, context);
    if (z_declare_background_subscriber(session, z_loan(name), z_move(closure), NULL) < 0)
        fail("no subscriber");
}

static void put(const z_owned_publisher_t *publisher, uint8_t *payload, size_t size) {
    z_owned_bytes_t bytes;
    z_bytes_from_static_buf(&bytes, payload, size);
    if (z_publisher_put(z_loan(*publisher), z_move(bytes), NULL) < 0) fail("nothing was sent");
}

static void on_command(z_loaned_sample_t *sample, void *context) {
    (void)sample;
    (void)context;
    pthread_mutex_lock(&guard);
    if (--missing == 0) pthread_cond_signal(&complete);
    pthread_mutex_unlock(&guard);
}

static void on_state(z_loaned_sample_t *sample, void *context) {
    struct answer *answer = context;
    (void)sample;
    put(&answer->publisher, answer->payload, answer->size);
}

/* One tick; 0 if within ROUND_S seconds not all robots have answered. */
static int walk(z_owned_publisher_t *states, int robots, uint8_t *payload, size_t size) {
    struct timespec until;
    int come = 1;
    pthread_mutex_lock(&guard);
    missing = robots;
    pthread_mutex_unlock(&guard);
    for (int i = 0; i < robots; i++) put(&states[i], payload, size);
    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_sec += ROUND_S;
    pthread_mutex_lock(&guard);
    while (missing > 0 && come) come = pthread_cond_timedwait(&complete, &guard, &until) == 0;
    pthread_mutex_unlock(&guard);
    return come;
}

static void be_world(const char *endpoint, int robots, size_t size, int ticks) {
    z_owned_session_t session;
    z_owned_publisher_t states[MOST_ROBOTS];
    uint8_t *payload = calloc(1, size);
    long long *took = calloc(ticks, sizeof *took);
    open_session(&session, Z_CONFIG_LISTEN_KEY, endpoint);
    subscribe(z_loan(session), "team/*/command", on_command, NULL);
    for (int i = 0; i < robots; i++) {
        char key[32];
        snprintf(key, sizeof key, "team/r%d/state", i + 1);
        declare(z_loan(session), &states[i], key);
    }
    long long deadline = now_ns() + 1000000000LL * PATIENCE_S;
    while (!walk(states, robots, payload, size))
        if (now_ns() > deadline) fail("the robots do not answer");
    z_sleep_ms(1000); /* answers to the first states of all, of which some may come late */
    for (int k = -WARM_UP; k < ticks; k++) {
        long long begun = now_ns();
        if (!walk(states, robots, payload, size)) fail("a robot no longer answers");
        if (k >= 0) took[k] = now_ns() - begun;
    }
    for (int k = 0; k < ticks; k++) printf("%lld\n", took[k]);
    for (int i = 0; i < robots; i++) z_drop(z_move(states[i]));
    z_drop(z_move(session));
    free(took);
    free(payload);
}

static void be_robot(const char *endpoint, const char *robot, size_t size) {
    z_owned_session_t session;
    struct answer answer = {.payload = calloc(1, size), .size = size};
    char command[32], state[32];
    snprintf(command, sizeof command, "team/%s/command", robot);
    snprintf(state, sizeof state, "team/%s/state", robot);
    open_session(&session, Z_CONFIG_CONNECT_KEY, endpoint);
    declare(z_loan(session), &answer.publisher, command);
    subscribe(z_loan(session), state, on_state, &answer);
    while (getchar() != EOF) continue;
    z_drop(z_move(answer.publisher));
    z_drop(z_move(session));
    free(answer.payload);
}

int main(int count, char **words) {
    if (count < 5) fail("world ENDPOINT ROBOTS BYTES TICKS, or robot ENDPOINT ROBOT BYTES");
    take_priority();
    if (strcmp(words[1], "robot") == 0) {
        be_robot(words[2], words[3], (size_t)atol(words[4]));
    } else {
        int robots = atoi(words[3]);
        if (count < 6 || robots < 1 || robots > MOST_ROBOTS) fail("too many robots, or too few");
        be_world(words[2], robots, (size_t)atol(words[4]), atoi(words[5]));
    }
    return 0;
}
