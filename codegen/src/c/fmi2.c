/* @PREFIX@ as a unit for model exchange by version 2.0 of the Functional Mock-up Interface (fmi-standard.org). Only the
 * declarations of the standard that this file needs are written here.
 *
 * Value references: continuous states (q, then p), their derivatives, inputs and parameters in the order of the struct of
 * inputs, velocities, kinetic and potential energy. */
#include "@PREFIX@.h"

#include <stddef.h>
#include <string.h>

#if defined(_WIN32)
#define FMI2_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI2_EXPORT __attribute__((visibility("default")))
#else
#define FMI2_EXPORT
#endif

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    fmi2Boolean newDiscreteStatesNeeded;
    fmi2Boolean terminateSimulation;
    fmi2Boolean nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged;
    fmi2Boolean nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

enum { NQ = @NQ@, NV = @NV@, STATES = NQ + NV, INPUTS = @INPUTS@ };

/* First value references. */
enum { RATES = STATES, GIVEN = 2 * STATES, VELOCITIES = GIVEN + INPUTS, ENERGY = VELOCITIES + NV, VALUES = ENERGY + 2 };

/* One more entry than there are, because C has no arrays without entries. */
typedef struct {
    double state[STATES + 1];
    double given[INPUTS + 1];
    fmi2CallbackFunctions callbacks;
} instance;

static void reset(instance *unit)
{
    static const double state[STATES + 1] = { @STATE@ };
    static const double given[INPUTS + 1] = { @GIVEN@ };
    memcpy(unit->state, state, sizeof state);
    memcpy(unit->given, given, sizeof given);
}

/* The members of the struct are arrays of doubles only. */
static @PREFIX@_inputs inputs(const instance *unit)
{
    @PREFIX@_inputs in;
    @PREFIX@_inputs_init(&in);
    if (INPUTS > 0) {
        memcpy(&in, unit->given, (size_t)INPUTS * sizeof(double));
    }
    return in;
}

static void rates(const instance *unit, double *out)
{
    const @PREFIX@_inputs in = inputs(unit);
    @PREFIX@_rates(&in, unit->state, unit->state + NQ, out, out + NQ);
}

/* All values in the order of their references. */
static void values(const instance *unit, double *out)
{
    const @PREFIX@_inputs in = inputs(unit);
    memcpy(out, unit->state, (size_t)STATES * sizeof *out);
    memcpy(out + GIVEN, unit->given, (size_t)INPUTS * sizeof *out);
    rates(unit, out + RATES);
    @PREFIX@_velocities(&in, unit->state, unit->state + NQ, out + VELOCITIES);
    @PREFIX@_energy(&in, unit->state, unit->state + NQ, out + ENERGY);
}

/* A trial state may be one in which the mechanism has no rates: the importing tool is to take a shorter step. */
static fmi2Status of_finite(const double *x, size_t n)
{
    for (size_t k = 0; k < n; k++) {
        if (!(x[k] - x[k] == 0.0)) {
            return fmi2Discard;
        }
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2String fmi2GetTypesPlatform(void)
{
    return "default";
}

FMI2_EXPORT fmi2String fmi2GetVersion(void)
{
    return "2.0";
}

FMI2_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)c;
    (void)on;
    (void)n;
    (void)categories;
    return fmi2OK;
}

FMI2_EXPORT fmi2Component fmi2Instantiate(
    fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources, const fmi2CallbackFunctions *callbacks,
    fmi2Boolean visible, fmi2Boolean logging)
{
    instance *unit = NULL;
    (void)resources;
    (void)visible;
    (void)logging;
    if (callbacks == NULL || callbacks->allocateMemory == NULL || callbacks->freeMemory == NULL) {
        return NULL;
    }
    if (type != fmi2ModelExchange || guid == NULL || strcmp(guid, "@GUID@") != 0) {
        if (callbacks->logger != NULL) {
            callbacks->logger(
                callbacks->componentEnvironment, name, fmi2Error, "error",
                "this unit is for model exchange, and its GUID is that of its modelDescription.xml");
        }
        return NULL;
    }
    unit = callbacks->allocateMemory(1, sizeof *unit);
    if (unit != NULL) {
        unit->callbacks = *callbacks;
        reset(unit);
    }
    return unit;
}

FMI2_EXPORT void fmi2FreeInstance(fmi2Component c)
{
    instance *unit = c;
    if (unit != NULL) {
        unit->callbacks.freeMemory(unit);
    }
}

FMI2_EXPORT fmi2Status fmi2SetupExperiment(
    fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start, fmi2Boolean stop_defined,
    fmi2Real stop)
{
    (void)c;
    (void)tolerance_defined;
    (void)tolerance;
    (void)start;
    (void)stop_defined;
    (void)stop;
    return fmi2OK;
}

/* Calls that change the mode: there is nothing to do, because the unit has no events. */
#define NOTHING_TO_DO(name) \
    FMI2_EXPORT fmi2Status name(fmi2Component c) \
    { \
        (void)c; \
        return fmi2OK; \
    }
NOTHING_TO_DO(fmi2EnterInitializationMode)
NOTHING_TO_DO(fmi2ExitInitializationMode)
NOTHING_TO_DO(fmi2Terminate)
NOTHING_TO_DO(fmi2EnterEventMode)
NOTHING_TO_DO(fmi2EnterContinuousTimeMode)

FMI2_EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    reset(c);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference of[], size_t n, fmi2Real out[])
{
    double all[VALUES];
    values(c, all);
    for (size_t k = 0; k < n; k++) {
        if (of[k] >= VALUES) {
            return fmi2Error;
        }
        out[k] = all[of[k]];
    }
    return of_finite(out, n);
}

/* Rates, velocities and energies cannot be set. */
FMI2_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference of[], size_t n, const fmi2Real in[])
{
    instance *unit = c;
    for (size_t k = 0; k < n; k++) {
        if (of[k] < STATES) {
            unit->state[of[k]] = in[k];
        } else if (of[k] >= GIVEN && of[k] < VELOCITIES) {
            unit->given[of[k] - GIVEN] = in[k];
        } else {
            return fmi2Error;
        }
    }
    return fmi2OK;
}

/* There are variables of type Real only. */
#define NO_VARIABLES(name, type) \
    FMI2_EXPORT fmi2Status fmi2Get##name(fmi2Component c, const fmi2ValueReference of[], size_t n, type out[]) \
    { \
        (void)c; \
        (void)of; \
        (void)out; \
        return n == 0 ? fmi2OK : fmi2Error; \
    } \
    FMI2_EXPORT fmi2Status fmi2Set##name(fmi2Component c, const fmi2ValueReference of[], size_t n, const type in[]) \
    { \
        (void)c; \
        (void)of; \
        (void)in; \
        return n == 0 ? fmi2OK : fmi2Error; \
    }
NO_VARIABLES(Integer, fmi2Integer)
NO_VARIABLES(Boolean, fmi2Boolean)
NO_VARIABLES(String, fmi2String)

/* What modelDescription.xml says that the unit cannot do. */
FMI2_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    (void)state;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    (void)c;
    (void)state;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    (void)state;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c;
    (void)state;
    (void)size;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    (void)c;
    (void)state;
    (void)bytes;
    (void)size;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2DeSerializeFMUstate(
    fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    (void)c;
    (void)bytes;
    (void)size;
    (void)state;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns, const fmi2ValueReference known[], size_t knowns,
    const fmi2Real along[], fmi2Real out[])
{
    (void)c;
    (void)unknown;
    (void)unknowns;
    (void)known;
    (void)knowns;
    (void)along;
    (void)out;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    (void)c;
    memset(info, 0, sizeof *info);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2CompletedIntegratorStep(
    fmi2Component c, fmi2Boolean keep, fmi2Boolean *enter_event_mode, fmi2Boolean *terminate)
{
    (void)c;
    (void)keep;
    *enter_event_mode = 0;
    *terminate = 0;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    (void)c;
    (void)time;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n)
{
    instance *unit = c;
    if (n != STATES) {
        return fmi2Error;
    }
    memcpy(unit->state, x, n * sizeof *x);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
    const instance *unit = c;
    if (n != STATES) {
        return fmi2Error;
    }
    memcpy(x, unit->state, n * sizeof *x);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real out[], size_t n)
{
    if (n != STATES) {
        return fmi2Error;
    }
    rates(c, out);
    return of_finite(out, n);
}

FMI2_EXPORT fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real out[], size_t n)
{
    (void)c;
    (void)out;
    return n == 0 ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real out[], size_t n)
{
    (void)c;
    for (size_t k = 0; k < n; k++) {
        out[k] = 1.0;
    }
    return n == STATES ? fmi2OK : fmi2Error;
}
