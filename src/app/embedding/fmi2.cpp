// The functions of FMI 2.0 for co-simulation (fmi2Functions.h), for the units that `nocdyn fmu` writes.
#include <cctype>
#include <cstdlib>
#include <string>

#include "fmu.hpp"

using namespace nocdyn_fmu;

namespace {

// Of fmi2FunctionTypes.h.
struct Callbacks {
    void (*log)(void *environment, const char *instance, int status, const char *category, const char *message, ...);
    void *(*allocate)(std::size_t, std::size_t);
    void (*free)(void *);
    void (*step_finished)(void *, int);
    void *environment;
};
enum { co_simulation = 1 };
enum { last_successful_time = 2, terminated = 3 };   // of fmi2StatusKind

// The format of printf, with references to variables: '#r12#'.
std::string as_format(const std::string &text) {
    std::string format;
    for (char c : text) format += c == '%' || c == '#' ? std::string(2, c) : std::string(1, c);
    return format;
}

// 'file:///a%20b' as a path, with or without an authority.
std::string path_of(const std::string &uri) {
    if (uri.compare(0, 5, "file:") != 0) throw Refusal("fmuResourceLocation is no URI of a file: '" + uri + "'");
    std::size_t at = 5;
    if (uri.compare(at, 2, "//") == 0) at = uri.find('/', at + 2);
    std::string path;
    for (; at < uri.size(); at++) {
        const bool is_code = uri[at] == '%' && at + 2 < uri.size() && std::isxdigit(static_cast<unsigned char>(uri[at + 1])) &&
                             std::isxdigit(static_cast<unsigned char>(uri[at + 2]));
        path += is_code ? static_cast<char>(std::strtol(uri.substr(at + 1, 2).c_str(), nullptr, 16)) : uri[at];
        if (is_code) at += 2;
    }
    return path;
}

// Variables of other types than Real: there are none.
int no_variables(void *unit, std::size_t count, const char *function) { return count == 0 && unit ? ok : refuse(unit, function); }

}   // namespace

extern "C" {

const char *fmi2GetTypesPlatform() { return "default"; }
const char *fmi2GetVersion() { return "2.0"; }

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks, int, int logs) {
    if (!callbacks || !callbacks->log) return nullptr;
    const auto log = [instance = std::string(name ? name : ""), write = callbacks->log, environment = callbacks->environment](
                         Status status, const char *category, const std::string &message) {
        write(environment, instance.c_str(), status, category, as_format(message).c_str());
    };
    try {
        if (type != co_simulation) throw Refusal("this FMU is for co-simulation, not for model exchange");
        return new Fmu(path_of(resources ? resources : ""), guid ? guid : "", log, logs);
    } catch (const std::exception &failure) {
        log(error, "logStatusError", failure.what());
        return nullptr;
    }
}

void fmi2FreeInstance(void *unit) { delete static_cast<Fmu *>(unit); }

int fmi2SetDebugLogging(void *unit, int logs, std::size_t, const char *const *) {
    return guarded(unit, [&](Fmu &fmu) { fmu.is_logging = logs; });
}

int fmi2SetupExperiment(void *unit, int has_tolerance, double tolerance, double start, int has_stop, double stop) {
    return guarded(unit, [&](Fmu &fmu) {
        Experiment experiment;
        if (has_tolerance) experiment.tolerance = tolerance;
        experiment.start = start;
        if (has_stop) experiment.stop = stop;
        fmu.set_up(experiment);
    });
}

int fmi2EnterInitializationMode(void *unit) {
    return guarded(unit, [](Fmu &fmu) { fmu.enter_initialisation(); });
}
int fmi2ExitInitializationMode(void *unit) {
    return guarded(unit, [](Fmu &fmu) { fmu.exit_initialisation(); });
}
int fmi2Terminate(void *unit) {
    return guarded(unit, [](Fmu &fmu) { fmu.terminate(); });
}
int fmi2Reset(void *unit) {
    return guarded(unit, [](Fmu &fmu) { fmu.reset(); });
}

int fmi2GetReal(void *unit, const unsigned *references, std::size_t count, double *values) {
    return guarded(unit, [&](Fmu &fmu) { fmu.get(references, count, values); });
}
int fmi2SetReal(void *unit, const unsigned *references, std::size_t count, const double *values) {
    return guarded(unit, [&](Fmu &fmu) { fmu.set(references, count, values); });
}
int fmi2SetRealInputDerivatives(void *unit, const unsigned *references, std::size_t count, const int *orders, const double *values) {
    return guarded(unit, [&](Fmu &fmu) { fmu.set_rates(references, count, orders, values); });
}

#define NO_VARIABLES(name) \
    int name(void *unit, const unsigned *, std::size_t count, const void *) { return no_variables(unit, count, #name); }
NO_VARIABLES(fmi2GetInteger)
NO_VARIABLES(fmi2GetBoolean)
NO_VARIABLES(fmi2GetString)
NO_VARIABLES(fmi2SetInteger)
NO_VARIABLES(fmi2SetBoolean)
NO_VARIABLES(fmi2SetString)

int fmi2GetFMUstate(void *unit, State **state) {
    return guarded(unit, [&](Fmu &fmu) {
        auto kept = fmu.keep();
        if (*state) **state = *kept;   // a state that there is takes the new one
        else *state = kept.release();
    });
}
int fmi2SetFMUstate(void *unit, State *state) {
    return guarded(unit, [&](Fmu &fmu) {
        if (!state) throw Refusal("there is no state to go back to");
        fmu.restore(*state);
    });
}
int fmi2FreeFMUstate(void *unit, State **state) {
    return guarded(unit, [&](Fmu &) {
        if (state) delete *state, *state = nullptr;
    });
}

int fmi2DoStep(void *unit, double time, double size, int) {
    return guarded(unit, [&](Fmu &fmu) { fmu.step(time, size); });
}

int fmi2GetRealStatus(void *unit, int kind, double *value) {
    if (kind != last_successful_time) return refuse(unit, "fmi2GetRealStatus");
    return guarded(unit, [&](Fmu &fmu) { *value = fmu.time(); });
}
int fmi2GetBooleanStatus(void *unit, int kind, int *value) {
    if (kind != terminated) return refuse(unit, "fmi2GetBooleanStatus");
    return guarded(unit, [&](Fmu &) { *value = 0; });
}

// Functions that need no argument but the first: in the calling conventions of Linux the caller removes the others.
#define NOT_OFFERED(name) \
    int name(void *unit) { return refuse(unit, #name); }
NOT_OFFERED(fmi2SerializedFMUstateSize)
NOT_OFFERED(fmi2SerializeFMUstate)
NOT_OFFERED(fmi2DeSerializeFMUstate)
NOT_OFFERED(fmi2GetDirectionalDerivative)
NOT_OFFERED(fmi2GetRealOutputDerivatives)
NOT_OFFERED(fmi2CancelStep)
NOT_OFFERED(fmi2GetStatus)
NOT_OFFERED(fmi2GetIntegerStatus)
NOT_OFFERED(fmi2GetStringStatus)

}   // extern "C"
