#include "qduino/arguments.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "board/linux/kernel/host_settings.h"
#include "board/linux/kernel/memory_folder.h"
#include "board/linux/loop/budget_keeper.h"
#include "config/board_file.h"
#include "doctor/doctor.h"
#include "posix/small_file.h"
#include "qduino/beside_command.h"
#include "qduino/build/loose_pins.h"
#include "qduino/build/sketch_build.h"
#include "qduino/common/child_process.h"
#include "qduino/common/words.h"
#include "qduino/ide/ide_recipe.h"
#include "qduino/ide_command.h"
#include "qduino/library_command.h"
#include "qduino/metal_command.h"
#include "qduino/monitor_command.h"
#include "qduino/trace/kernel_trace.h"
#include "qduino/trace/profile_result.h"
#include "qduino/trace/traced_picture.h"
#include "qduino/upload/board_folder.h"
#include "qduino/upload/remote.h"
#include "qduino/upload/sketch_keeper.h"
#include "qduino/upload/sketch_parcel.h"
#include "qduino/vcpu_command.h"
#include "report/picture/page.h"
#include "report/picture/picture_file.h"
#include "report/picture/strip.h"
#include "terminal/colour.h"
#include "terminal/human.h"
#include "terminal/message.h"
#include "terminal/program.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

constexpr Fail fail{"qduino: "};

Result<Sdk> sdk_of_this_program() {
    std::error_code failed;
    const char* home = std::getenv("QDUINO_HOME");
    const SdkPlaces places{.home = home ? home : "",
                           .program = fs::read_symlink("/proc/self/exe", failed),
                           .built_in = QDUINO_SDK_FILE};
    QDUINO_TRY_ASSIGN(const fs::path file, find_sdk(places));
    return read_sdk(file);
}

/// A sketch, made into the programs of some boards.
struct Built {
    Sdk sdk;
    Sketch sketch;
    std::vector<fs::path> programs;  ///< in the order of the boards
    int steps = 0;                   ///< that had to be made
};

Result<Built> build_sketch(const Arguments& arguments, const std::vector<BoardKind>& boards) {
    QDUINO_TRY_ASSIGN(Sdk sdk, sdk_of_this_program());
    QDUINO_TRY_ASSIGN(Sketch sketch, find_sketch(arguments.sketch));
    Built built{.sdk = std::move(sdk), .sketch = std::move(sketch), .programs = {}};
    for (const BoardKind board : boards) {
        const Sdk& tools = built.sdk;
        QDUINO_TRY_ASSIGN(const SketchBuild build,
                          SketchBuild::open(board == BoardKind::sim ? for_simulator(tools) : tools,
                                            built.sketch, environment_of_this_process()));
        QDUINO_TRY_ASSIGN(const int made, build.make({board}, arguments.verbose));
        built.steps += made;
        built.programs.push_back(build.program(board));
    }
    return built;
}

/// The board file, read before anything is compiled; the default board when none is named.
ReadBoardFile board_of(const Arguments& arguments) {
    return arguments.board.empty() ? ReadBoardFile{} : read_board_file(arguments.board);
}

// ---- the commands: each returns the exit status; an error means 1 -------------------------------

Result<int> make_new(const Arguments& arguments) {
    QDUINO_TRY_ASSIGN(const fs::path made, make_sketch(arguments.name));
    std::printf("%s\n", made.c_str());
    // The path alone is for programs.
    say("Next: " + shell_words({"cd", made.parent_path().native()}) + " && qduino check");
    return 0;
}

Result<int> build(const Arguments& arguments) {
    std::vector<BoardKind> boards{BoardKind::sim, BoardKind::linux};
    if (!arguments.only.empty()) boards = {arguments.only == "sim" ? BoardKind::sim : BoardKind::linux};
    const Result<Built> built = build_sketch(arguments, boards);
    if (!built) {
        const int status = fail(built.error());
        say(verdict("nothing was built."));
        return status;
    }
    for (fs::path program : built->programs) {
        if (!arguments.output.empty()) {
            const fs::path copy = fs::path(arguments.output) / program.filename();
            std::error_code failed;
            fs::create_directories(arguments.output, failed);
            fs::copy_file(program, copy, fs::copy_options::overwrite_existing, failed);
            if (failed) return fail("cannot write " + copy.string() + ": " + failed.message());
            program = copy;
        }
        std::printf("%s\n", program.c_str());
    }
    std::fflush(stdout);
    if (arguments.compile_commands) {
        QDUINO_TRY_ASSIGN(const SketchBuild made,
                          SketchBuild::open(built->sdk, built->sketch, environment_of_this_process()));
        QDUINO_TRY(made.write_compile_commands());
    }
    say(verdict(built->sketch.name + (built->steps == 0
                                          ? " is up to date."
                                          : " is built: " + counted(built->steps, "step") + ".")));
    return 0;
}

/// The options that were given, as the sketch's own program takes them; --pins apart.
Words options_of(const Arguments& arguments) {
    Words words;
    const auto add = [&words](const char* name, const auto& value) {
        words.insert(words.end(), {name, text<std::string>(value)});
    };
    if (arguments.length_s) add("--for", Shortest{*arguments.length_s});
    if (arguments.speed) add("--speed", Shortest{*arguments.speed});
    if (!arguments.board.empty()) add("--board", arguments.board);
    if (arguments.cores) add("--cores", *arguments.cores);
    if (arguments.seed) add("--seed", *arguments.seed);
    if (!arguments.report.empty()) add("--report", arguments.report);
    if (!arguments.picture.empty()) add("--picture", arguments.picture);
    if (!arguments.vcd.empty()) add("--vcd", arguments.vcd);
    if (arguments.plain) words.emplace_back("--plain");
    if (arguments.picture_from_s) add("--from", Shortest{*arguments.picture_from_s});
    if (arguments.picture_length_s) add("--length", Shortest{*arguments.picture_length_s});
    if (!arguments.admission.empty()) add("--admission", arguments.admission);
    if (!arguments.profile.empty()) {
        add("--profile", arguments.profile);
        add("--margin", Shortest{arguments.margin_percent});
    }
    if (arguments.json) words.emplace_back("--json");
    if (!arguments.certificate.empty()) add("--certificate", arguments.certificate);
    if (arguments.isolate) words.emplace_back("--isolate");
    if (arguments.best_effort) words.emplace_back("--best-effort");
    return words;
}

/// The files of a sketch, a line each.
std::string lines_of(const Sketch& sketch) {
    std::string lines;
    for (const fs::path& tab : sketch.tabs) lines += tab.string() + '\n';
    for (const fs::path& source : sketch.sources) lines += source.string() + '\n';
    return lines;
}

/// Builds the simulator's program and becomes it; `words` stand before the options.
Result<int> become_simulation(const Arguments& arguments, const Words& words) {
    if (!arguments.picture.empty()) QDUINO_TRY(picture::check_picture_name(arguments.picture));
    if (const ReadBoardFile board = board_of(arguments); !board.ok()) return fail(board.error);
    QDUINO_TRY_ASSIGN(const Built built, build_sketch(arguments, {BoardKind::sim}));
    Words command{built.programs[0].string()};
    append(command, words);
    append(command, options_of(arguments));
    if (!arguments.certificate.empty()) append(command, {"--sources", lines_of(built.sketch)});
    return become(command);
}

Result<int> sim(const Arguments& arguments) { return become_simulation(arguments, {}); }

Result<int> check(const Arguments& arguments) { return become_simulation(arguments, {"--check"}); }

Result<std::string> trace_file(const Arguments& arguments) {
    if (!arguments.output.empty()) return arguments.output;
    QDUINO_TRY_ASSIGN(const Sketch sketch, find_sketch(arguments.sketch));
    return sketch.name + "-trace.json";
}

bool names_real_devices(const board::linux::LinuxConfig& board) {
    return !board.gpio.empty() || !board.pwm.empty() || !board.analog.empty() || !board.i2c.empty() ||
           !board.spi.empty();
}

/// An ordinary process may be kept from running for longer than the supervisor waits for a
/// real-time one, and is not hung for that.
constexpr const char* kPatienceMs = "10000";

/// The program behind pins that are connected to nothing.
enum class Behind { nobody, us };

/// The command that runs a sketch's program on Linux, under the supervisor where there is one. The
/// pins are in `folder`, made here, when no others are named; `behind` them we serve them before it
/// starts, or nobody.
Result<Words> linux_command(const Arguments& arguments, const fs::path& program, const fs::path& supervisor,
                            const board::linux::LinuxConfig& board, board::linux::MemoryFolder& folder,
                            Behind behind) {
    std::string pins = arguments.pins.empty() ? board.pins_path : arguments.pins;
    Words sketch{program.string()};
    append(sketch, options_of(arguments));
    if (!fs::exists(supervisor)) {
        say("no qduino-supervisor: safe states hold only as long as the sketch lives", "qduino: ");
        if (!pins.empty()) append(sketch, {"--pins", pins});
        return sketch;
    }
    // Memory that several processes map must never wait for a disk. It goes when the run is over.
    Words command{supervisor.string(), "--settings-state", board.settings_state};
    if (arguments.best_effort || !board.real_time) append(command, {"--timeout-ms", kPatienceMs});
    if (pins.empty()) {
        QDUINO_TRY_ASSIGN(folder, board::linux::MemoryFolder::make(board::linux::MemoryFolder::kParent));
        std::fputs(names_real_devices(board)
                       ? "Pins that the board file does not name are connected to nothing.\n"
                       : "No pins are named: all are connected to nothing (--board names real ones,\n"
                         "--pins those of a virtual machine).\n"
                         "What the sketch drives is told at the end.\n",
                   stderr);
        pins = folder.file("pins");
        if (behind == Behind::nobody) command.emplace_back("--make-pins");
    }
    append(command, {"--pins", pins, "--"});
    append(command, sketch);
    append(command, {"--pins", pins});
    return command;
}

/// How the pins of a run on Linux are to be shown: here, for the sketch's program does not see
/// them.
struct PinsAsked {
    std::string picture, vcd;
    Nanoseconds from{0};
    std::optional<Nanoseconds> length;
    bool plain = false;

    /// Takes them out of `arguments`.
    explicit PinsAsked(Arguments& arguments)
        : picture(std::exchange(arguments.picture, {})),
          vcd(std::exchange(arguments.vcd, {})),
          from(from_seconds(std::exchange(arguments.picture_from_s, {}).value_or(0))),
          plain(std::exchange(arguments.plain, false)) {
        if (const auto seconds = std::exchange(arguments.picture_length_s, {}))
            length = std::max(from_seconds(*seconds), Nanoseconds{1});
    }
};

/// A run on Linux that has ended.
struct LinuxRun {
    int status = 0;
    std::unique_ptr<LoosePins> pins;  ///< null: they belong to another program, or nobody asked
};

/// Runs a built sketch on Linux to its end. With `asked` the pins that are connected to nothing are
/// seen.
Result<LinuxRun> run_on_linux(const Arguments& arguments, const Built& built,
                              const board::linux::LinuxConfig& board, const PinsAsked* asked) {
    const bool loose = arguments.pins.empty() && board.pins_path.empty() && fs::exists(built.sdk.supervisor);
    const bool seen = asked && loose;
    if (asked && !loose && !asked->vcd.empty())
        return make_error(ErrorCode::invalid_argument,
                          "--vcd is about pins that are connected to nothing: those of --pins belong to the "
                          "program behind them, and without a supervisor there are none");
    board::linux::MemoryFolder folder;
    QDUINO_TRY_ASSIGN(const Words command, linux_command(arguments, built.programs[0], built.sdk.supervisor,
                                                         board, folder, seen ? Behind::us : Behind::nobody));
    LinuxRun run;
    if (seen) {
        QDUINO_TRY_ASSIGN(run.pins, LoosePins::serve(folder.file("pins"), !asked->vcd.empty(), asked->from));
    }
    QDUINO_TRY_ASSIGN(run.status, run_in_front(command));
    if (run.pins) run.pins->end();
    return run;
}

/// The run's pins alone, as a picture: nobody has seen when which loop ran.
picture::Schedule pins_of(PinWitness& pins, const std::string& sketch, const PinsAsked& asked) {
    picture::Schedule schedule;
    schedule.title = sketch + " on this computer: its pins";
    schedule.remark =
        "What the sketch drove, from its first write on. Nothing is connected to these pins. When which loop "
        "ran: 'qduino trace --linux --picture FILE', as root.";
    schedule.from = kEpoch + asked.from;
    schedule.until = schedule.from + asked.length.value_or(100ms);
    pins.add_rows(schedule, pins.origin(), !asked.length);
    return schedule;
}

/// Says what the pins did, and writes the dump that is asked for.
Result<void> show_pins(LoosePins& pins, const PinsAsked& asked, const picture::Schedule& schedule) {
    std::string words;
    const bool colours = wants_colour(STDERR_FILENO);
    if (!asked.plain && schedule.cores.empty())
        words = picture::strip(schedule, picture::signs_of_terminal(), colours);
    if (!words.empty()) words += '\n';
    words += pins.witness().empty() ? "No pin was driven.\n" : pins.witness().sentences();
    if (const auto faults = pins.faults(); faults.lost + faults.disordered > 0)
        write(words, faults.lost, " changes of pins were lost, ", faults.disordered,
              " came too late: this computer was too busy to listen\n");
    if (!asked.vcd.empty()) {
        QDUINO_TRY(pins.witness().write_dump(asked.vcd));
        write(words, "pins: ", asked.vcd, "\n  (open it in GTKWave or PulseView)\n");
    }
    say("\n" + words);
    return {};
}

/// The result of a run. The sketch's own report has already said how its loops kept their periods.
std::string end_of(const std::string& name, int status) {
    if (status == 0) return name + " ran to its end.";
    if (status == 2) return name + " is REFUSED: no loop of it ran.";
    if (status <= 128) return text<std::string>(name, " FAILED with status ", status, '.');
    const char* signal = ::strsignal(status - 128);
    return text<std::string>(name, " DIED of signal ", status - 128, " (", signal ? signal : "unknown", ").");
}

Result<int> run(const Arguments& given) {
    Arguments arguments = given;
    const PinsAsked asked{arguments};
    const ReadBoardFile read = board_of(arguments);
    if (!read.ok()) return fail(read.error);
    if (!asked.picture.empty()) QDUINO_TRY(picture::check_picture_name(asked.picture));
    QDUINO_TRY_ASSIGN(const Built built, build_sketch(arguments, {BoardKind::linux}));
    QDUINO_TRY_ASSIGN(const LinuxRun ended, run_on_linux(arguments, built, read.board.linux, &asked));
    if (ended.pins && ended.status != 2) {
        const picture::Schedule schedule = pins_of(ended.pins->witness(), built.sketch.name, asked);
        QDUINO_TRY(show_pins(*ended.pins, asked, schedule));
        if (!asked.picture.empty() && !schedule.pins.empty()) {
            QDUINO_TRY(picture::write_picture(asked.picture, picture::svg_page(schedule)));
            say("picture: " + asked.picture);
        }
    }
    say(verdict(end_of(built.sketch.name, ended.status)));
    return ended.status;
}

Result<void> write_trace(KernelTraceReader& reader, const std::string& path) {
    if (!posix::write_file(path, reader.chrome_json()))
        return make_error(ErrorCode::unavailable, "the trace cannot be written: ", path);
    std::fputs(
        text<std::string>(
            "trace: ", path, "\n  (open it in ui.perfetto.dev or chrome://tracing): ", reader.stretches(),
            " stretches of loops, wakes,\n"
            "preemption, throttling and interrupts, as the kernel saw them. Not in it: where a\n"
            "release begins in a loop that spins on its own core, and overruns (counted above).\n")
            .c_str(),
        stderr);
    if (reader.lost() > 0) {
        std::fprintf(stderr, "The oldest %lld events did not fit the kernel's buffer: trace for less time.\n",
                     static_cast<long long>(reader.lost()));
    }
    return {};
}

constexpr double kTraceSeconds = 10;

Result<int> trace_on_linux(Arguments arguments, const std::string& output) {
    const ReadBoardFile read = board_of(arguments);
    if (!read.ok()) return fail(read.error);
    if (!arguments.length_s) arguments.length_s = kTraceSeconds;
    const TracedWindow window{arguments.picture_from_s.value_or(0), arguments.picture_length_s};
    const PinsAsked asked{arguments};
    const std::string& picture = asked.picture;
    board::linux::MemoryFolder folder;
    if (!picture.empty()) {
        QDUINO_TRY(picture::check_picture_name(picture));
        QDUINO_TRY_ASSIGN(folder, board::linux::MemoryFolder::make(board::linux::MemoryFolder::kParent));
        arguments.admission = folder.file("admission.json");
    }
    QDUINO_TRY_ASSIGN(const Built built, build_sketch(arguments, {BoardKind::linux}));
    QDUINO_TRY_ASSIGN(KernelTracer tracer, KernelTracer::start());
    QDUINO_TRY_ASSIGN(const LinuxRun ended, run_on_linux(arguments, built, read.board.linux, &asked));
    if (ended.status == 2) return 2;  // refused: there was nothing to record
    KernelTraceReader reader(board::linux::BudgetKeeper::signal_number(), ::getpid());
    std::optional<TracedPicture> drawing;
    if (!picture.empty()) {
        drawing.emplace(built.sketch.name, admitted_loops(arguments.admission), window);
        reader.draw_into(*drawing);
    }
    QDUINO_TRY(tracer.stop(reader));
    QDUINO_TRY(write_trace(reader, output));
    PinWitness* const pins = ended.pins ? &ended.pins->witness() : nullptr;
    if (pins) QDUINO_TRY(show_pins(*ended.pins, asked, pins_of(*pins, built.sketch.name, asked)));
    if (drawing) {
        QDUINO_TRY(drawing->write(picture, pins));
    }
    return ended.status;
}

Result<int> trace(const Arguments& arguments) {
    QDUINO_TRY_ASSIGN(const std::string output, trace_file(arguments));
    return arguments.on_linux ? trace_on_linux(arguments, output)
                              : become_simulation(arguments, {"--trace", output});
}

constexpr double kProfileSeconds = 10;

/// Runs the program that measures, and returns its status.
Result<int> run_profile(const Arguments& arguments, const Built& built,
                        const board::linux::LinuxConfig& board) {
    if (!arguments.in_simulator) {
        QDUINO_TRY_ASSIGN(const LinuxRun ended, run_on_linux(arguments, built, board, nullptr));
        return ended.status;
    }
    Words command{built.programs[0].string(), "--no-admission"};
    append(command, options_of(arguments));
    return run_in_front(command);
}

Result<int> profile(const Arguments& given) {
    Arguments arguments = given;
    const ReadBoardFile read = board_of(arguments);
    if (!read.ok()) return fail(read.error);
    if (!arguments.length_s) arguments.length_s = kProfileSeconds;
    arguments.best_effort = !arguments.real_time && !arguments.in_simulator;
    QDUINO_TRY_ASSIGN(const Sketch sketch, find_sketch(arguments.sketch));
    QDUINO_TRY_ASSIGN(const std::vector<TabText> tabs, read_tabs(sketch.tabs));
    const BoardKind board = arguments.in_simulator ? BoardKind::sim : BoardKind::linux;
    QDUINO_TRY_ASSIGN(const Built built, build_sketch(arguments, {board}));
    QDUINO_TRY_ASSIGN(const auto folder,
                      board::linux::MemoryFolder::make(board::linux::MemoryFolder::kParent));
    arguments.profile = arguments.output.empty() ? folder.file("profile").string() : arguments.output;
    QDUINO_TRY_ASSIGN(const int status, run_profile(arguments, built, read.board.linux));
    if (status != 0) {
        say(verdict(end_of(built.sketch.name, status)));
        return status;
    }
    QDUINO_TRY_ASSIGN(const std::string profile, posix::read_small_file(arguments.profile));
    if (arguments.in_simulator) return 0;
    return apply_profile(profile, tabs, arguments.write);
}

/// Sends a sketch to another computer, which builds, judges and starts it.
Result<int> upload_there(const Arguments& arguments) {
    QDUINO_TRY_ASSIGN(Sdk sdk, sdk_of_this_program());
    BuildEnvironment environment = environment_of_this_process();
    fs::path place = arguments.sketch;
    if (!arguments.built.empty()) {
        QDUINO_TRY_ASSIGN(const IdeProject project, read_ide_project(arguments.built));
        place = project.sketch;
        environment.qduino_libraries = project.libraries;
    }
    QDUINO_TRY_ASSIGN(const Sketch sketch, find_sketch(place));
    QDUINO_TRY_ASSIGN(const SketchBuild build, SketchBuild::open(std::move(sdk), sketch, environment));
    QDUINO_TRY_ASSIGN(const std::vector<Library> libraries, build.find_libraries());
    QDUINO_TRY_ASSIGN(const auto folder,
                      board::linux::MemoryFolder::make(board::linux::MemoryFolder::kParent));
    const fs::path parcel = folder.file("parcel");
    QDUINO_TRY(pack_sketch(sketch, libraries, parcel));
    Words words{"upload", "--from-stdin"};
    if (arguments.isolate) words.emplace_back("--isolate");
    if (arguments.best_effort) words.emplace_back("--best-effort");
    if (!arguments.board.empty()) append(words, {"--board", arguments.board});
    return send_folder(arguments.to, parcel, words);
}

Result<int> stop_upload(const Arguments& arguments) {
    if (!arguments.to.empty()) return run_remote(arguments.to, {"upload", "--stop"});
    QDUINO_TRY_ASSIGN(const BoardFolder board, BoardFolder::open());
    QDUINO_TRY_ASSIGN(const std::string ended, board.stop());
    say(verdict(ended.empty() ? "no uploaded sketch was running." : ended + " is stopped."));
    return 0;
}

/// What is to be started, and its twin in the simulator, which is asked before.
struct Uploaded {
    std::string name;
    fs::path program, simulated;
};

Result<Uploaded> build_upload(const Arguments& arguments) {
    if (!arguments.built.empty()) {
        return Uploaded{fs::path(arguments.built).stem().string(),
                        built_by_ide(arguments.built, BoardKind::linux),
                        built_by_ide(arguments.built, BoardKind::sim)};
    }
    QDUINO_TRY_ASSIGN(const Built built, build_sketch(arguments, {BoardKind::sim, BoardKind::linux}));
    return Uploaded{built.sketch.name, built.programs[1], built.programs[0]};
}

Result<int> refuse_upload(const Uploaded& made, const BoardFolder& board) {
    const auto old = board.running();
    say(verdict(made.name + " is REFUSED, and was not started." +
                (old ? " " + old->sketch + " runs on." : "")));
    return 2;
}

/// Starts a sketch here, in the place of the one that runs.
Result<int> upload_here(Arguments arguments) {
    QDUINO_TRY_ASSIGN(const BoardFolder board, BoardFolder::open());
    if (arguments.from_stdin) {
        QDUINO_TRY_ASSIGN(arguments.sketch, unpack_sketch(board.incoming()));
    }
    const ReadBoardFile read = board_of(arguments);
    if (!read.ok()) return fail(read.error);
    QDUINO_TRY_ASSIGN(const Sdk sdk, sdk_of_this_program());
    QDUINO_TRY_ASSIGN(const Uploaded made, build_upload(arguments));
    Words judge{made.simulated.string(), "--check"};
    if (!arguments.board.empty()) append(judge, {"--board", arguments.board});
    QDUINO_TRY_ASSIGN(const int judged, run_in_front(judge));
    if (judged == 2) return refuse_upload(made, board);
    if (judged != 0) return judged;
    QDUINO_TRY_ASSIGN(const std::string replaced, board.stop());
    arguments.report = board.report();
    const CommandMaker command = [&](board::linux::MemoryFolder& folder) {
        return linux_command(arguments, made.program, sdk.supervisor, read.board.linux, folder,
                             Behind::nobody);
    };
    QDUINO_TRY_ASSIGN(const std::optional<int> ended, start_kept(board, made.name, command));
    if (ended) {
        say(verdict(end_of(made.name, *ended) +
                    (replaced.empty() ? "" : " " + replaced + " was stopped before.")));
        return *ended;
    }
    say(verdict(made.name + " runs" + (replaced.empty() ? "" : ", in the place of " + replaced) +
                ": 'qduino monitor' shows its Serial."));
    return 0;
}

Result<int> upload(const Arguments& arguments) {
    if (arguments.stop) return stop_upload(arguments);
    return arguments.to.empty() ? upload_here(arguments) : upload_there(arguments);
}

Result<int> monitor(const Arguments& arguments) { return monitor_command(arguments); }

Result<int> vcpu(const Arguments& arguments) { return run_in_vcpu(arguments); }

Result<int> boot_metal(const Arguments& arguments) {
    if (arguments.action == "beside" && is_image(arguments.sketch))  // nothing is to be built
        return run_beside_linux(arguments, arguments.sketch,
                                std::filesystem::path(arguments.sketch).filename());
    QDUINO_TRY_ASSIGN(const Sdk sdk, sdk_of_this_program());
    return metal(arguments, sdk);
}

Result<int> lib(const Arguments& arguments) {
    QDUINO_TRY_ASSIGN(const Sdk sdk, sdk_of_this_program());
    return library_command(arguments, sdk);
}

Result<int> ide(const Arguments& arguments) {
    QDUINO_TRY_ASSIGN(const Sdk sdk, sdk_of_this_program());
    return ide_command(arguments, sdk);
}

Result<int> doctor(const Arguments& arguments) {
    return run_doctor({.json = arguments.json, .root = {}}, stdout);
}

Result<int> restore(const Arguments& arguments) {
    QDUINO_TRY_ASSIGN(const auto restored, board::linux::restore_settings(arguments.settings_state));
    std::printf(restored == board::linux::Restored::undone
                    ? "What a dead sketch had changed on this computer is as it was before.\n"
                    : "Nothing to undo: no sketch has left this computer changed.\n");
    return 0;
}

// In the order of Command.
constexpr std::array kCommands{make_new,   build, run,    sim,     check, trace,  profile, vcpu,
                               boot_metal, lib,   upload, monitor, ide,   doctor, restore};
static_assert(kCommands.size() == static_cast<std::size_t>(Command::completion));

}  // namespace

int run_command(const Arguments& arguments, const CLI::App& parser) {
    if (arguments.command == Command::completion) {
        std::fputs(completion_script(parser, arguments.shell).c_str(), stdout);
        return 0;
    }
    const Result<int> status = kCommands[static_cast<std::size_t>(arguments.command)](arguments);
    return status ? *status : fail(status.error());
}

}  // namespace qduino::apps
