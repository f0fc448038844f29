// fake-sketch: the stand-in as a process of its own, so that the service can be killed while it
// goes on.
//
// Writes to its log, unbuffered, one line an event, and beside it one file a job with the bytes it
// took:
//     begun JOB LENGTH · ended JOB OUTCOME · gcode LINE           LOG.JOB: the bytes
#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>
#include <thread>

#include "link/link_file.h"
#include "terminal/command_line.h"
#include "tests/e2e/service/fake_sketch.h"

namespace {

volatile std::sig_atomic_t stop_asked = 0;

void append(const std::string& file, const void* bytes, std::size_t size) {
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    if (descriptor < 0 || ::write(descriptor, bytes, size) != static_cast<ssize_t>(size)) std::_Exit(3);
    ::close(descriptor);
}

qduino::tests::FakeSketch::Log log_to(const std::string& log) {
    const auto line = [log](const std::string& text) { append(log, (text + "\n").data(), text.size() + 1); };
    return {
        [=](std::uint64_t job, std::uint64_t length) {
            line("begun " + std::to_string(job) + " " + std::to_string(length));
        },
        [=](std::uint64_t job, std::span<const std::uint8_t> bytes) {
            append(log + "." + std::to_string(job), bytes.data(), bytes.size());
        },
        [=](std::uint64_t job, qduino::printer::link::JobOutcome outcome) {
            line("ended " + std::to_string(job) + " " + std::to_string(static_cast<int>(outcome)));
        },
        [=](const std::string& text) { line("gcode " + text); },
    };
}

}  // namespace

int main(int argc, char** argv) {
    std::string link_path, log;
    std::size_t rate = 1'000'000;
    qduino::apps::CommandLine line{"A stand-in for the sketch: takes job bytes from the link and logs them"};
    line.option("--link", link_path, "shared object to create").required();
    line.option("--log", log, "log file").required();
    line.option("--rate", rate, "job bytes taken per second");
    if (const auto status = line.parse(argc, argv)) return *status;

    auto link = qduino::apps::create_link(link_path, static_cast<std::uint64_t>(::time(nullptr)));
    if (!link.ok()) {
        std::fprintf(stderr, "%s\n", std::string{link.error().message.view()}.c_str());
        return 1;
    }
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { stop_asked = 1; });
    qduino::tests::FakeSketch sketch{*link->get(), log_to(log)};
    while (!stop_asked) {
        sketch.step(std::max<std::size_t>(rate / 200, 1));
        std::this_thread::sleep_for(std::chrono::milliseconds{5});
    }
    return 0;
}
