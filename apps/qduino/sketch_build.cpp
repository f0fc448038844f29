#include "apps/qduino/sketch_build.h"

#include <fcntl.h>
#include <sys/file.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <system_error>

#include "apps/qduino/words.h"
#include "apps/terminal/message.h"
#include "posix/unique_fd.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// FNV-1a, 64 bits (Fowler, Noll, Vo): tells folders apart; no protection against an attacker.
std::uint64_t hash_of(const Words& words) {
    std::uint64_t hash = 0xcbf29ce484222325u;
    const auto mix = [&hash](unsigned char byte) { hash = (hash ^ byte) * 0x100000001b3u; };
    for (const std::string& word : words) {
        for (const char c : word) mix(static_cast<unsigned char>(c));
        mix(0);
    }
    return hash;
}

/// As the Arduino IDE compiles, leniently, but with the warnings that the IDE would hide. Warnings
/// in our own headers are hidden: they do not concern the user. `while (!flag);` stays, as on an
/// AVR, also where the compiler may assume that it ends.
Words compile_flags(const Sdk& sdk, const Sketch& sketch, bool long_32) {
    Words words{"-O2", "-g1", "-Wall", "-fno-finite-loops", "-fdiagnostics-color=always"};
    append(words, sdk.flags);
    append(words, sdk.compiling);
    if (long_32) words.emplace_back("-DQDUINO_LONG_32");
    for (const std::string& definition : sdk.definitions) words.push_back("-D" + definition);
    words.push_back("-I" + sketch.folder.string());
    for (const std::string& folder : sdk.include) {
        if (folder == "/usr/include") continue;  // is searched anyway, and must stay last
        append(words, {"-isystem", folder});
    }
    return words;
}

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

/// What stands before a compiler, so that it understands a sketch as an Arduino's does: `long` has
/// 32 bits. Our own headers and libraries are compiled already.
Words as_arduino(const Sdk& sdk, bool long_32) {
    Words words{sdk.python, sdk.as_arduino.string()};
    if (!long_32) append(words, {"--long", "64"});
    for (const std::string& folder : sdk.include) append(words, {"--keep", folder});
    words.emplace_back("--");
    return words;
}

}  // namespace

BuildEnvironment environment_of_this_process() {
    const auto value = [](const char* name) {
        const char* text = std::getenv(name);
        return std::string(text ? text : "");
    };
    return {.xdg_cache_home = value("XDG_CACHE_HOME"),
            .home = value("HOME"),
            .qduino_libraries = value("QDUINO_LIBRARIES"),
            .cxx = value("CXX"),
            .cc = value("CC"),
            .cxxflags = value("CXXFLAGS"),
            .cflags = value("CFLAGS"),
            .ldflags = value("LDFLAGS"),
            .long_bits = value("QDUINO_LONG")};
}

Result<fs::path> cache_root(const BuildEnvironment& environment) {
    // A relative $XDG_CACHE_HOME is to be ignored (XDG Base Directory Specification 0.8).
    if (environment.xdg_cache_home.starts_with('/')) return fs::path(environment.xdg_cache_home) / "qduino";
    if (!environment.home.empty()) return fs::path(environment.home) / ".cache" / "qduino";
    return make_error(ErrorCode::not_found,
                      "no folder for what is built: set HOME, or XDG_CACHE_HOME to an absolute path");
}

Result<SketchBuild> SketchBuild::open(Sdk sdk, Sketch sketch, const BuildEnvironment& environment) {
    QDUINO_TRY_ASSIGN(const fs::path root, cache_root(environment));
    SketchBuild build(std::move(sdk), std::move(sketch));
    const Sdk& tools = build.sdk_;
    const Words cxx = environment.cxx.empty() ? tools.cxx : words_of(environment.cxx);
    const bool long_32 = environment.long_bits != "64";
    const Words flags = compile_flags(tools, build.sketch_, long_32);

    build.home_ = environment.home;
    build.qduino_libraries_ = environment.qduino_libraries;
    CompileCommands& compile = build.compile_;
    compile.cpp = compile.c = as_arduino(tools, long_32);
    append(compile.cpp, cxx);
    append(compile.cpp, {"-std=gnu++20", "-fpermissive"});
    append(compile.cpp, flags);
    append(compile.cpp, words_of(environment.cxxflags));
    compile.assembler = environment.cc.empty() ? tools.cc : words_of(environment.cc);
    append(compile.c, compile.assembler);
    compile.c.push_back("-std=gnu17");
    append(compile.c, flags);
    append(compile.c, words_of(environment.cflags));
    append(compile.assembler, {"-x", "assembler-with-cpp"});
    append(compile.assembler, flags);
    build.link_ = cxx;
    append(build.link_, {"-fdiagnostics-color=always"});
    append(build.link_, tools.flags);
    append(build.link_, words_of(environment.ldflags));

    Words key{build.sketch_.folder.string(), build.sketch_.name, tools.file.string()};
    for (const Words* words : {&compile.cpp, &compile.c, &compile.assembler, &build.link_})
        append(key, *words);
    char hash[20];
    std::snprintf(hash, sizeof hash, "-%016llx", static_cast<unsigned long long>(hash_of(key)));
    build.folder_ = root / (build.sketch_.name + hash);
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

Result<int> SketchBuild::make(const std::vector<BoardKind>& boards, bool verbose) const {
    std::error_code failed;
    fs::create_directories(folder_, failed);
    const posix::UniqueFd lock{::open((folder_ / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)};
    if (failed || !lock.valid() || ::flock(lock.get(), LOCK_EX) != 0) {
        return make_error(ErrorCode::not_permitted,
                          "cannot write here; set XDG_CACHE_HOME to a folder of yours: ", folder_.native());
    }
    return make_locked(boards, verbose);
}

BuildStep SketchBuild::joining() const {
    BuildStep join{.title = "Joining " + sketch_.name + ".ino",
                   .command = {sdk_.python, sdk_.ino_to_cpp.string()},
                   .inputs = sketch_.tabs,
                   .output = generated_,
                   .depfile = {}};
    join.inputs.push_back(sdk_.ino_to_cpp);
    for (const fs::path& tab : sketch_.tabs) join.command.push_back(tab.string());
    append(join.command, {"-o", generated_.string()});
    return join;
}

Result<std::vector<Library>> SketchBuild::libraries() const {
    std::vector<fs::path> sources{generated_};
    sources.insert(sources.end(), sketch_.sources.begin(), sketch_.sources.end());
    const LibraryShelf shelf(sketch_, qduino_libraries_, home_);
    QDUINO_TRY_ASSIGN(DiscoveredLibraries found,
                      discover_libraries(shelf, compile_, sources, folder_ / "scan"));
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

BuildStep SketchBuild::compiling(const fs::path& source, const std::string& title,
                                 const Words& further) const {
    const fs::path object = object_of(source);
    BuildStep step{.title = "Compiling " + title,
                   .command = compile_.for_source(source),
                   .inputs = {source, sdk_.as_arduino},
                   .output = object,
                   .depfile = object};
    step.depfile += ".d";
    append(step.command, further);
    append(step.command, {"-MD", "-MF", step.depfile.string(), "-c", source.string(), "-o", object.string()});
    return step;
}

std::vector<BuildStep> SketchBuild::compiling_all(const std::vector<Library>& libraries) const {
    Words further = include_words(libraries);
    std::vector<BuildStep> steps{compiling(generated_, sketch_.name + ".ino", further)};
    for (const fs::path& source : sketch_.sources)
        steps.push_back(compiling(source, source.lexically_relative(sketch_.folder).string(), further));
    further.emplace_back("-w");  // its author's business
    for (const Library& library : libraries) {
        for (const fs::path& source : library.sources()) {
            const std::string within = source.lexically_relative(library.code).string();
            steps.push_back(compiling(source, library.name + ": " + within, further));
        }
    }
    return steps;
}

Result<BuildStep> SketchBuild::linking(BoardKind board, const std::vector<BuildStep>& compiled,
                                       const std::vector<Library>& libraries) const {
    BuildStep step{.title = "Linking " + program(board).filename().string(),
                   .command = link_,
                   .inputs = {},
                   .output = program(board),
                   .depfile = {}};
    for (const BuildStep& made : compiled) {
        step.inputs.push_back(made.output);
        step.command.push_back(made.output.string());
    }
    const Sdk::Linking& with = sdk_.linking(board);
    step.command.emplace_back("-Wl,--start-group");
    append(step.command, with.libraries);
    step.command.emplace_back("-Wl,--end-group");
    append(step.command, with.options);
    for (const Library& library : libraries) append(step.command, library.ldflags);
    append(step.command, {"-o", step.output.string()});
    for (const std::string& library : with.libraries) {
        if (library.starts_with('-')) continue;
        if (!fs::exists(library)) {
            return make_error(ErrorCode::not_found,
                              "QduinoMC is not built whole; there, run 'cmake --build --preset release "
                              "--target qduino'. Missing: ",
                              library);
        }
        step.inputs.emplace_back(library);
    }
    return step;
}

Result<int> SketchBuild::make_locked(const std::vector<BoardKind>& boards, bool verbose) const {
    QDUINO_TRY_ASSIGN(const int joined, run_all({joining()}, sketch_.name, verbose));
    QDUINO_TRY_ASSIGN(const std::vector<Library> used, libraries());
    const std::vector<BuildStep> compile = compiling_all(used);
    std::vector<BuildStep> link;
    for (const BoardKind board : boards) {
        QDUINO_TRY_ASSIGN(BuildStep step, linking(board, compile, used));
        link.push_back(std::move(step));
    }
    const Result<int> compiled = run_all(compile, sketch_.name, verbose);
    if (!compiled) {
        name_missing_headers(compile);
        return compiled.error();
    }
    QDUINO_TRY_ASSIGN(const int linked, run_all(link, sketch_.name, verbose));
    return joined + *compiled + linked;
}

}  // namespace qduino::apps
