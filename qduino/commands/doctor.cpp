// qduino doctor: is this computer fit for real time?
#include "doctor/doctor.h"

#include <cstdio>

#include "qduino/command.h"
#include "terminal/parser.h"

namespace qduino::apps {
namespace {

class Doctor final : public Command {
    void declare(CLI::App& app) override { app.add_flag("--json", json_, "As JSON"); }

    Result<int> run() override { return run_doctor({.json = json_, .root = {}}, stdout); }

    bool json_ = false;
};

const Listed<Doctor> doctor_listed{
    {Place::doctor, "doctor", "Is this computer fit for real time?",
     "Changes nothing; names the exact fix for each shortfall. Ends with 0 when\n"
     "nothing needs fixing, 1 otherwise.\n"
     "Example: qduino doctor --json"}};

}  // namespace
}  // namespace qduino::apps
