#include "qduino/build/sketch_build.h"

#include <fcntl.h>
#include <sys/file.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "posix/small_file.h"
#include "posix/unique_fd.h"
#include "qduino/common/words.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

Result<int> run_all(const std::vector<BuildStep>& steps, const std::string& sketch, bool verbose) {
    QDUINO_TRY_ASSIGN(const StepsDone done, run_steps(steps, verbose));
    if (done.failed) return make_error(ErrorCode::invalid_argument, sketch, " is not built");
    return done.made;
}

/// What to do about each header that the compiler did not find.
void name_missing_headers(const std::vector<BuildStep>& compiled) {
    std::set<std::string> headers;
    for (const BuildStep& step : compiled) {
        const std::string log = text_of(step.output.string() + ".log");
        if (!fs::exists(step.output)) headers.insert(missing_header(without_colours(log)));
    }
    headers.erase("");
    for (const std::string& header : headers) {
        const std::string stem = fs::path(header).stem().string();
        say("no library here has " + header + ": 'qduino lib search " + stem +
            "' looks for one in Arduino's index.\n");
    }
}

/// Some libraries have a file for each chip, and one of them is for registers that this board has
/// not. Nobody misses it, unless the sketch needs what stands there: then its errors are the cause.
void say_left_out(const std::vector<BuildStep>& compiled, bool is_missed) {
    for (const BuildStep& step : compiled) {
        if (fs::exists(step.output)) continue;
        if (is_missed) std::fputs(without_colours(text_of(step.output.string() + ".log")).c_str(), stderr);
        say(step.title + " failed: " +
            (is_missed ? "it is left out, and the sketch needs it.\n"
                       : "it is left out. The sketch does not need it.\n"));
    }
    if (is_missed) name_missing_headers(compiled);
}

/// What a library's files are compiled with besides. Warnings are its author's business.
Words library_words(const std::vector<Library>& libraries) {
    Words words = include_words(libraries);
    words.emplace_back("-w");
    return words;
}

Result<posix::UniqueFd> lock_folder(const fs::path& folder) {
    std::error_code failed;
    fs::create_directories(folder, failed);
    posix::UniqueFd lock{::open((folder / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)};
    if (failed || !lock.valid() || ::flock(lock.get(), LOCK_EX) != 0) {
        return make_error(ErrorCode::not_permitted,
                          "cannot write here; set XDG_CACHE_HOME to a folder of yours: ", folder.native());
    }
    return lock;
}

}  // namespace

Result<SketchBuild> SketchBuild::open(Sdk sdk, Sketch sketch, const BuildEnvironment& environment) {
    QDUINO_TRY_ASSIGN(const fs::path root, cache_root(environment));
    SketchBuild build(std::move(sdk), std::move(sketch));
    build.home_ = environment.home;
    build.qduino_libraries_ = environment.qduino_libraries;
    build.tools_ = tool_commands(build.sdk_, build.sketch_.folder, environment);
    const ToolCommands& tools = build.tools_;

    Words key{build.sketch_.folder.string(), build.sketch_.name, build.sdk_.file.string()};
    for (const Words* words : {&tools.compile.cpp, &tools.compile.c, &tools.compile.assembler, &tools.link})
        append(key, *words);
    build.root_ = root;
    build.folder_ = root / (build.sketch_.name + "-" + hash_of(key));
    build.generated_ = build.folder_ / "sketch.ino.cpp";
    return build;
}

fs::path SketchBuild::program(BoardKind board) const {
    return folder_ / (sketch_.name + "-" + name_of(board));
}

fs::path SketchBuild::object_of(const fs::path& source) const {
    const fs::path within = source.lexically_relative(sketch_.folder);
    fs::path object = source == generated_      ? folder_ / source.filename()
                      : *within.begin() != ".." ? folder_ / "objects" / within
                                                : folder_ / "libraries" / source.relative_path();
    object += ".o";
    return object;
}

Result<posix::UniqueFd> SketchBuild::lock() const { return lock_folder(folder_); }

bool SketchBuild::is_shared(const Library& library) const {
    return *library.code.lexically_relative(sketch_.folder).begin() == "..";
}

fs::path SketchBuild::shared_folder(const Library& library, const Words& further) const {
    Words key{library.folder.string(), sdk_.file.string()};
    for (const Words* words : {&tools_.compile.cpp, &tools_.compile.c, &tools_.compile.assembler, &further}) {
        for (const std::string& word : *words) {
            if (word != tools_.own_headers) key.push_back(word);
        }
    }
    return root_ / "libraries" / (library.folder.filename().string() + "-" + hash_of(key));
}

/// In the order of their paths: two builds that need the same two wait for each other only in turn.
Result<std::vector<posix::UniqueFd>> SketchBuild::lock_shared(const std::vector<Library>& libraries) const {
    const Words further = library_words(libraries);
    std::set<fs::path> folders;
    for (const Library& library : libraries) {
        if (is_shared(library)) folders.insert(shared_folder(library, further));
    }
    std::vector<posix::UniqueFd> held;
    for (const fs::path& folder : folders) {
        QDUINO_TRY_ASSIGN(posix::UniqueFd lock, lock_folder(folder));
        held.push_back(std::move(lock));
    }
    return held;
}

Result<int> SketchBuild::make(const std::vector<BoardKind>& boards, bool verbose) const {
    QDUINO_TRY_ASSIGN(const posix::UniqueFd held, lock());
    return make_locked(boards, verbose);
}

Result<std::vector<Library>> SketchBuild::find_libraries() const {
    QDUINO_TRY_ASSIGN(const posix::UniqueFd held, lock());
    QDUINO_TRY(run_all({joining()}, sketch_.name, false));
    return libraries();
}

Result<void> SketchBuild::write_compile_commands() const {
    QDUINO_TRY_ASSIGN(const std::vector<Library> used, find_libraries());
    nlohmann::json entries = nlohmann::json::array();
    // clangd asks the compiler itself, without what stands before it here.
    const auto add = [&](const fs::path& file, const Words& command) {
        const auto compiler = std::ranges::find(command, "--");
        const Words bare(compiler == command.end() ? command.begin() : compiler + 1, command.end());
        entries.push_back({{"directory", sketch_.folder}, {"file", file}, {"arguments", bare}});
    };
    for (const fs::path& tab : sketch_.tabs) {
        Words command = tools_.compile.cpp;
        append(command, include_words(used));
        append(command, {"-include", "Arduino.h", "-x", "c++", "-c", tab.string()});
        add(tab, command);
    }
    for (const BuildStep& step : compiling_all(used)) add(step.inputs.front(), step.command);
    return posix::write_file(sketch_.folder / "compile_commands.json", entries.dump(1) + "\n");
}

BuildStep SketchBuild::joining() const {
    BuildStep join{.title = "Joining " + sketch_.name + ".ino",
                   .command = join_command(sdk_, sketch_, generated_),
                   .inputs = sketch_.tabs,
                   .output = generated_,
                   .depfile = {}};
    join.inputs.push_back(sdk_.ino_to_cpp);
    return join;
}

Result<std::vector<Library>> SketchBuild::libraries() const {
    std::vector<fs::path> sources{generated_};
    sources.insert(sources.end(), sketch_.sources.begin(), sketch_.sources.end());
    const LibraryShelf shelf(sketch_, qduino_libraries_, home_);
    QDUINO_TRY_ASSIGN(DiscoveredLibraries found,
                      discover_libraries(shelf, tools_.compile, sources, folder_ / "scan"));
    for (const std::string& note : found.notes) say(note + ".\n");
    for (const Library& library : found.libraries) {
        if (library.compiled_elsewhere) {
            return make_error(
                ErrorCode::unsupported, "the library ", library.name,
                " comes without its sources, compiled for other processors: ", library.folder.native());
        }
    }
    return std::move(found.libraries);
}

BuildStep SketchBuild::compiling(const fs::path& source, const fs::path& object, const std::string& title,
                                 const Words& further) const {
    // The three files of the tool that stands before the compilers.
    const fs::path& tool = sdk_.as_arduino;
    BuildStep step{.title = "Compiling " + title,
                   .command = tools_.compile.for_source(source),
                   .inputs = {source, tool, tool.parent_path() / "own_names.py", sdk_.ino_to_cpp},
                   .output = object,
                   .depfile = object};
    step.depfile += ".d";
    append(step.command, further);
    append(step.command, {"-MD", "-MF", step.depfile.string(), "-c", source.string(), "-o", object.string()});
    return step;
}

/// What many sketches share sees no header of one of them, as with the Arduino builder.
std::vector<BuildStep> SketchBuild::compiling_library(const Library& library, const Words& further) const {
    std::vector<BuildStep> steps;
    const bool shared = is_shared(library);
    const fs::path folder = shared ? shared_folder(library, further) : fs::path{};
    for (const fs::path& source : library.sources()) {
        const std::string within = source.lexically_relative(library.code).string();
        const fs::path object = shared ? folder / (within + ".o") : object_of(source);
        steps.push_back(compiling(source, object, library.name + ": " + within, further));
        if (shared) std::erase(steps.back().command, tools_.own_headers);
        steps.back().may_fail = true;
    }
    return steps;
}

std::vector<BuildStep> SketchBuild::compiling_all(const std::vector<Library>& libraries) const {
    const Words further = include_words(libraries);
    std::vector<BuildStep> steps{
        compiling(generated_, object_of(generated_), sketch_.name + ".ino", further)};
    for (const fs::path& source : sketch_.sources) {
        steps.push_back(compiling(source, object_of(source),
                                  source.lexically_relative(sketch_.folder).string(), further));
    }
    const Words of_libraries = library_words(libraries);
    for (const Library& library : libraries) {
        std::vector<BuildStep> more = compiling_library(library, of_libraries);
        std::ranges::move(more, std::back_inserter(steps));
    }
    return steps;
}

Result<BuildStep> SketchBuild::linking(BoardKind board, const std::vector<BuildStep>& compiled,
                                       const std::vector<Library>& libraries) const {
    BuildStep step{.title = "Linking " + program(board).filename().string(),
                   .command = {},
                   .inputs = {},
                   .output = program(board),
                   .depfile = {}};
    Words objects, ldflags;
    for (const BuildStep& made : compiled) {
        if (!fs::exists(made.output)) continue;
        step.inputs.push_back(made.output);
        objects.push_back(made.output.string());
    }
    for (const Library& library : libraries) {
        for (const std::string& flag : library.ldflags) {
            if (!is_harmless_flag(flag))
                return make_error(ErrorCode::not_permitted, "library ", library.name,
                                  " asks for the linker's flag '", flag,
                                  "', which could run a program: -lNAME, -LFOLDER and -pthread are taken");
        }
        append(ldflags, library.ldflags);
    }
    const Sdk::Linking& with = sdk_.linking(board);
    QDUINO_TRY_ASSIGN(step.command, link_command(tools_, with, objects, ldflags, step.output));
    for (const std::string& library : with.libraries) {
        if (!library.starts_with('-')) step.inputs.emplace_back(library);
    }
    return step;
}

Result<int> SketchBuild::make_locked(const std::vector<BoardKind>& boards, bool verbose) const {
    QDUINO_TRY_ASSIGN(const int joined, run_all({joining()}, sketch_.name, verbose));
    const posix::UniqueFd headers = tools_.headers ? tools_.headers->make(verbose) : posix::UniqueFd{};
    QDUINO_TRY_ASSIGN(const std::vector<Library> used, libraries());
    QDUINO_TRY_ASSIGN(const std::vector<posix::UniqueFd> shared, lock_shared(used));
    const std::vector<BuildStep> compile = compiling_all(used);
    const Result<int> compiled = run_all(compile, sketch_.name, verbose);
    if (!compiled) {
        name_missing_headers(compile);
        return compiled.error();
    }
    std::vector<BuildStep> link;
    for (const BoardKind board : boards) {
        QDUINO_TRY_ASSIGN(BuildStep step, linking(board, compile, used));
        link.push_back(std::move(step));
    }
    const Result<int> linked = run_all(link, sketch_.name, verbose);
    say_left_out(compile, !linked.ok());
    if (!linked) return linked.error();
    return joined + *compiled + *linked;
}

}  // namespace qduino::apps
