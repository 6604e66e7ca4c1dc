// A unit for co-simulation (FMU): a machine in the terms that FMI 2.0 and 3.0 share. fmi2.cpp and fmi3.cpp have the functions of
// the standards. Units share nothing; one is used by one thread at a time.
#ifndef NOCDYN_FMU_HPP
#define NOCDYN_FMU_HPP

#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nocdyn.h"

namespace nocdyn_fmu {

enum Status { ok = 0, error = 3 };   // numbers of both standards

// What a call may not do, or why the machine failed: the call logs it and returns `error`.
struct Refusal : std::exception {
    explicit Refusal(std::string text) : message(std::move(text)) {}
    const char *what() const noexcept override { return message.c_str(); }
    std::string message;
};

// An input or a parameter, as a line of resources/variables.txt tells it.
struct Variable {
    enum Kind { torque_input, set_point, tunable, fixed } kind;
    std::string path;          // of the number in the input: 'load.work.viscous', of an input 'excitation.push.amplitude'
    std::string element;       // the name in the path
    double start;              // value in the input
    double value;              // that has been set
    double rate = 0;           // of an input, over the next step
    double torque = 0, slope = 0, since = 0;   // of an input: as the machine has it
};

struct Experiment {
    std::optional<double> tolerance, start, stop;
};

// What a copy of a unit takes along.
struct Situation {
    enum Phase { instantiated, initialising, stepping, terminated } phase = instantiated;
    Experiment experiment;
    std::vector<Variable> variables;
    bool is_stale = true;   // values have been set since the machine was opened
    std::shared_ptr<nocdyn_machine> machine;
};

struct State {
    Situation situation;
    std::shared_ptr<nocdyn_state> motion;
};

class Fmu {
public:
    using Log = std::function<void(Status status, const char *category, const std::string &message)>;

    // From the folder `resources` of an FMU; throws if it is not of this token, or if the machine is refused.
    Fmu(const std::string &resources, const std::string &token, Log log, bool is_logging);

    void set_up(const Experiment &experiment);
    void enter_initialisation();
    void exit_initialisation();
    void terminate();
    void reset();

    // Value references: 0 the time, then the outputs in the order of the signals, then the lines of variables.txt.
    void get(const unsigned *references, std::size_t count, double *values);
    void set(const unsigned *references, std::size_t count, const double *values);
    void set_rates(const unsigned *references, std::size_t count, const int *orders, const double *values);

    void step(double time, double size);
    double time();
    std::unique_ptr<State> keep();
    void restore(const State &state);

    const Log log;
    bool is_logging;

private:
    void open();
    nocdyn_machine *machine();
    void check(int code);
    void require(Situation::Phase phase, const char *what) const;
    Variable &variable(unsigned reference);
    void apply_inputs();

    const std::string file;
    Situation now;
    double start_of_input = 0, end_of_input = 0;
    unsigned outputs = 0;   // with the time
    std::vector<double> row;
};

// Carries out a call for a unit, and returns its status.
template <class Call>
int guarded(void *unit, Call call) {
    if (!unit) return error;
    Fmu &fmu = *static_cast<Fmu *>(unit);
    try {
        call(fmu);
        return ok;
    } catch (const std::exception &failure) {
        fmu.log(error, "logStatusError", failure.what());
        return error;
    }
}

// A function that a capability flag of modelDescription.xml excludes.
inline int refuse(void *unit, const char *function) {
    return guarded(unit, [&](Fmu &) { throw Refusal(std::string(function) + " is not offered"); });
}

}   // namespace nocdyn_fmu

#endif
