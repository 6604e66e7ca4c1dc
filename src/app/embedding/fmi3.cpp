// The functions of FMI 3.0 (fmi3Functions.h), for the units that `nocdyn fmu` writes: those of co-simulation, and that all others
// exist, as the standard asks for.
#include <string>

#include "fmu.hpp"

using namespace nocdyn_fmu;

namespace {

// fmi3LogMessageCallback
using LogMessage = void (*)(void *environment, int status, const char *category, const char *message);

Fmu::Log log_to(LogMessage write, void *environment) {
    return [=](Status status, const char *category, const std::string &message) {
        if (write) write(environment, status, category, message.c_str());
    };
}

void *other_interface(LogMessage write, void *environment) {
    log_to(write, environment)(error, "logStatusError", "this FMU is for co-simulation, not for model exchange or scheduled execution");
    return nullptr;
}

void check_sizes(std::size_t count, std::size_t values) {
    if (count != values) throw Refusal(std::to_string(count) + " variables with " + std::to_string(values) + " values");
}

}   // namespace

extern "C" {

const char *fmi3GetVersion() { return "3.0"; }

void *fmi3InstantiateCoSimulation(const char *, const char *token, const char *resources, bool, bool logs, bool has_event_mode, bool,
                                  const unsigned *, std::size_t, void *environment, LogMessage write, void *) {
    const auto log = log_to(write, environment);
    try {
        if (has_event_mode) throw Refusal("this FMU has no event mode: it handles events within its steps");
        return new Fmu(resources ? resources : "", token ? token : "", log, logs);
    } catch (const std::exception &failure) {
        log(error, "logStatusError", failure.what());
        return nullptr;
    }
}
void *fmi3InstantiateModelExchange(const char *, const char *, const char *, bool, bool, void *environment, LogMessage write) {
    return other_interface(write, environment);
}
void *fmi3InstantiateScheduledExecution(const char *, const char *, const char *, bool, bool, void *environment, LogMessage write) {
    return other_interface(write, environment);
}

void fmi3FreeInstance(void *unit) { delete static_cast<Fmu *>(unit); }

int fmi3SetDebugLogging(void *unit, bool logs, std::size_t, const char *const *) {
    return guarded(unit, [&](Fmu &fmu) { fmu.is_logging = logs; });
}

int fmi3EnterInitializationMode(void *unit, bool has_tolerance, double tolerance, double start, bool has_stop, double stop) {
    return guarded(unit, [&](Fmu &fmu) {
        Experiment experiment;
        if (has_tolerance) experiment.tolerance = tolerance;
        experiment.start = start;
        if (has_stop) experiment.stop = stop;
        fmu.set_up(experiment);
        fmu.enter_initialisation();
    });
}
int fmi3ExitInitializationMode(void *unit) {
    return guarded(unit, [](Fmu &fmu) { fmu.exit_initialisation(); });
}
int fmi3Terminate(void *unit) {
    return guarded(unit, [](Fmu &fmu) { fmu.terminate(); });
}
int fmi3Reset(void *unit) {
    return guarded(unit, [](Fmu &fmu) { fmu.reset(); });
}

int fmi3GetFloat64(void *unit, const unsigned *references, std::size_t count, double *values, std::size_t size) {
    return guarded(unit, [&](Fmu &fmu) {
        check_sizes(count, size);
        fmu.get(references, count, values);
    });
}
int fmi3SetFloat64(void *unit, const unsigned *references, std::size_t count, const double *values, std::size_t size) {
    return guarded(unit, [&](Fmu &fmu) {
        check_sizes(count, size);
        fmu.set(references, count, values);
    });
}

int fmi3GetFMUState(void *unit, State **state) {
    return guarded(unit, [&](Fmu &fmu) {
        auto kept = fmu.keep();
        if (*state) **state = *kept;   // a state that there is takes the new one
        else *state = kept.release();
    });
}
int fmi3SetFMUState(void *unit, State *state) {
    return guarded(unit, [&](Fmu &fmu) {
        if (!state) throw Refusal("there is no state to go back to");
        fmu.restore(*state);
    });
}
int fmi3FreeFMUState(void *unit, State **state) {
    return guarded(unit, [&](Fmu &) {
        if (state) delete *state, *state = nullptr;
    });
}

int fmi3DoStep(void *unit, double time, double size, bool, bool *needs_event, bool *terminates, bool *is_early, double *reached) {
    return guarded(unit, [&](Fmu &fmu) {
        if (needs_event) *needs_event = false;
        if (terminates) *terminates = false;
        if (is_early) *is_early = false;
        fmu.step(time, size);
        if (reached) *reached = fmu.time();
    });
}

// Variables of other types than Float64: there are none, and to ask for none of them is allowed.
#define NO_VARIABLES(name) \
    int name(void *unit, const unsigned *, std::size_t count) { return count == 0 && unit ? ok : refuse(unit, #name); }
NO_VARIABLES(fmi3GetFloat32)
NO_VARIABLES(fmi3GetInt8)
NO_VARIABLES(fmi3GetUInt8)
NO_VARIABLES(fmi3GetInt16)
NO_VARIABLES(fmi3GetUInt16)
NO_VARIABLES(fmi3GetInt32)
NO_VARIABLES(fmi3GetUInt32)
NO_VARIABLES(fmi3GetInt64)
NO_VARIABLES(fmi3GetUInt64)
NO_VARIABLES(fmi3GetBoolean)
NO_VARIABLES(fmi3GetString)
NO_VARIABLES(fmi3GetBinary)
NO_VARIABLES(fmi3GetClock)
NO_VARIABLES(fmi3SetFloat32)
NO_VARIABLES(fmi3SetInt8)
NO_VARIABLES(fmi3SetUInt8)
NO_VARIABLES(fmi3SetInt16)
NO_VARIABLES(fmi3SetUInt16)
NO_VARIABLES(fmi3SetInt32)
NO_VARIABLES(fmi3SetUInt32)
NO_VARIABLES(fmi3SetInt64)
NO_VARIABLES(fmi3SetUInt64)
NO_VARIABLES(fmi3SetBoolean)
NO_VARIABLES(fmi3SetString)
NO_VARIABLES(fmi3SetBinary)
NO_VARIABLES(fmi3SetClock)

// Functions that need no argument but the first: in the calling conventions of Linux the caller removes the others.
#define NOT_OFFERED(name) \
    int name(void *unit) { return refuse(unit, #name); }
NOT_OFFERED(fmi3GetNumberOfVariableDependencies)
NOT_OFFERED(fmi3GetVariableDependencies)
NOT_OFFERED(fmi3SerializedFMUStateSize)
NOT_OFFERED(fmi3SerializeFMUState)
NOT_OFFERED(fmi3DeserializeFMUState)
NOT_OFFERED(fmi3GetDirectionalDerivative)
NOT_OFFERED(fmi3GetAdjointDerivative)
NOT_OFFERED(fmi3EnterConfigurationMode)
NOT_OFFERED(fmi3ExitConfigurationMode)
NOT_OFFERED(fmi3GetIntervalDecimal)
NOT_OFFERED(fmi3GetIntervalFraction)
NOT_OFFERED(fmi3GetShiftDecimal)
NOT_OFFERED(fmi3GetShiftFraction)
NOT_OFFERED(fmi3SetIntervalDecimal)
NOT_OFFERED(fmi3SetIntervalFraction)
NOT_OFFERED(fmi3SetShiftDecimal)
NOT_OFFERED(fmi3SetShiftFraction)
NOT_OFFERED(fmi3EvaluateDiscreteStates)
NOT_OFFERED(fmi3UpdateDiscreteStates)
NOT_OFFERED(fmi3EnterEventMode)
NOT_OFFERED(fmi3EnterContinuousTimeMode)
NOT_OFFERED(fmi3CompletedIntegratorStep)
NOT_OFFERED(fmi3SetTime)
NOT_OFFERED(fmi3SetContinuousStates)
NOT_OFFERED(fmi3GetContinuousStateDerivatives)
NOT_OFFERED(fmi3GetEventIndicators)
NOT_OFFERED(fmi3GetContinuousStates)
NOT_OFFERED(fmi3GetNominalsOfContinuousStates)
NOT_OFFERED(fmi3GetNumberOfEventIndicators)
NOT_OFFERED(fmi3GetNumberOfContinuousStates)
NOT_OFFERED(fmi3EnterStepMode)
NOT_OFFERED(fmi3GetOutputDerivatives)
NOT_OFFERED(fmi3ActivateModelPartition)

}   // extern "C"
