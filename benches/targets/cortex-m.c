/* Instructions of one evaluation of the rates of the UR5 on an emulated Cortex-M: cortex-m.sh compiles this file with the
 * C of `mbd generate`, and gives NUMBER (float or double) and CLOCK_INSTRUCTIONS, those in a tick of the counter. */
#include "robot.h"

#include <stdint.h>

enum { STATES = 64, ROUNDS = 16 };

typedef NUMBER vector[ROBOT_NV];

/* One call to the emulator. */
static void semihosting(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

static void end(int good)
{
    for (;;) {
        semihosting(0x18U, (const void *)(good ? 0x20026 : 0x20024));
    }
}

static void print(uint32_t value)
{
    char text[12];
    char *at = &text[sizeof text - 1U];
    *at = '\0';
    *--at = '\n';
    do {
        *--at = (char)('0' + value % 10U);
        value /= 10U;
    } while (value != 0U);
    semihosting(0x04U, at);
}

/* A random number between -size and size. */
static NUMBER number(uint32_t *seed, NUMBER size)
{
    *seed = *seed * 1664525U + 1013904223U;
    return size * ((NUMBER)(*seed >> 8) / (NUMBER)(1U << 23) - (NUMBER)1);
}

/* Instructions of STATES * ROUNDS turns of a loop, with a call in each of them or without. */
static uint32_t count(const robot_inputs *in, vector *q, vector *p, int called)
{
    /* The system timer counts down 24 bits at processor clock. */
    volatile uint32_t *const timer = (volatile uint32_t *)0xE000E010;
    vector qd;
    vector pd;
    timer[1] = 0xFFFFFFU;
    timer[2] = 0U;
    timer[0] = 5U;
    for (int round = 0; round < ROUNDS; round++) {
        for (int k = 0; k < STATES; k++) {
            const NUMBER *at = q[k];
            __asm__ volatile("" : "+r"(at) : : "memory");
            if (called) {
                robot_rates(in, at, p[k], qd, pd);
            }
            __asm__ volatile("" : : "r"(qd), "r"(pd) : "memory");
        }
    }
    const uint32_t ticks = 0xFFFFFFU - timer[2];
    if ((timer[0] & (1U << 16)) != 0U) {
        end(0);
    }
    return ticks * CLOCK_INSTRUCTIONS;
}

void run(void)
{
    robot_inputs in;
    vector q[STATES];
    vector p[STATES];
    uint32_t seed = 1U;
    robot_inputs_init(&in);
    for (int i = 0; i < ROBOT_NV; i++) {
        in.tau[i] = number(&seed, 5);
    }
    for (int k = 0; k < STATES; k++) {
        for (int i = 0; i < ROBOT_NV; i++) {
            q[k][i] = number(&seed, 3);
            p[k][i] = number(&seed, 1);
        }
    }
    const uint32_t empty = count(&in, q, p, 0);
    print((count(&in, q, p, 1) - empty) / (STATES * ROUNDS));
    end(1);
}

/* The reset handler: access to the floating-point unit before anything uses it. */
__attribute__((naked)) void reset(void)
{
    __asm__ volatile(
        "ldr r0, =0xE000ED88\n"
        "ldr r1, [r0]\n"
        "orr r1, r1, #0x00F00000\n"
        "str r1, [r0]\n"
        "dsb\n"
        "isb\n"
        "b run\n"
        ".ltorg\n");
}

static void fault(void)
{
    end(0);
}

extern const uint32_t _stack_top;

/* Top of the stack, then handlers. */
__attribute__((used, section(".vector_table"))) static const void *const vector_table[16] = {
    &_stack_top, (const void *)reset, (const void *)fault, (const void *)fault, (const void *)fault,
    (const void *)fault, (const void *)fault, (const void *)fault, (const void *)fault, (const void *)fault,
    (const void *)fault, (const void *)fault, (const void *)fault, (const void *)fault, (const void *)fault,
    (const void *)fault,
};
