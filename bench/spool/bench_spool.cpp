// bench-spool: the cost of the print service when it has printed for years.
//
//   bench-spool [--json] [--jobs N] [--rounds N]
//
// Makes a state folder of N ended jobs (100,000), each with its files and the facts of a sliced
// part. Starts the printd that was built beside this program on it. Measured from outside: the time
// until it listens, the time of one answer over one connection, and its resident memory. Every
// start reads the whole journal once, to find damaged pages; the file is in the page cache by then.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "bench/rig/child.h"
#include "bench/rig/report.h"
#include "board/linux/kernel/clock.h"
#include "spool/disk/blob_store.h"
#include "spool/disk/sqlite_store.h"

namespace qduino::bench {
namespace {

using board::linux::monotonic_now;
using namespace spool;

struct Options {
    bool json = false;
    int jobs = 100'000;
    int rounds = 5;
};

constexpr double kStartAsked_ms = 1000, kListAsked_ms = 50, kMemoryAsked_mb = 60;
constexpr int kListsEachRound = 20;

double ms_since(Instant begun) { return static_cast<double>((monotonic_now() - begun).count()) * 1e-6; }

[[noreturn]] void give_up(const std::string& why) {
    std::fprintf(stderr, "bench-spool: %s\n", why.c_str());
    std::exit(1);
}

// ---- a state folder of years --------------------------------------------------------------------

Job job_of(int id) {
    constexpr const char* kNames[] = {"bracket", "cable-clip", "gear", "hinge",
                                      "hook",    "knob",       "lid",  "spacer"};
    Job job;
    job.id = id;
    job.name = std::string{kNames[id % 8]} + "-" + std::to_string(id) + "_0.2mm_PLA.gcode";
    job.size = 3'400'000;
    job.sha256 = sha256_of(job.name);
    job.state = id % 50 == 7 ? JobState::failed : id % 20 == 3 ? JobState::cancelled : JobState::done;
    job.copies_done = job.state == JobState::done ? 1 : 0;
    job.order = id;
    job.created_s = 1'600'000'000 + id * 3600;
    job.started_s = job.created_s + 60;
    job.ended_s = job.created_s + 3000;
    if (job.state != JobState::done) job.stopped_line = 1000 + id % 7000, job.stopped_layer = 1 + id % 100;
    job.printed_s = 2900;
    if (job.state == JobState::failed)
        job.error = "hot end: not heating as it should, 2.0 °C expected in 20 s, 0.4 °C seen";
    job.facts_json =
        R"({"estimated_s":4804.0,"filament_mm":3918.2,"layers":240,"layer_height_mm":0.2,"min_mm":[40.0,40.0,0.3],)"
        R"("max_mm":[110.0,110.0,36.0],"hot_end_c":209.0,"bed_c":60.0,"lines":104711,"moves":99820,"slicer":"PrusaSlicer 2.5.0",)"
        R"("material":"PLA","thumbnail":true,"warnings":[{"line":14,"message":"M900 is answered, but pressure advance is set in )"
        R"(the machine file."}],"warnings_count":1})";
    job.estimated_s = 4804;
    job.has_layers = job.has_thumbnail = true;
    job.stored_bytes = job.size + 900'000;
    return job;
}

/// The job's files, short ones: only their number matters.
void write_files(const BlobStore& blobs, const Job& job) {
    std::ofstream{blobs.path(job.sha256, BlobPart::gcode)} << "G28\n";
    std::ofstream{blobs.path(job.sha256, BlobPart::record)} << job.id << "\t" << job.created_s << "\t"
                                                            << job.name << "\n";
}

void make_folder(const std::filesystem::path& folder, int jobs) {
    const auto blobs = BlobStore::open(folder, {});
    const auto store = SqliteStore::open(folder / "journal.sqlite");
    if (!blobs.ok() || !store.ok()) give_up("cannot make a state folder in " + folder.string());
    Commit commit;
    for (int id = 1; id <= jobs; ++id) {
        commit.jobs.put.push_back(job_of(id));
        write_files(**blobs, commit.jobs.put.back());
        if (commit.jobs.put.size() < 2000 && id < jobs) continue;
        if (!(*store)->commit(commit).ok()) give_up("cannot write the journal");
        commit = {};
    }
    const auto state = (*store)->load();
    if (!state.ok() || !(*blobs)->set_journal_id(state->journal_id).ok())
        give_up("cannot finish the state folder");
}

// ---- the service, from outside ------------------------------------------------------------------

class Service {
  public:
    explicit Service(const std::filesystem::path& folder) {
        int out[2];
        if (::pipe(out) != 0) give_up("no pipe");
        const std::string program = program_beside("printd"), state = folder.string(),
                          link = (folder / "no-link").string();
        const Instant begun = monotonic_now();
        child_ = ::fork();
        if (child_ == 0) {
            ::dup2(out[1], STDOUT_FILENO);
            const std::string log = (folder / "log").string();
            if (!std::freopen(log.c_str(), "w", stderr)) ::_exit(127);
            ::execl(program.c_str(), program.c_str(), "--state", state.c_str(), "--link", link.c_str(),
                    "--listen", "127.0.0.1:0", "--no-auth", "--print-link", nullptr);
            ::_exit(127);
        }
        ::close(out[1]);
        std::string line;
        for (char c = 0; ::read(out[0], &c, 1) == 1 && c != '\n';) line += c;
        start_ms = ms_since(begun);
        ::close(out[0]);
        const std::size_t colon = line.rfind(':');
        if (colon == std::string::npos) give_up(program + " did not start; its log is in " + folder.string());
        port_ = std::atoi(line.c_str() + colon + 1);
    }
    ~Service() {
        ::kill(child_, SIGTERM);
        ::waitpid(child_, nullptr, 0);
    }
    Service(const Service&) = delete;
    Service& operator=(const Service&) = delete;

    struct Answer {
        double ms = 0;
        std::size_t bytes = 0;
    };
    /// On a connection of its own, connecting included.
    [[nodiscard]] Answer get(const std::string& path) const {
        const Instant begun = monotonic_now();
        const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(static_cast<std::uint16_t>(port_));
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        const std::string request =
            "GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n";
        std::string text;
        if (::connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 &&
            ::write(socket, request.data(), request.size()) == static_cast<ssize_t>(request.size())) {
            char bytes[65536];
            for (ssize_t count = 0; (count = ::read(socket, bytes, sizeof bytes)) > 0;)
                text.append(bytes, static_cast<std::size_t>(count));
        }
        ::close(socket);
        if (!text.starts_with("HTTP/1.1 200")) give_up("no answer to " + path + ": " + text.substr(0, 100));
        return {ms_since(begun), text.size()};
    }
    /// A line of /proc/PID/status, in MB.
    [[nodiscard]] double status_mb(std::string_view name) const {
        std::ifstream status{"/proc/" + std::to_string(child_) + "/status"};
        for (std::string line; std::getline(status, line);) {
            if (line.starts_with(name)) return std::strtod(line.c_str() + name.size() + 1, nullptr) / 1024;
        }
        return 0;
    }
    double start_ms = 0;

  private:
    pid_t child_ = -1;
    int port_ = 0;
};

// ---- report -------------------------------------------------------------------------------------

struct Question {
    const char* what;
    std::string path;
};

void add_result(Report& report, const std::string& what, std::vector<double>& values, const char* unit,
                std::size_t bytes = 0) {
    std::sort(values.begin(), values.end());
    const auto tenth = [](double value) { return std::round(value * 10) / 10; };
    report.results.push_back({{"what", what},
                              {"unit", unit},
                              {"median", tenth(values[values.size() / 2])},
                              {"max", tenth(values.back())},
                              {"answer_bytes", bytes}});
}

Report measure(const Options& options, const std::filesystem::path& folder) {
    Report report;
    const std::vector<Question> questions{
        {"first page", "/api/v1/jobs"},
        {"page in the middle", "/api/v1/jobs?limit=50&before=" + std::to_string(options.jobs / 2)},
        {"failed ones, in the middle",
         "/api/v1/jobs?limit=50&state=failed&before=" + std::to_string(options.jobs / 2)},
        {"search, many found", "/api/v1/jobs?limit=50&q=GEAR"},
        {"search, one found",
         "/api/v1/jobs?limit=50&q=gear-" + std::to_string(options.jobs / 8 * 4 + 2) + "_"},
        {"search, none found", "/api/v1/jobs?limit=50&q=nothing-like-it"},
        {"OctoPrint's files", "/api/files"},
    };
    std::vector<std::vector<double>> answers(questions.size());
    std::vector<std::size_t> bytes(questions.size());
    std::vector<double> starts, resident, peak;
    for (int round = 0; round < options.rounds; ++round) {
        const Service service{folder};
        starts.push_back(service.start_ms);
        for (std::size_t i = 0; i < questions.size(); ++i) {
            for (int n = 0; n < kListsEachRound; ++n) {
                const Service::Answer answer = service.get(questions[i].path);
                answers[i].push_back(answer.ms);
                bytes[i] = answer.bytes;
            }
        }
        resident.push_back(service.status_mb("VmRSS:"));
        peak.push_back(service.status_mb("VmHWM:"));
    }
    add_result(report, "start", starts, "ms");
    for (std::size_t i = 0; i < questions.size(); ++i)
        add_result(report, questions[i].what, answers[i], "ms", bytes[i]);
    add_result(report, "resident memory", resident, "MB");
    add_result(report, "its peak", peak, "MB");
    report.guarantee = std::to_string(options.jobs) + " ended jobs; " + std::to_string(options.rounds) +
                       " starts, " + std::to_string(kListsEachRound) +
                       " answers of each kind after each; ordinary priority";
    report.remarks.push_back(report.guarantee.get<std::string>());
    report.remarks.push_back(verdict(starts.back() <= kStartAsked_ms, "start %.0f ms at most (asked: %.0f)",
                                     starts.back(), kStartAsked_ms));
    double slowest = 0;
    for (const auto& each : answers) slowest = std::max(slowest, each[each.size() / 2]);
    report.remarks.push_back(verdict(slowest <= kListAsked_ms, "list %.1f ms, the slowest kind (asked: %.0f)",
                                     slowest, kListAsked_ms));
    report.remarks.push_back(verdict(peak.back() <= kMemoryAsked_mb, "memory %.1f MB at most (asked: %.0f)",
                                     peak.back(), kMemoryAsked_mb));
    return report;
}

int usage(int status) {
    std::fprintf(status == 0 ? stdout : stderr,
                 "usage: bench-spool [--json] [--jobs N] [--rounds N]\n"
                 "Start, lists and memory of the print service with N ended jobs (100000).\n");
    return status;
}

int run(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string_view argument = argv[i];
        const int number = i + 1 < argc ? std::atoi(argv[i + 1]) : 0;
        if (argument == "--help") return usage(0);
        if (argument == "--json") {
            options.json = true;
        } else if (argument == "--jobs" && number > 0 && number <= 1'000'000) {
            options.jobs = number, ++i;
        } else if (argument == "--rounds" && number > 0 && number <= 1000) {
            options.rounds = number, ++i;
        } else {
            return usage(2);
        }
    }
    std::string folder = (std::filesystem::temp_directory_path() / "bench-spool-XXXXXX").string();
    if (!::mkdtemp(folder.data())) give_up("cannot make a folder for the jobs");
    make_folder(folder, options.jobs);
    print(measure(options, folder), options.json);
    std::filesystem::remove_all(folder);
    return 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) { return qduino::bench::run(argc, argv); }
