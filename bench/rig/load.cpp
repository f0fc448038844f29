#include "bench/rig/load.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "bench/rig/child.h"

namespace qduino::bench {
namespace {

pid_t spawn(std::vector<std::string> command, const std::string& output, const std::string& errors) {
    std::vector<char*> arguments;
    for (std::string& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const pid_t child = ::fork();
    if (child != 0) return child;
    ::setpgid(0, 0);  // Ctrl-C is for the benchmark, which ends this in good order
    ::dup2(::open(output.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644), STDOUT_FILENO);
    ::dup2(::open(errors.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644), STDERR_FILENO);
    ::execvp(arguments[0], arguments.data());
    ::_exit(127);
}

void end(pid_t& process) {
    if (process <= 0) return;
    ::kill(process, SIGTERM);
    for (int i = 0; i < 100; ++i) {
        if (::waitpid(process, nullptr, WNOHANG) != 0) {
            process = 0;
            return;
        }
        ::usleep(50'000);
    }
    ::kill(process, SIGKILL);
    ::waitpid(process, nullptr, 0);
    process = 0;
}

/// The first line of a file, once it has one; at most 10 s.
std::string await_line(const std::string& path) {
    for (int i = 0; i < 200; ++i) {
        std::ifstream file{path};
        if (std::string line; std::getline(file, line) && !file.eof()) return line;
        ::usleep(50'000);
    }
    return {};
}

}  // namespace

std::string SubmissionLoad::start() {
    std::string name = (std::filesystem::temp_directory_path() / "qduino-load-XXXXXX").string();
    if (!::mkdtemp(name.data())) return "no temporary folder to be had";
    folder_ = name;
    ::chmod(folder_.c_str(), 0755);
    const std::string state = folder_ + "/state";
    std::vector<std::string> service{program_beside("printd"), "--state",  state,         "--link",
                                     folder_ + "/link",        "--listen", "127.0.0.1:0", "--print-link"};
    if (::getuid() == 0) service.insert(service.end(), {"--run-as", "nobody"});
    service_ = spawn(service, folder_ + "/address", folder_ + "/printd.log");
    const std::string address = await_line(folder_ + "/address");
    if (address.empty()) return "the print service did not start; see " + folder_ + "/printd.log";
    sender_ =
        spawn({"python3", QDUINO_SOURCE_DIR "/bench/rig/submission.py", "--address",
               address.substr(0, address.find("/#")), "--key-file", state + "/api-key", "--uploads", "0"},
              folder_ + "/uploads", folder_ + "/sender.log");
    if (await_line(folder_ + "/uploads").empty())
        return "no upload was answered; see " + folder_ + "/sender.log";
    return {};
}

void SubmissionLoad::read_log() {
    std::ifstream file{folder_ + "/uploads"};
    for (std::string line; std::getline(file, line);) {
        const auto answer = nlohmann::json::parse(line, nullptr, false);
        if (answer.is_discarded() || answer.value("status", 0) != 201) continue;
        ++uploads_;
        megabytes_ += answer.value("bytes", 0.0) / 1e6;
    }
}

void SubmissionLoad::stop() {
    if (folder_.empty()) return;
    end(sender_);
    end(service_);
    read_log();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
    folder_.clear();
}

}  // namespace qduino::bench
