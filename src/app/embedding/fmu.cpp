#include "fmu.hpp"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <utility>

namespace nocdyn_fmu {

namespace {

constexpr double same_time = 1e-9;   // of a step: what rounding may make of communication points

std::string text_of(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", value);   // reads back as the same double
    return text;
}

// resources/variables.txt: the token, then a line for each variable: its kind, its path, its value, with tabs between.
std::vector<Variable> read_variables(const std::string &path, const std::string &token) {
    static const std::map<std::string, Variable::Kind> kinds = {{"torque", Variable::torque_input},
                                                                {"set_point", Variable::set_point},
                                                                {"tunable", Variable::tunable},
                                                                {"fixed", Variable::fixed}};
    std::ifstream lines(path);
    std::string line;
    if (!std::getline(lines, line)) throw Refusal("'" + path + "' cannot be read");
    if (line != token) throw Refusal("'" + path + "' is of another FMU: its token is " + line + ", not " + token);
    std::vector<Variable> variables;
    while (std::getline(lines, line)) {
        const auto first = line.find('\t'), last = line.rfind('\t');
        const std::string kind = line.substr(0, first), name = line.substr(first + 1, last - first - 1);
        const double value = std::stod(line.substr(last + 1));
        const auto dot = name.find('.');
        variables.push_back({kinds.at(kind), name, name.substr(dot + 1, name.rfind('.') - dot - 1), value, value});
    }
    return variables;
}

}   // namespace

Fmu::Fmu(const std::string &resources, const std::string &token, Log log, bool is_logging)
    : log(std::move(log)), is_logging(is_logging), file(resources + "/machine.nml") {
    now.variables = read_variables(resources + "/variables.txt", token);
    open();
    start_of_input = nocdyn_time(now.machine.get());
    end_of_input = nocdyn_end_time(now.machine.get());
    outputs = static_cast<unsigned>(nocdyn_signal_count(now.machine.get()));
    row.resize(outputs);
}

// The machine with the values that have been set, at the start of the experiment.
void Fmu::open() {
    std::vector<std::string> settings;
    for (const Variable &variable : now.variables)
        if (variable.value != variable.start) settings.push_back(variable.path + "=" + text_of(variable.value));
    const Experiment &experiment = now.experiment;
    if (experiment.tolerance) settings.push_back("run.rtol=" + text_of(*experiment.tolerance));
    if (experiment.start && *experiment.start != start_of_input) {
        settings.push_back("run.t_start=" + text_of(*experiment.start));
        settings.push_back("run.t_end=" + text_of(*experiment.start + (end_of_input - start_of_input)));
    }
    std::vector<const char *> overrides;
    for (const std::string &setting : settings) overrides.push_back(setting.c_str());
    now.machine.reset(nocdyn_open(file.c_str(), static_cast<int>(overrides.size()), overrides.data(), nullptr), nocdyn_close);
    check(nocdyn_code(now.machine.get()));
    now.is_stale = false;
    const double start = nocdyn_time(now.machine.get());
    for (Variable &variable : now.variables) variable.torque = variable.value, variable.slope = 0, variable.since = start;
    const std::string notes = nocdyn_notes(now.machine.get());
    if (is_logging && !notes.empty()) log(ok, "notes", notes);
}

nocdyn_machine *Fmu::machine() {
    if (now.is_stale) open();
    return now.machine.get();
}

void Fmu::check(int code) {
    if (code != nocdyn_done) throw Refusal(nocdyn_message(now.machine.get()));
}

void Fmu::require(Situation::Phase phase, const char *what) const {
    static const char *const names[] = {"instantiated", "in its initialisation mode", "in its step mode", "terminated"};
    if (now.phase != phase)
        throw Refusal(std::string(what) + " is for a unit that is " + names[phase] + "; this one is " + names[now.phase]);
}

void Fmu::set_up(const Experiment &experiment) {
    require(Situation::instantiated, "an experiment");
    now.experiment = experiment;
    now.is_stale = true;
}

void Fmu::enter_initialisation() {
    require(Situation::instantiated, "entering the initialisation mode");
    machine();
    now.phase = Situation::initialising;
}

void Fmu::exit_initialisation() {
    require(Situation::initialising, "exiting the initialisation mode");
    check(nocdyn_set_end_time(machine(), now.experiment.stop.value_or(DBL_MAX)));
    now.phase = Situation::stepping;
}

void Fmu::terminate() { now.phase = Situation::terminated; }

void Fmu::reset() {
    for (Variable &variable : now.variables) variable.value = variable.start, variable.rate = 0;
    now.phase = Situation::instantiated;
    now.experiment = {};
    now.is_stale = true;
}

Variable &Fmu::variable(unsigned reference) {
    if (reference < outputs || reference - outputs >= now.variables.size())
        throw Refusal("the value reference " + std::to_string(reference) + " is of no input or parameter");
    return now.variables[reference - outputs];
}

void Fmu::get(const unsigned *references, std::size_t count, double *values) {
    if (std::any_of(references, references + count, [this](unsigned reference) { return reference < outputs; }))
        check(nocdyn_read(machine(), row.data()));
    for (std::size_t i = 0; i < count; i++)
        values[i] = references[i] < outputs ? row[references[i]] : variable(references[i]).value;
}

void Fmu::set(const unsigned *references, std::size_t count, const double *values) {
    for (std::size_t i = 0; i < count; i++) {
        Variable &variable = this->variable(references[i]);
        if (!std::isfinite(values[i])) throw Refusal(variable.path + " must be a finite number");
        if (values[i] == variable.value) continue;
        if (now.phase == Situation::instantiated || now.phase == Situation::initialising) {
            now.is_stale = true;
        } else {
            require(Situation::stepping, "setting a variable");
            if (variable.kind == Variable::fixed)
                throw Refusal(variable.path + " is fixed: it can be set before the unit leaves its initialisation mode only");
            if (variable.kind != Variable::torque_input) check(nocdyn_set(machine(), variable.path.c_str(), values[i]));
        }
        variable.value = values[i];
    }
}

void Fmu::set_rates(const unsigned *references, std::size_t count, const int *orders, const double *values) {
    for (std::size_t i = 0; i < count; i++) {
        Variable &variable = this->variable(references[i]);
        if (variable.kind != Variable::torque_input) throw Refusal(variable.path + " has no rate: it changes at once");
        if (orders[i] != 1) throw Refusal("of inputs the first derivative can be set, not that of order " + std::to_string(orders[i]));
        if (!std::isfinite(values[i])) throw Refusal("the rate of " + variable.path + " must be a finite number");
        variable.rate = values[i];
    }
}

// The torques of the next step. One that goes on as it is stays untouched: a change ends a step of the integration.
void Fmu::apply_inputs() {
    const double t = time();
    for (Variable &input : now.variables) {
        if (input.kind != Variable::torque_input) continue;
        if (input.value == input.torque + input.slope * (t - input.since) && input.rate == input.slope) continue;
        check(nocdyn_set_torque(machine(), input.element.c_str(), input.value, input.rate));
        input.torque = input.value, input.slope = input.rate, input.since = t;
    }
}

// Inputs that change evenly do so for one step; then they keep the value that they have reached.
void Fmu::step(double t, double size) {
    require(Situation::stepping, "a step");
    if (!(size > 0)) throw Refusal("the size of a step must be greater than 0; here " + text_of(size) + " s");
    if (!(std::abs(t - time()) <= same_time * size))
        throw Refusal("a step begins at the present time, " + text_of(time()) + " s; here " + text_of(t) + " s");
    const double end = nocdyn_end_time(machine());
    double target = t + size;
    if (target > end && target - end <= same_time * size) target = end;
    apply_inputs();
    check(nocdyn_run_to(machine(), target));
    for (Variable &input : now.variables)
        if (input.rate != 0) input.value = input.torque + input.slope * (target - input.since), input.rate = 0;
}

double Fmu::time() { return nocdyn_time(machine()); }

std::unique_ptr<State> Fmu::keep() {
    auto state = std::make_unique<State>();
    nocdyn_state *motion = nocdyn_keep(machine());
    check(nocdyn_code(machine()));
    state->motion.reset(motion, nocdyn_free_state);
    state->situation = now;
    return state;
}

void Fmu::restore(const State &state) {
    now = state.situation;
    check(nocdyn_restore(now.machine.get(), state.motion.get()));
}

}   // namespace nocdyn_fmu
